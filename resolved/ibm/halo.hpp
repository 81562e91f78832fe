#pragma once
/// \file Halo of the two coupling fields: the velocity is filled outward, the force is folded inward (its
/// adjoint).

#include <array>

#include "core/block.hpp"
#include "core/view.hpp"

namespace hemowalk::ibm {

/// What lies beyond each face of the block.
struct Faces {
  bool periodic_x = true, periodic_y = false;
  bool periodic_z = true;                            ///< else the halo planes along z belong to other blocks
  std::array<double, 3> lower_wall{}, upper_wall{};  ///< wall velocities (y faces), lattice units
};

/// Fills the halo: periodic images in x, z (and y); beyond a wall every node carries the wall's velocity, so
/// that the part of a kernel that reaches through a wall reads the wall. The planes of other blocks are left
/// alone: they come from there, whole, once this was called there.
template <class Real>
void fill_velocity_halo(const Block& block, const Faces& faces, View<Node4<Real>> velocity);

/// Adds what was spread into the halo to the nodes it stands for; what fell beyond a wall is that wall's
/// impulse. Adjoint of fill_velocity_halo. What was spread into planes of other blocks is added there before
/// they call this. \returns impulse per step on the lower and upper wall, lattice units.
template <class Real>
std::array<std::array<double, 3>, 2> fold_force_halo(const Block& block, const Faces& faces,
                                                     View<Node4<Real>> force);

}  // namespace hemowalk::ibm
