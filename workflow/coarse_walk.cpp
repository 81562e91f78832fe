#include "workflow/coarse_walk.hpp"

#include <algorithm>
#include <cmath>

#include "coarse/simulation.hpp"

namespace hemowalk::workflow {
namespace {

constexpr std::int64_t walkers_per_bin = 4096;

/// Divides the shortest lag; the rms step stays below an eighth of the gap, as the walk demands.
double time_step(const data::TransportLaw& law, double gap, double shortest_lag) {
  double D = law.core.D;
  for (const double d : law.profile.D) D = std::max(D, d);
  const double dt = std::min(std::max(law.valid.dt_min, 5e-3), gap * gap / (128 * D));
  return shortest_lag / std::ceil(shortest_lag / dt * (1 - 1e-12));
}

}  // namespace

calibration::Walk coarse_walk() {
  return [](const data::TransportLaw& law, const std::array<double, 2>& walls, int bins,
            const std::vector<double>& lags) {
    coarse::Case c;
    c.height = walls[1] - walls[0];
    c.bottom = c.top = {coarse::Face::Type::reflect, 0, 0};
    c.walkers = walkers_per_bin;
    c.dt = time_step(law, c.height, *std::min_element(lags.begin(), lags.end()));
    c.output = lags;
    std::sort(c.output.begin(), c.output.end());
    c.end = c.output.back();
    coarse::RunOptions options;
    options.bins = bins;
    options.law_draws = 0;
    std::vector<std::vector<double>> P(lags.size());
    for (int i = 0; i < bins; ++i) {
      c.release = {c.height * (1.0 * i / bins), c.height * ((i + 1.0) / bins)};
      c.seed = static_cast<std::uint64_t>(i) + 1;
      const auto result = coarse::run(c, law, options);
      for (std::size_t l = 0; l < lags.size(); ++l) {
        // Output times are rounded to whole steps, and two may become one.
        const auto nearest = std::min_element(
            result.time.begin(), result.time.end(),
            [&](double a, double b) { return std::abs(a - lags[l]) < std::abs(b - lags[l]); });
        const auto at = nearest - result.time.begin();
        for (int j = 0; j < bins; ++j)
          P[l].push_back(result.profile.c[static_cast<std::size_t>(at * bins + j)] / bins);
      }
    }
    return P;
  };
}

}  // namespace hemowalk::workflow
