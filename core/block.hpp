#pragma once
/// \file Block: a box of lattice nodes with a halo, the unit of decomposition. A run is one block or many.

#include <cstddef>
#include <cstdint>

#include "core/portability.hpp"

namespace hemowalk {

/// Four numbers per node: three components and one companion (density beside velocity, padding beside force).
/// One cache line holds the fields of four nodes that are neighbours along x.
template <class Real>
struct alignas(4 * sizeof(Real)) Node4 {
  Real x, y, z, w;
};

/// Interior nodes (0..nx-1, 0..ny-1, 0..nz-1) and `halo` more on every side.
/// Node (i, j, k) sits at ((i + 1/2), (j + 1/2), (k + 1/2)) dx from the block's corner, so that half-way
/// bounce-back walls at j = -1/2 and j = ny - 1/2 lie exactly on y = 0 and y = ny dx.
/// The halo holds neighbours or periodic images; beyond a wall it holds the wall's velocity (fields read by
/// interpolation) or receives the wall's share of the force (fields written by spreading).
struct Block {
  /// Half the support of phi4, and one node that markers may travel between two sorts.
  static constexpr int halo = 3;

  int nx = 0, ny = 0, nz = 0;

  HEMO_HD constexpr std::size_t row() const { return static_cast<std::size_t>(nx) + 2 * halo; }
  HEMO_HD constexpr std::size_t plane() const { return row() * (static_cast<std::size_t>(ny) + 2 * halo); }
  /// Nodes including the halo: the length of a field.
  HEMO_HD constexpr std::size_t size() const { return plane() * (static_cast<std::size_t>(nz) + 2 * halo); }
  HEMO_HD constexpr std::size_t interior() const { return static_cast<std::size_t>(nx) * ny * nz; }
  /// Position of node (i, j, k) in a field; each index may lie in [-halo, n + halo).
  HEMO_HD constexpr std::size_t at(int i, int j, int k) const {
    return (static_cast<std::size_t>(k + halo) * (static_cast<std::size_t>(ny) + 2 * halo) +
            static_cast<std::size_t>(j + halo)) *
               row() +
           static_cast<std::size_t>(i + halo);
  }
};

}  // namespace hemowalk
