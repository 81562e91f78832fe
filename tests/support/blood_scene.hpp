#pragma once
/// \file The paper's blood in a box of any size: packed, or with cells that a test places.

#include "core/data/scene.hpp"
#include "resolved/resolve.hpp"

namespace hemowalk::test {

/// Kinds 0, red cells, and 1, rigid platelets; no cells yet. \p size in um.
inline data::Scene plasma_scene(const data::Vec3& size, double acceleration = 1) {
  data::Scene scene;
  for (int d = 0; d < 3; ++d) scene.domain.size[d] = 1e-6 * size[d];
  scene.acceleration = acceleration;
  data::Kind rbc, platelet;
  rbc.name = "rbc";
  platelet.name = "platelet";
  platelet.shape.type = data::Shape::Type::platelet;
  platelet.subdivision = 4;
  platelet.law = data::Kind::Law::rigid;
  scene.cells.kinds = {rbc, platelet};
  return scene;
}

/// \p size in um.
inline data::Scene blood_scene(const data::Vec3& size, double hematocrit, std::uint64_t seed = 1) {
  data::Scene scene = plasma_scene(size);
  scene.cells.hematocrit = hematocrit;
  scene.cells.platelets_per_rbc = 0.2;
  scene.seed = seed;
  return scene;
}

}  // namespace hemowalk::test
