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

template <class Real>
struct RowPointers {
  Real* p[directions];
  Real wall_term[directions];  ///< added to populations that leave the wall; 0 in even steps
};

}  // namespace hemowalk::lbm
