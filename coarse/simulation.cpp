#include "coarse/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>

#include "coarse/device_walkers.hpp"
#include "coarse/fokker_planck.hpp"
#include "coarse/slab_law.hpp"
#include "coarse/walkers.hpp"
#include "core/check.hpp"

namespace hemowalk::coarse {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Output times in whole steps.
std::vector<std::int64_t> output_steps(const Case& c, std::vector<std::string>& warnings) {
  std::vector<std::int64_t> steps;
  for (const double t : c.output.empty() ? std::vector<double>{c.end} : c.output) {
    require(t >= 0 && t <= c.end * (1 + 1e-9), [&] {
      return fmt::format("output time {:g} s lies outside the run (0 to {:g} s) correct output or end", t,
                         c.end);
    });
    const std::int64_t step = std::llround(t / c.dt);
    const double rounded = static_cast<double>(step) * c.dt;
    if (std::abs(rounded - t) > 1e-6 * c.dt)
      warnings.push_back(
          fmt::format("output at {:g} s is given at {:g} s (whole steps of {:g} s) choose a dt that "
                      "divides the output times",
                      t, rounded, c.dt));
    if (steps.empty() || step > steps.back()) steps.push_back(step);
  }
  require(steps.back() < state::last_release, "the run has more than 5e8 steps (dt is very short) raise dt");
  return steps;
}

/// Findings that concern the discretisation rather than the law.
void check_step(const Case& c, const SlabLaw& law, std::vector<std::string>& warnings) {
  double worst = 0;
  for (std::size_t i = 0; i < law.cells(); ++i) {
    const double slope = std::abs(law.D[i + 1] - law.D[i]) / law.spacing();
    const double D = std::min(law.D[i], law.D[i + 1]);
    worst = std::max(worst, slope * std::sqrt(2 * D * c.dt) / D);
  }
  if (worst > 0.5)
    warnings.push_back(fmt::format("D changes by {:.0f} % within one step (dt = {:g} s) use dt <= {:.2g} s",
                                   100 * worst, c.dt, c.dt * std::pow(0.3 / worst, 2)));
}

double layer_of(const data::TransportLaw& law) {
  return std::isfinite(law.cell_free_layer) ? law.cell_free_layer : 0;
}

WalkSettings settings_for(const data::TransportLaw& law, const RunOptions& options, std::string& reason,
                          const Case& c) {
  WalkSettings s;
  s.cell_free_layer = layer_of(law);
  s.track_flow_direction = options.track_flow_direction;
  if (law.step_law.kind == "persistent") {
    s.step_law = StepLaw::persistent;
    s.memory = law.step_law.memory > 0 ? law.step_law.memory : law.memory;
    reason = fmt::format("persistent walk (the law's step_law; memory {:g} s, dt {:g} s)", s.memory, c.dt);
  } else if (law.step_law.kind == "heavy_tail") {
    s.step_law = StepLaw::heavy_tail;
    s.tail_exponent = law.step_law.tail_exponent;
    s.tail_fraction = law.step_law.tail_fraction;
    reason = fmt::format("heavy-tailed walk (the law's step_law; tail exponent {:g} in {:g} of the steps)",
                         s.tail_exponent, s.tail_fraction);
  } else {
    require(law.step_law.kind.empty() || law.step_law.kind == "gaussian", [&] {
      return "step_law `" + law.step_law.kind +
             "` is not known (the law file names it) use gaussian, persistent or "
             "heavy_tail";
    });
    reason = c.constant_D
                 ? "Gaussian walk (constant D)"
                 : fmt::format("Gaussian walk (the law's step_law; dt {:g} s, shortest valid {:g} s)", c.dt,
                               law.valid.dt_min);
  }
  return s;
}

int grid_cells(const SlabLaw& law, int bins, int at_least) {
  const int wanted = std::clamp(static_cast<int>(law.cells()), at_least, 2048);
  return (wanted + bins - 1) / bins * bins;
}

/// Calls \p visit(k, solver) at each output time.
template <class Visit>
void solve_equation(const Case& c, const SlabLaw& law, double layer, int cells,
                    const std::vector<std::int64_t>& steps, int steps_per_output, const Visit& visit) {
  FokkerPlanck solver(law, c.bottom, c.top, cells, layer);
  if (c.release) solver.release((*c.release)[0], (*c.release)[1]);
  std::int64_t before = 0;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    solver.advance(static_cast<double>(steps[k] - before) * c.dt, steps_per_output);
    before = steps[k];
    visit(k, solver);
  }
}

/// Spread of the absorbed fraction over the law's ensemble, by the equation: no sampling noise in it.
std::vector<double> law_sigma(const Case& c, const data::TransportLaw& law,
                              const std::vector<std::int64_t>& steps, int draws) {
  const auto members = law_ensemble(law, draws);
  std::vector<double> sigma(steps.size(), std::numeric_limits<double>::quiet_NaN());
  if (members.empty()) return sigma;
  const std::size_t n = members.size(), T = steps.size();
  std::vector<SlabLaw> laws;
  for (const auto& member : members) laws.push_back(map_law(law, c, member));
  std::vector<double> absorbed(n * T);
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t i = 0; i < n; ++i)
    solve_equation(c, laws[i], layer_of(law), grid_cells(laws[i], 64, 512), steps, 100,
                   [&](std::size_t k, const FokkerPlanck& s) { absorbed[i * T + k] = s.absorbed(); });
  for (std::size_t k = 0; k < T; ++k) {
    double mean = 0, square = 0;
    for (std::size_t i = 0; i < n; ++i) mean += absorbed[i * T + k] / static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i) square += std::pow(absorbed[i * T + k] - mean, 2);
    sigma[k] = std::sqrt(square / static_cast<double>(n - 1));
  }
  return sigma;
}

