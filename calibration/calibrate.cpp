/// \file calibrate(): the steps from trajectories to a transport law, in the order in which they are
/// reported.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "calibration/calibration.hpp"
#include "calibration/diffusivity.hpp"
#include "calibration/gate.hpp"
#include "calibration/holdout.hpp"
#include "calibration/local_law.hpp"
#include "calibration/msd.hpp"
#include "calibration/resampling.hpp"
#include "calibration/tracks.hpp"
#include "calibration/trends.hpp"
#include "calibration/verdict.hpp"
#include "core/check.hpp"
#include "core/provenance.hpp"
#include "core/statistics.hpp"

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

constexpr int profile_nodes = 65;
constexpr std::size_t law_draws = 64;

/// The law that half of the cells gives, as it would be handed on: \p law with its D(y) and v(y).
data::TransportLaw law_of(const LocalFit& half, data::TransportLaw law) {
  law.profile.D_draws.clear(), law.profile.v_draws.clear();
  for (std::size_t k = 0; k < law.profile.y.size(); ++k) {
    law.profile.D[k] = half.law.D(law.profile.y[k]);
    law.profile.v[k] = half.law.v(law.profile.y[k]);
  }
  law.core.D = half.law.mean_D(law.core.y_range[0], law.core.y_range[1]);
  return law;
}

/// Tabulates the smooth local law wall to wall, with the spread of its draws.
void set_profile(Calibration& c, const LocalFit& fit) {
  auto& p = c.law.profile;
  auto& s = c.smooth;
  for (int k = 0; k < profile_nodes; ++k)
    p.y.push_back(c.walls_y[0] + (c.walls_y[1] - c.walls_y[0]) * k / (profile_nodes - 1));
  const auto tabulate = [&](const LocalLaw& law, std::vector<double>& D, std::vector<double>& v) {
    for (double y : p.y) {
      D.push_back(law.D(y));
      v.push_back(law.v(y));
    }
  };
  tabulate(fit.law, p.D, p.v);
  std::vector<std::vector<double>> D(fit.draws.size()), v = D;
  for (std::size_t b = 0; b < fit.draws.size(); ++b) tabulate(fit.draws[b], D[b], v[b]);
  s.y = p.y;
  s.D = p.D;
  s.v = p.v;
  s.density = fit.law.equilibrium(p.y);
  for (std::size_t k = 0; k < p.y.size(); ++k) {
    std::vector<double> d, w;
    for (std::size_t b = 0; b < fit.draws.size(); ++b) {
      d.push_back(D[b][k]);
      w.push_back(v[b][k]);
    }
    // Half the 68 % interval: the draws of ln D are Gaussian, those of D are skewed where little is known.
    s.sigma.push_back((quantile(d, 0.8413) - quantile(d, 0.1587)) / 2);
    s.v_sigma.push_back((quantile(w, 0.8413) - quantile(w, 0.1587)) / 2);
  }
  D.resize(std::min(D.size(), law_draws));
  v.resize(std::min(v.size(), law_draws));
  // A resample without displacements somewhere has no law there; a file holds numbers only.
  const auto finite = [](const std::vector<double>& x) {
    return std::all_of(x.begin(), x.end(), [](double y) { return std::isfinite(y); });
  };
  for (std::size_t b = 0; b < D.size(); ++b)
    if (finite(D[b]) && finite(v[b]))
      p.D_draws.push_back(std::move(D[b])), p.v_draws.push_back(std::move(v[b]));
}

/// Cell-free layer from the red cells' profile (unknown without one), and what happens near the walls.
void set_walls(Calibration& c, const std::vector<data::Trajectories>& runs, const Ensemble& e,
               const Layer& core) {
  const Layer rich = rbc_rich_layer(runs, e.t0);
  const bool known = rich.high > rich.low;
  c.law.cell_free_layer =
      known ? (rich.low - e.walls[0] + e.walls[1] - rich.high) / 2 : std::numeric_limits<double>::quiet_NaN();
  // Without red cells: 4 um below the box's floor and ceiling, the thickness of a cell-free layer at 35 %.
  const double outside = (e.height - (e.walls[1] - e.walls[0])) / 2;
  c.residence =
      residence(e, core, known ? std::max(c.law.cell_free_layer, 1e-6) : 4e-6 - std::max(0.0, outside));
}

void set_steps(Calibration& c, const Ensemble& e, const Layer& core, const Lags& lags, const Walk& walk) {
  const HalfFits halves = fit_halves(e, lags.plateau);
  c.holdout = hold_out(e, core, propagated(halves));
  const StepSelection steps = select_step_law(e, core, halves, lags.memory.memory);
  c.step_choices = steps.choices;
  c.step_reason = steps.law.kind + ": " + steps.reason;
  c.law.step_law = steps.law;
  c.law.valid.dt_min = steps.dt_min;
  if (walk)
    c.holdout_walk = hold_out(e, core, [&](std::size_t half, const std::vector<double>& at) {
      const int n = halves[half].cells;
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      std::vector<Eigen::MatrixXd> P;
      for (const auto& rows : walk(law_of(halves[half], c.law), e.walls, n, at))
        P.emplace_back(Eigen::Map<const RowMajor>(rows.data(), n, n));
      return P;
    });
}

