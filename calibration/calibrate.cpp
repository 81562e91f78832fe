/// \file calibrate(): the steps from trajectories to a transport law, in the order in which they are
/// reported.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "calibration/calibration.hpp"
#include "calibration/msd.hpp"
#include "calibration/resampling.hpp"
#include "calibration/tracks.hpp"
#include "core/check.hpp"
#include "core/provenance.hpp"

namespace hemowalk::calibration {
namespace {

Calibration::Kurtosis kurtosis_of(const Ensemble& e, const Layer& core) {
  Calibration::Kurtosis k;
  for (double lag : {1e-3, 2e-3, 5e-3, 10e-3, 20e-3, 50e-3, 100e-3, 200e-3}) {
    const int steps = e.steps(lag);
    if (std::abs(steps * e.interval - lag) > 0.01 * lag || lag > 0.3 * e.window()) continue;
    const LagSums sums = lag_sums(e, core, steps);
    k.lag.push_back(sums.lag);
    k.excess.push_back(excess_kurtosis(sums));
  }
  return k;
}

/// Bins of about 2 um, between 8 and 64 of them.
int profile_bins(const Ensemble& e) {
  return std::clamp(static_cast<int>(std::lround((e.walls[1] - e.walls[0]) / 2e-6)), 8, 64);
}

data::TransportLaw::Conditions conditions_of(const std::vector<data::Trajectories>& runs, const Ensemble& e) {
  const data::Trajectories& first = runs.front();
  data::TransportLaw::Conditions c;
  c.shear_rate = first.shear_rate;
  c.hematocrit = 0;
  for (const auto& r : runs) c.hematocrit += r.hematocrit_true / static_cast<double>(runs.size());
  c.gap = e.walls[1] - e.walls[0];
  c.kappa_damping = first.kappa_damping;
  c.t_c = first.t_c;
  c.Ca = first.Ca;
  c.Re = first.Re;
  return c;
}

}  // namespace

Calibration calibrate(const std::vector<data::Trajectories>& runs, const Options& options) {
  const auto start = std::chrono::steady_clock::now();
  require(options.bootstrap >= 2, "bootstrap needs at least 2 draws (an error is a spread) give 100 or more");
  const Ensemble ensemble = gather(runs, options);
  const Resampling resampling(ensemble, options.bootstrap, options.seed);
  const Layer core = core_layer(runs, ensemble, options), all{ensemble.walls[0] - 1, ensemble.walls[1] + 1};
  const Layer paper = paper_layer(runs, ensemble);

  Calibration c;
  c.kind = options.kind;
  c.n_platelets = static_cast<int>(ensemble.paths.size());
  c.n_runs = static_cast<int>(runs.size());
  c.duration = ensemble.runs.front().time.back() - ensemble.runs.front().time.front();
  c.walls_y = ensemble.walls;
  c.core = {core.low, core.high};

  c.estimators.push_back(
      estimate_ratio("paper", ensemble, resampling, single_origin_slope(ensemble, paper), 0.5));
  c.estimators.push_back(
      estimate_ratio("paper_all", ensemble, resampling, single_origin_slope(ensemble, all), 0.5));
  const double lag = options.lag.value_or(ensemble.shear_rate > 0 ? 2 / ensemble.shear_rate : 20e-3);
  const LagSums plateau = lag_sums(ensemble, core, ensemble.steps(lag));
  c.estimators.push_back(estimate_ratio("plateau", ensemble, resampling, plateau.msd(), 0.5 / plateau.lag));
  c.estimators.back().lag = plateau.lag;

  for (const auto& [layer, name] : {std::pair{all, "all"}, std::pair{core, "core"}}) {
    c.msd.push_back(single_origin_curve(ensemble, layer, name));
    c.msd.push_back(time_averaged_curve(ensemble, layer, name, {plateau.lag, 5 * plateau.lag}));
  }
  c.profile = kramers_moyal(binned_moments(ensemble, plateau.steps, profile_bins(ensemble)), resampling);
  c.kurtosis = kurtosis_of(ensemble, core);

  const Estimate& best = *c.find("plateau");
  c.law.conditions = conditions_of(runs, ensemble);
  c.law.core = {best.D, best.sigma, best.lag, c.core};
  for (const auto& r : runs) c.law.provenance.inputs_sha256.push_back(r.input_sha256);
  c.law.provenance.version = version();
  c.law.provenance.seed = options.seed;
  c.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return c;
}

}  // namespace hemowalk::calibration
