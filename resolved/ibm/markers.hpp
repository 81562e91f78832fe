#pragma once
/// \file Markers: interpolation and spreading between Lagrangian points and a Block, deterministic and
/// without atomics.
///
/// Markers are kept in tiles: slabs of five lattice planes along z, then strips along y. A kernel reaches
/// four planes and a marker may travel one node in any direction between two sorts, so slabs of one colour
/// (even or odd) never touch the same node and are spread at the same time; within a slab the order is fixed,
/// so sums do not depend on the number of threads.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/array.hpp"
#include "core/block.hpp"
#include "resolved/ibm/halo.hpp"
#include "resolved/ibm/kernel.hpp"

namespace hemowalk::ibm {

/// Integer lattice node near a body: marker coordinates are given relative to it, so that single precision
/// holds them to 1e-6 of a lattice spacing wherever the body is.
using Origin = std::array<std::int32_t, 3>;

template <class Real>
class Markers {
 public:
  /// \p body_of: the body of each marker, or a negative number for an unused slot (idle SIMD lane).
  Markers(const Block& block, const Faces& faces, Kernel kernel, const std::vector<std::int32_t>& body_of);

  /// Another set of markers from now on, numbered as \p body_of; the next locate() sorts. Memory only grows.
  void assign(const std::vector<std::int32_t>& body_of);

  /// Takes the positions origin[body] + local[marker] (lattice units from the block's corner), finds base
  /// nodes and fractions, and sorts again if a marker left the neighbourhood of its tile. Cost: one pass over
  /// the markers. \throws PhysicsError naming the marker when one is not finite, lies outside the walls or
  /// more than one node outside a block that is not periodic along z.
  void locate(View<const Origin> origin, View<const Node4<Real>> local);

  /// out[m] = sum over nodes of phi(x - X_m) field(x), all four components.
  void interpolate(View<const Node4<Real>> field, View<Node4<Real>> out) const;

  /// field(x) += sum over markers of phi(x - X_m) value[m], components x, y, z. Adjoint of interpolate.
  /// The field's halo must be folded afterwards (fold_force_halo).
  void spread(View<const Node4<Real>> value, View<Node4<Real>> field) const;

  /// The present sort, exactly: sums depend on the order of markers, and a restart must go on in the same
  /// order.
  std::vector<std::byte> save() const;
  /// \throws InputError if \p state was saved by other markers.
  void load(View<const std::byte> state);

  std::size_t active() const { return active_; }
  /// Sorts made so far; for benchmarks and tests.
  std::int64_t sorts() const { return sorts_; }

 private:
  /// Base node (lowest of the 4 x 4 x 4) and fractions: 16 bytes in single precision.
  struct Site {
    std::uint32_t base;
    Real fx, fy, fz;
  };
  struct Home {  ///< where a marker was at the last sort: its node, wrapped, and the periods taken off
    std::int16_t slab = 0;
    std::array<std::int8_t, 3> wraps{};
  };
  static constexpr int slab_planes = 5, strip_rows = 8, sort_chunks = 64;

  bool place(View<const Origin> origin, View<const Node4<Real>> local);
  void sort(View<const Origin> origin, View<const Node4<Real>> local);
  template <Kernel kernel>
  const Node4<Real>* under_kernel(const Node4<Real>* field, std::size_t slot) const;
  template <Kernel kernel>
  void interpolate_with(View<const Node4<Real>> field, View<Node4<Real>> out) const;
  template <Kernel kernel>
  void spread_with(View<const Node4<Real>> value, View<Node4<Real>> field) const;

  Block block_;
  Faces faces_;
  Kernel kernel_;
  std::size_t count_, active_ = 0;
  std::vector<std::int32_t> body_;
  int slabs_, strips_;
  bool sorted_ = false;
  std::int64_t sorts_ = 0;
  Array<Site> sites_;                  ///< in tile order
  Array<std::uint32_t> marker_;        ///< tile order -> marker
  Array<std::uint32_t> slot_;          ///< marker -> tile order
  Array<Home> home_;                   ///< per marker
  Array<std::uint32_t> tile_;          ///< per marker, scratch of the sort
  std::vector<std::uint32_t> counts_;  ///< [tile][chunk], scratch of the sort
  std::vector<std::uint32_t> slab_begin_;
};

}  // namespace hemowalk::ibm