/// How D follows shear and hematocrit, and where the law may be used.
void set_validity(Calibration& c, const Ensemble& e, const Layer& core, const LocalFit& fit) {
  const ShearExponent n = shear_exponent(e, core, fit);
  c.law.scaling.shear_exponent = n.n;
  c.law.scaling.sigma = n.sigma;
  c.shear_note = n.note;
  // A single condition vouches for itself and its neighbourhood: a factor 2 in shear, 0.05 in hematocrit.
  if (e.shear_rate > 0) {
    const double low = n.measured ? std::min(n.low, e.shear_rate) : e.shear_rate;
    const double high = n.measured ? std::max(n.high, e.shear_rate) : e.shear_rate;
    c.law.valid.shear_rate = {low / 2, high * 2};
  }
  const double h = c.law.conditions.hematocrit;
  if (std::isfinite(h)) c.law.valid.hematocrit = {std::max(0.0, h - 0.05), std::min(1.0, h + 0.05)};
}

void set_verdict(Calibration& c, const data::Trajectories& first) {
  Ours ours;
  ours.particle = c.kind;
  ours.D = c.law.core.D;
  ours.sigma = c.law.core.D_sigma;
  ours.shear_rate = c.law.conditions.shear_rate;
  ours.hematocrit = c.law.conditions.hematocrit;
  ours.gate_passed = c.law.gate.passed;
  ours.imported = first.version == "import";
  c.verdict = compare_with_literature(ours, read_literature(literature_text));
}

/// What a reader of the number must know.
void set_warnings(Calibration& c, const data::Trajectories& first, bool memory_at_limit) {
  if (!c.law.gate.passed) {
    std::string names;
    for (const auto& f : c.law.gate.findings)
      if (!f.passed) names += (names.empty() ? "" : ", ") + f.name;
    c.warnings.push_back("ARTEFACT GATE FAILED (" + names +
                         "): D below is not fit to be used as a property of blood");
  }
  if (c.n_runs < 3)
    c.warnings.push_back("errors are over the cells of " + std::to_string(c.n_runs) +
                         " packing(s) only: cells of one box share its flow; run at least 3");
  if (!std::isfinite(first.kappa_damping) || !std::isfinite(first.t_c))
    c.warnings.push_back(
        "damping or shape-recovery time of the red cells not stated: D cannot be tied to them");
  const Estimate *line = c.find("gls"), *gk = c.find("green_kubo");
  for (const Estimate* other : {line, gk})
    if (std::abs(other->D - c.law.core.D) > 3 * std::hypot(other->sigma, c.law.core.D_sigma))
      c.warnings.push_back(other->name + " disagrees with the core value by more than three standard errors");
  if (memory_at_limit)
    c.warnings.push_back(
        "the velocity remembers longer than lags of an eighth of the window can tell: D may still rise; run "
        "longer");
  if (c.law.core.D_sigma > 0.25 * c.law.core.D)
    c.warnings.push_back("the error of D exceeds 25 %: more platelet-seconds are needed (plan)");
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

  const Lags lags = choose_lags(ensemble, core, options);
  const LocalFit local = fit_local_law(ensemble, lags.plateau, resampling, options.bootstrap);
  c.estimators = estimators(ensemble, core, paper, lags, resampling, local);

  for (const auto& [layer, name] : {std::pair{all, "all"}, std::pair{core, "core"}}) {
    c.msd.push_back(single_origin_curve(ensemble, layer, name));
    c.msd.push_back(time_averaged_curve(ensemble, layer, name, {lags.low, lags.high}));
  }
  c.profile = kramers_moyal(binned_moments(ensemble, ensemble.steps(lags.plateau), profile_bins(ensemble)),
                            resampling);
  c.kurtosis = kurtosis_of(ensemble, core);

  const auto [best, reason] = recommend(c.estimators, lags);
  require(!std::isfinite(best.D) || best.D > 0, [&] {
    return "D by " + best.name + " comes out as " + std::to_string(best.D * 1e12) +
           "e-12 m2/s (memory or walls rule at this lag) run longer, raise t0 or give another lag";
  });
  require(std::isfinite(best.D) && std::isfinite(best.sigma), [&] {
    return "no D in the core layer " + std::to_string(core.low * 1e6) + " .. " +
           std::to_string(core.high * 1e6) +
           " um (fewer than two cells with displacements start there) widen the layer or add cells";
  });
  c.core_estimator = best.name;
  c.core_reason = reason;
  c.law.conditions = conditions_of(runs, ensemble);
  c.law.core = {best.D, best.sigma, best.lag, c.core};
  c.law.memory = lags.memory.memory;
  c.law.gate = artefact_gate(runs, ensemble);
  set_profile(c, local);
  set_walls(c, runs, ensemble, core);
  set_steps(c, ensemble, core, lags, options.walk);
  set_validity(c, ensemble, core, local);
  set_verdict(c, runs.front());
  set_warnings(c, runs.front(), lags.memory.at_limit);
  for (const auto& r : runs) c.law.provenance.inputs_sha256.push_back(r.input_sha256);
  c.law.provenance.version = version();
  c.law.provenance.seed = options.seed;
  c.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return c;
}

}  // namespace hemowalk::calibration
