#include "calibration/gate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/diffusivity.hpp"
#include "calibration/resampling.hpp"
#include "core/statistics.hpp"
#include "core/text.hpp"

namespace hemowalk::calibration {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double uniform_stress = 0.1;  ///< largest spread of the stress over its mean
constexpr double significant =
    3.5;  // standard errors; two-sided p = 5e-4, with about ten bins looked at: 0.5 %
constexpr int velocity_bins = 12;

data::Finding finding(const std::string& name, double value, double limit, bool passed,
                      const std::string& note) {
  // A value that is no number (NaN in the records) stays a failure, but a file holds numbers only.
  return {name, std::isfinite(value) ? value : nan, limit, passed, note};
}

/// Slope of values against y over [low, high], weighted; NaN when fewer than three bins hold cells.
LinearFit slope(const std::vector<double>& y, const std::vector<double>& u, const std::vector<double>& sigma,
                double low, double high) {
  std::vector<double> a, b, s;
  for (std::size_t k = 0; k < y.size(); ++k)
    if (y[k] >= low && y[k] <= high && std::isfinite(u[k]) && sigma[k] > 0) {
      a.push_back(y[k]);
      b.push_back(u[k]);
      s.push_back(sigma[k]);
    }
  LinearFit none;
  none.slope = none.slope_sigma = nan;
  return a.size() < 3 ? none : fit_line(a, b, s);
}

/// Fastest displacement of any cell in one sample against what the wall does in it.
data::Finding fastest(const Ensemble& e, double wall_speed) {
  double most = 0, most_dt = e.interval;
  for (const Path& p : e.paths) {
    const auto& t = e.run_of(p).time;
    for (std::size_t i = std::max<std::size_t>(1, e.run_of(p).origin); i < t.size(); ++i) {
      const double dt = t[i] - t[i - 1];
      const double d = std::hypot(p.x[i] - p.x[i - 1], p.y[i] - p.y[i - 1], p.z[i] - p.z[i - 1]);
      if (d / dt > most / most_dt) {
        most = d;
        most_dt = dt;
      }
    }
  }
  const double ratio = most / (most_dt * wall_speed);
  return finding("max_displacement_over_wall", ratio, 1.25, ratio <= 1.25,
                 formatted("fastest displacement %.3g um in %.3g ms; the wall moves %.3g um", most * 1e6,
                           most_dt * 1e3, wall_speed * most_dt * 1e6));
}

data::Finding jumps(const Ensemble& e) {
  const double limit = jump_threshold(e);
  double n = 0, all = 0, most = 0;
  for (const Path& p : e.paths)
    for (const Segment& s : e.run_of(p).segments)
      for (std::size_t i = s.begin; i + 1 < s.end; ++i) {
        const double d = std::abs(p.y[i + 1] - p.y[i]);
        n += d > limit;
        ++all;
        most = std::max(most, d);
      }
  const double share = n / all;
  return finding(
      "cross_stream_jumps", share, 1e-4, share <= 1e-4,
      formatted(
          "%.0f of %.0f displacements across the stream above %.3g um per sample, longest %.3g um: too fast "
          "for red cells to cause",
          n, all, limit * 1e6, most * 1e6));
}

data::Finding vorticity(const CellVelocity& v, double wall_speed) {
  double most = 0, at = 0, score = 0, largest = 0;
  for (std::size_t k = 0; k < v.y.size(); ++k) {
    if (!std::isfinite(v.across[k]) || !(v.across_sigma[k] > 0)) continue;
    if (std::abs(v.across[k]) > std::abs(most)) {
      most = v.across[k];
      at = v.y[k];
    }
    const double z = std::abs(v.across[k]) / v.across_sigma[k];
    if (z > score) score = z;
    if (z > significant) largest = std::max(largest, std::abs(v.across[k]) / wall_speed);
  }
  return finding(
      "vorticity_velocity_over_wall", std::abs(most) / wall_speed, 0.02, largest <= 0.02,
      formatted(
          "mean velocity along vorticity up to %.3g um/ms (at y = %.3g um, up to %.1f standard errors); "
          "nothing drives a flow there",
          most * 1e3, at * 1e6, score));
}

/// Whether the total shear stress was recorded and is the same at all heights.
bool is_uniform(const std::vector<double>& stress) {
  if (stress.empty()) return false;
  const auto [low, high] = std::minmax_element(stress.begin(), stress.end());
  return *high - *low <= uniform_stress * std::abs(mean(stress));
}

/// u(y) + u(mirrored y) is the same at all heights when the profile is antisymmetric about the middle. Under
/// one stress the halves can only shear differently because more cells are in one than in the other, which is
/// no fault of the solver in a box of few cells: the limit is wider then.
void antisymmetry(const std::vector<double>& y, const std::vector<double>& u,
                  const std::vector<double>& sigma, double wall_speed, bool stress_is_uniform,
                  std::vector<data::Finding>& out) {
  double low = std::numeric_limits<double>::max(), high = -low, low_s = 0, high_s = 0;
  for (std::size_t k = 0; 2 * k + 1 <= y.size(); ++k) {
    const std::size_t m = y.size() - 1 - k;
    const double sum = u[k] + u[m], s = k == m ? 2 * sigma[k] : std::hypot(sigma[k], sigma[m]);
    if (!std::isfinite(sum)) continue;
    if (sum < low) std::tie(low, low_s) = std::pair{sum, s};
    if (sum > high) std::tie(high, high_s) = std::pair{sum, s};
  }
  if (high < low) return;  // no two mirrored heights with cells
  const double value = (high - low) / wall_speed, z = (high - low) / std::hypot(low_s, high_s);
  const double limit = stress_is_uniform ? 0.25 : 0.1;
  out.push_back(finding(
      "velocity_antisymmetry", value, limit, value <= limit || z <= significant,
      formatted(
          "u(y) + u(mirror) varies by %.0f %% of the wall speed (%.0f standard errors): the halves shear "
          "differently%s",
          100 * value, z,
          stress_is_uniform ? ", under the same stress: the cells are unevenly distributed" : "")));
}

void shear(const std::vector<double>& y, const std::vector<double>& u, const std::vector<double>& sigma,
           const Ensemble& e, std::vector<data::Finding>& out) {
  const double gap = e.walls[1] - e.walls[0], nominal = e.shear_rate;
  const auto part = [&](double a, double b) {
    return slope(y, u, sigma, e.walls[0] + a * gap, e.walls[0] + b * gap);
  };
  const LinearFit bottom = part(0, 0.26), top = part(0.74, 1);
  double low = std::numeric_limits<double>::max(), high = -low, low_s = 0, high_s = 0;
  for (double a = 0.2; a < 0.6; a += 0.1) {
    const LinearFit f = part(a - 0.01, a + 0.26);
    if (!std::isfinite(f.slope)) continue;
    if (f.slope < low) std::tie(low, low_s) = std::pair{f.slope, f.slope_sigma};
    if (f.slope > high) std::tie(high, high_s) = std::pair{f.slope, f.slope_sigma};
  }
  if (high < low) return;
  const std::string where =
      formatted("local shear %.0f 1/s at the bottom, %.0f .. %.0f in the core, %.0f at the top; nominal %.0f",
                bottom.slope, low, high, top.slope, nominal);
  out.push_back(finding("core_shear_over_nominal", low / nominal, 0.75,
                        low / nominal >= 0.75 || (0.75 * nominal - low) < significant * low_s, where));
  const double spread = (high - low) / nominal;
  out.push_back(finding("core_shear_spread", spread, 0.5,
                        spread <= 0.5 || high - low < significant * std::hypot(low_s, high_s), where));
}

/// Cells within a fifth of the gap from either wall, time-averaged; the error is over cells.
data::Finding both_walls(const Ensemble& e) {
  const double zone = 0.2 * (e.walls[1] - e.walls[0]);
  double bottom = 0, top = 0, variance = 0;
  for (const Path& p : e.paths) {
    double b = 0, t = 0, n = 0;
    for (std::size_t i = e.run_of(p).origin; i < p.y.size(); ++i) {
      b += p.y[i] < e.walls[0] + zone;
      t += p.y[i] > e.walls[1] - zone;
      ++n;
    }
    bottom += b / n;
    top += t / n;
    variance += (t - b) * (t - b) / (n * n);
  }
  const double ratio = std::max(bottom, top) / std::max(1e-9, std::min(bottom, top));
  const double z = std::abs(top - bottom) / std::sqrt(std::max(variance, 1e-9));
  return finding(
      "wall_symmetry", ratio, 1.5, ratio <= 1.5 || z <= 2,
      formatted("time-averaged cells within %.3g um of the walls: %.1f at the bottom, %.1f at the top (%.1f "
                "standard errors apart)",
                zone * 1e6, bottom, top, z));
}

/// Time-averaged profile of the solver where it was recorded.
struct FlowProfile {
  std::vector<double> y, along, across, stress, sigma;
};
FlowProfile flow_profile(const std::vector<data::Trajectories>& runs, double t0) {
  FlowProfile f;
  const auto& first = runs.front().profile;
  const std::size_t n = first.y.size();
  if (n < 4) return f;
  std::vector<double> square(n, 0);
  f.y = first.y;
  f.along.assign(n, 0);
  f.across.assign(n, 0);
  f.stress.assign(n, 0);
  double times = 0;
  bool has_stress = true;
  for (const auto& run : runs) {
    const auto& p = run.profile;
    if (p.y.size() != n || p.velocity.size() != p.time.size() * n * 3) return {};
    has_stress = has_stress && p.shear_stress.size() == p.time.size() * n;
    for (std::size_t k = 0; k < p.time.size(); ++k) {
      if (p.time[k] < t0) continue;
      ++times;
      for (std::size_t j = 0; j < n; ++j) {
        const double u = p.velocity[(k * n + j) * 3 + 2];
        f.along[j] += u;
        square[j] += u * u;
        f.across[j] += p.velocity[(k * n + j) * 3];
        if (has_stress) f.stress[j] += p.shear_stress[k * n + j];
      }
    }
  }
  if (times < 2) return {};
  for (std::size_t j = 0; j < n; ++j) {
    f.along[j] /= times;
    f.across[j] /= times;
    f.stress[j] /= times;
    // Successive profiles are correlated over about a strain: the scatter in time itself is a safe error.
    f.sigma.push_back(std::sqrt(std::max(0.0, square[j] / times - f.along[j] * f.along[j])) +
                      1e-9 * std::abs(f.along[j]) + 1e-15);
  }
  if (!has_stress) f.stress.clear();
  return f;
}

void stress(const FlowProfile& f, std::vector<data::Finding>& out) {
  if (f.stress.empty()) return;
  const auto [low, high] = std::minmax_element(f.stress.begin(), f.stress.end());
  const double middle = mean(f.stress), spread = (*high - *low) / std::abs(middle);
  out.push_back(finding(
      "stress_uniformity", spread, uniform_stress, spread <= uniform_stress,
      formatted("total shear stress %.4g .. %.4g Pa; in steady Couette flow it is the same at all heights",
                *low, *high)));
}

double largest(const std::vector<double>& values) {
  double m = 0;
  for (double v : values)
    m = std::isfinite(v) ? std::max(m, std::abs(v)) : std::numeric_limits<double>::infinity();
  return m;
}

void bookkeeping(const std::vector<data::Trajectories>& runs, std::vector<data::Finding>& out) {
  double volume = -1, momentum = -1, mass = -1;
  for (const auto& run : runs) {
    for (const auto& [kind, tracks] : run.kinds) {
      const auto found = tracks.observables.find("volume");
      if (found == tracks.observables.end() || tracks.cells() == 0) continue;
      const auto& v = found->second;
      for (std::size_t i = 0; i < v.size(); ++i)
        volume = std::max(volume, std::abs(v[i] / v[i % tracks.cells()] - 1));
    }
    if (!run.diagnostics.volume_error_max.empty())
      volume = std::max(volume, largest(run.diagnostics.volume_error_max));
    if (!run.diagnostics.momentum_residual.empty())
      momentum = std::max(momentum, largest(run.diagnostics.momentum_residual));
    if (!run.diagnostics.mass_error.empty()) mass = std::max(mass, largest(run.diagnostics.mass_error));
  }
  if (volume >= 0)
    out.push_back(
        finding("volume_drift", volume, 0.02, volume <= 0.02, "largest relative change of a cell's volume"));
  if (momentum >= 0)
    out.push_back(finding("momentum_residual", momentum, 1e-3, momentum <= 1e-3,
                          "largest relative residual of fluid + cells + walls"));
  if (mass >= 0)
    out.push_back(finding("mass_error", mass, 1e-3, mass <= 1e-3, "largest relative change of mass"));
}

}  // namespace

