#pragma once
/// \file What the workflow asks about a scene before it runs: can it, and what will it cost.

#include <limits>
#include <string>
#include <vector>

#include "core/data/scene.hpp"

namespace hemowalk::workflow {

/// What a run is expected to cost; NaN = not known.
struct Cost {
  double wall = std::numeric_limits<double>::quiet_NaN();    ///< s
  double memory = std::numeric_limits<double>::quiet_NaN();  ///< bytes
  double disk = std::numeric_limits<double>::quiet_NaN();    ///< bytes
};

/// Physics pre-flight: every problem as text, empty when the scene can run.
std::vector<std::string> scene_problems(const data::Scene& scene);

/// Estimate from the numbers of nodes, markers, steps and samples; good to a factor of two.
Cost scene_cost(const data::Scene& scene);

/// "30 red cells, 6 platelets, 64000 nodes, 12800 steps": what `check` tells.
std::string scene_summary(const data::Scene& scene);

}  // namespace hemowalk::workflow
