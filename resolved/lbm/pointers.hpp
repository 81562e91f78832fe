#pragma once
/// \file Where the populations of one row are stored right now.

#include "resolved/lbm/collision.hpp"

namespace hemowalk::lbm {

/// Which bounce-back wall a row touches.
enum class Wall { none, lower, upper };

/// Does population \p i leave that wall?
constexpr bool leaves(Wall wall, int i) {
  return (wall == Wall::lower && c[i][1] == 1) || (wall == Wall::upper && c[i][1] == -1);
}

/// What population \p i gains when it leaves a wall of velocity \p u (half-way bounce-back).
template <class Real, class Velocity>
Real wall_kick(int i, const Velocity& u) {
  return Real(6 * weight(i) * (c[i][0] * u[0] + c[i][2] * u[2]));
}

template <class Real>
struct RowPointers {
  Real* p[directions];
  Real wall_term[directions];  ///< added to populations that leave the wall; 0 in even steps
};

}  // namespace hemowalk::lbm