CellVelocity cell_velocity(const Ensemble& e, int bins) {
  CellVelocity v;
  const double h = (e.walls[1] - e.walls[0]) / bins;
  const std::vector<double> zero(e.paths.size(), 0);
  std::vector<Ratio> along(static_cast<std::size_t>(bins), Ratio{zero, zero}), across = along;
  for (std::size_t p = 0; p < e.paths.size(); ++p) {
    const Path& path = e.paths[p];
    for (const Segment& s : e.run_of(path).segments)
      for (std::size_t i = s.begin; i + 1 < s.end; ++i) {
        const double y = (path.y[i] + path.y[i + 1]) / 2;
        const auto b =
            static_cast<std::size_t>(std::clamp(static_cast<int>((y - e.walls[0]) / h), 0, bins - 1));
        along[b].numerator[p] += path.z[i + 1] - path.z[i];
        across[b].numerator[p] += path.x[i + 1] - path.x[i];
        along[b].denominator[p] += e.interval;
        across[b].denominator[p] += e.interval;
      }
  }
  for (int b = 0; b < bins; ++b) {
    const auto k = static_cast<std::size_t>(b);
    const bool enough = used_cells(along[k]) >= 3;
    v.y.push_back(e.walls[0] + (b + 0.5) * h);
    v.along.push_back(enough ? along[k].value() : nan);
    v.across.push_back(enough ? across[k].value() : nan);
    v.along_sigma.push_back(enough ? along[k].sigma() : nan);
    v.across_sigma.push_back(enough ? across[k].sigma() : nan);
  }
  return v;
}

