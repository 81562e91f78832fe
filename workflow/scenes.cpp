#include "workflow/scenes.hpp"

#include <fmt/format.h>

#include <cmath>
#include <thread>

#if defined(HEMOWALK_WITH_RESOLVED)
#include "resolved/resolve.hpp"
#endif

namespace hemowalk::workflow {

#if defined(HEMOWALK_WITH_RESOLVED)
namespace {

struct Size {
  double nodes = 0, markers = 0, cells = 0, steps = 0;
};

Size size_of(const data::Scene& scene) {
  const auto census = resolved::census(scene);
  const auto vertices = [&](const char* name) {
    const auto* kind = scene.find_kind(name);
    return kind ? 4.0 * kind->subdivision * kind->subdivision + 2 : 0.0;
  };
  Size size;
  const auto& box = scene.domain.size;
  size.nodes = box[0] * box[1] * box[2] / std::pow(scene.fluid.dx, 3);
  size.markers = census.rbc * vertices("rbc") + census.platelets * vertices("platelet");
  size.cells = census.rbc + census.platelets + static_cast<double>(scene.cells.placements.size());
  for (const auto& placement : scene.cells.placements) size.markers += vertices(placement.kind.c_str());
  size.steps = scene.time.end / scene.acceleration / scene.fluid.time_step();
  return size;
}

}  // namespace

std::vector<std::string> scene_problems(const data::Scene& scene) { return resolved::preflight(scene); }

Cost scene_cost(const data::Scene& scene) {
  const Size size = size_of(scene);
  const double precision = scene.fluid.precision == data::Fluid::Precision::double_ ? 2 : 1;
  // Per node 15 ns and per marker 300 ns on two cores, some seconds to pack; populations, velocity and force
  // per node, about 700 bytes of state, weights and solver per marker.
  const double cores = std::max(1U, std::thread::hardware_concurrency());
  Cost cost;
  cost.wall = 4 + size.steps * (size.nodes * 15e-9 * precision + size.markers * 300e-9) * 2 / cores;
  cost.memory = 50e6 + size.nodes * 140 * precision + size.markers * 700;
  cost.disk = 1e6 + scene.time.end / scene.time.sample * size.cells * 13 * 8 + cost.memory / 4;
  return cost;
}

std::string scene_summary(const data::Scene& scene) {
  const auto census = resolved::census(scene);
  const Size size = size_of(scene);
  return fmt::format(
      "{} red cells, {} platelets, {} placed one by one; {:.3g} nodes, {:.3g} markers, {:.3g} steps of "
      "{:.3g} us",
      census.rbc, census.platelets, scene.cells.placements.size(), size.nodes, size.markers, size.steps,
      scene.fluid.time_step() * 1e6);
}
#else
std::vector<std::string> scene_problems(const data::Scene&) {
  return {
      "scenes cannot be resolved (this program was built without the resolved solver) start from "
      "trajectories"};
}
Cost scene_cost(const data::Scene&) { return {}; }
std::string scene_summary(const data::Scene&) { return "valid"; }
#endif

}  // namespace hemowalk::workflow
