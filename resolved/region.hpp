#pragma once
/// \file Region: which lattice nodes the fluid fills, where static solid bounds it (tube, closed surface).

#include <cstdint>
#include <vector>

#include "core/data/scene.hpp"
#include "core/view.hpp"
#include "resolved/units.hpp"

namespace hemowalk::resolved {

/// The part of the box that is fluid. A slab or a periodic box is fluid everywhere: its walls lie between
/// nodes.
class Region {
 public:
  /// \throws InputError for a surface that is not closed or leaves no fluid.
  explicit Region(const data::Scene& scene);

  bool has_solid() const { return tube_radius_ > 0 || !solid_.empty(); }
  /// Is node (i, j, k) of the whole domain static solid? Any periodic image will do.
  bool solid(int i, int j, int k) const;
  /// Signed distance to the surface from a file, dx, positive in the fluid: [k][j][i] at the nodes of the
  /// whole domain; limited to +-gap_limit. Empty for other geometries.
  View<const float> gap() const { return {gap_.data(), gap_.size()}; }
  static constexpr float gap_limit = 6;
  /// Volume that hematocrit refers to, m3: box, tube or the inside of the surface.
  double volume() const { return volume_; }

 private:
  int nx_, ny_, nz_;
  double tube_radius_ = 0;           ///< dx
  std::vector<std::uint8_t> solid_;  ///< [k][j][i], of a surface from a file
  std::vector<float> gap_;           ///< likewise
  double volume_;
};

}  // namespace hemowalk::resolved