/// Standard error of a fraction of n; half a walker added to both outcomes keeps it honest at 0 and 1.
double binomial_sigma(std::int64_t hits, std::int64_t n) {
  const double k = static_cast<double>(hits), N = static_cast<double>(n);
  return std::sqrt((k + 0.5) * (N - k + 0.5) / (N + 1)) / (N + 1);
}

/// \tparam Ensemble Walkers or DeviceWalkers.
template <class Ensemble>
void walk(Ensemble&& walkers, const Case& c, const std::vector<std::int64_t>& steps,
          const RunOptions& options, Result& result) {
  double walking = 0;
  std::int64_t walked = 0;
  const std::int64_t stride = std::max<std::int64_t>(steps.back() / 100, 512);
  for (const std::int64_t step : steps) {
    const auto leg_start = Clock::now();
    while (walkers.step() < step) {
      walkers.advance_to(std::min(walkers.step() + stride, step));
      walked = walkers.steps_walked();
      if (options.progress)
        options.progress(static_cast<double>(walkers.step()) / static_cast<double>(steps.back()));
    }
    walking += seconds_since(leg_start);
    const auto counts = walkers.count(options.bins);
    const double n = static_cast<double>(c.walkers);
    const std::int64_t absorbed = counts.absorbed[0] + counts.absorbed[1];
    result.absorbed_fraction.push_back(static_cast<double>(absorbed) / n);
    result.absorbed_sigma.push_back(binomial_sigma(absorbed, c.walkers));
    result.trapped_fraction.push_back(static_cast<double>(counts.trapped[0] + counts.trapped[1]) / n);
    for (const std::int64_t in_bin : counts.histogram)
      result.profile.c.push_back(static_cast<double>(in_bin) * options.bins / n);
    if constexpr (requires { walkers.spread(); })
      if (options.track_flow_direction) {
        const auto spread = walkers.spread();
        result.flow.mean_z.push_back(spread.mean);
        result.flow.variance_z.push_back(spread.variance);
      }
  }
  result.walkers = c.walkers;
  result.walker_steps_per_s = walking > 0 ? static_cast<double>(walked) / walking : 0;
}

}  // namespace

std::string place_problem(const Case& c) {
  if (c.place == Place::host || device_present()) return {};
  return c.name + ": " + no_device;
}

Result run(const Case& c, const data::TransportLaw& given, const RunOptions& options) {
  const auto start = Clock::now();
  const auto keeps = [](const Face& f) {
    return f.type == Face::Type::reflect || f.type == Face::Type::periodic;
  };
  require(
      !options.track_flow_direction || (keeps(c.bottom) && keeps(c.top)),
      "the way along the flow was asked for beside a face that takes walkers (its mean would mix those still "
      "walking with those that stopped) use reflecting or periodic faces");
  require(!options.track_flow_direction || c.place == Place::host,
          "the way along the flow was asked for of walkers on the device (they do not keep it) use place: "
          "host");
  data::TransportLaw law = given;
  if (c.constant_D) {
    law = data::TransportLaw::constant(*c.constant_D);
    law.cell_free_layer = given.cell_free_layer;
  }
  Result result;
  result.warnings = c.warnings;
  const auto findings = validity_findings(law, c);
  if (options.strict && !findings.empty()) {
    std::string all;
    for (const auto& f : findings) all += (all.empty() ? "" : "; ") + f;
    throw Refused(all);
  }
  result.warnings.insert(result.warnings.end(), findings.begin(), findings.end());
  const auto steps = output_steps(c, result.warnings);
  const SlabLaw slab = map_law(law, c);
  const WalkSettings settings = settings_for(law, options, result.reason, c);
  check_step(c, slab, result.warnings);
  for (const std::int64_t step : steps) result.time.push_back(static_cast<double>(step) * c.dt);
  for (int i = 0; i < options.bins; ++i) result.profile.y.push_back(c.height * (i + 0.5) / options.bins);

  if (options.fokker_planck) {
    result.method = "fokker_planck";
    result.reason = "Fokker-Planck equation of the Gaussian walk (asked for; no sampling noise)";
    if (c.place == Place::device)
      result.warnings.push_back(
          "place: device has no effect (the equation is solved on the host) walk, or drop it");
    solve_equation(c, slab, layer_of(law), grid_cells(slab, options.bins, 1024), steps, 400,
                   [&](std::size_t, const FokkerPlanck& s) {
                     result.absorbed_fraction.push_back(s.absorbed());
                     result.absorbed_sigma.push_back(0);
                     result.trapped_fraction.push_back(s.trapped());
                     const auto p = s.profile(options.bins);
                     result.profile.c.insert(result.profile.c.end(), p.begin(), p.end());
                   });
  } else {
    if (c.place == Place::host) {
      walk(Walkers(c, slab, settings), c, steps, options, result);
    } else {
      Queue queue(options.device);
      result.reason += ", on the device";
      walk(DeviceWalkers(queue, make_walk(c, slab, settings), c.walkers), c, steps, options, result);
    }
  }
  result.absorbed_law_sigma = law_sigma(c, law, steps, options.law_draws);
  result.wall = seconds_since(start);
  return result;
}

}  // namespace hemowalk::coarse