data::TransportLaw::Gate artefact_gate(const std::vector<data::Trajectories>& runs, const Ensemble& e) {
  data::TransportLaw::Gate gate;
  auto& f = gate.findings;
  const double wall_speed = e.shear_rate * (e.walls[1] - e.walls[0]);
  const bool couette = runs.front().scene_yaml.find("poiseuille") == std::string::npos && wall_speed > 0;
  if (couette) f.push_back(fastest(e, wall_speed));
  f.push_back(jumps(e));
  if (couette) {
    const CellVelocity cells = cell_velocity(e, velocity_bins);
    const FlowProfile flow = flow_profile(runs, e.t0);
    f.push_back(vorticity(cells, wall_speed));
    const auto& y = flow.y.empty() ? cells.y : flow.y;
    const auto& u = flow.y.empty() ? cells.along : flow.along;
    const auto& s = flow.y.empty() ? cells.along_sigma : flow.sigma;
    antisymmetry(y, u, s, wall_speed, is_uniform(flow.stress), f);
    shear(y, u, s, e, f);
    stress(flow, f);
  }
  f.push_back(both_walls(e));
  bookkeeping(runs, f);
  gate.passed = std::all_of(f.begin(), f.end(), [](const data::Finding& x) { return x.passed; });
  return gate;
}

}  // namespace hemowalk::calibration
