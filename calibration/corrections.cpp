/// \file One-lag estimators corrected for the walls, for the variation of D(y) and for jumps.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "calibration/diffusivity.hpp"
#include "core/statistics.hpp"

namespace hemowalk::calibration {
namespace {
constexpr double red_cell_radius = 4e-6;  // m
}

SlabMsd::SlabMsd(double width, const std::vector<double>& starts, const std::vector<double>& weights)
    : width_(width), amplitude_(512) {
  const double H = width;
  for (std::size_t s = 0; s < starts.size(); ++s) {
    const double y = starts[s];
    at_rest_ += weights[s] * (H * H / 3 - y * H + y * y);
    for (std::size_t m = 0; m < amplitude_.size(); ++m) {
      const double k = static_cast<double>(m + 1), sign = m % 2 ? 1 : -1, q = k * std::numbers::pi;
      amplitude_[m] += weights[s] * 4 * H * std::cos(q * y / H) * (H * sign - y * (sign - 1)) / (q * q);
    }
  }
}

double SlabMsd::operator()(double D, double lag) const {
  double sum = at_rest_;
  for (std::size_t m = 0; m < amplitude_.size(); ++m) {
    const double q = static_cast<double>(m + 1) * std::numbers::pi / width_, decay = D * q * q * lag;
    if (decay > 40) break;
    sum += amplitude_[m] * std::exp(-decay);
  }
  return sum;
}

double SlabMsd::solve(double msd, double lag) const {
  if (!(msd > 0) || msd >= at_rest_) return std::numeric_limits<double>::quiet_NaN();
  double low = 0, high = msd / (2 * lag);
  while ((*this)(high, lag) < msd) high *= 2;
  for (int k = 0; k < 60; ++k) {
    const double middle = (low + high) / 2;
    ((*this)(middle, lag) < msd ? low : high) = middle;
  }
  return (low + high) / 2;
}

Estimate confined(const Ensemble& e, const Layer& layer, double lag, const Resampling& resampling) {
  double low = std::numeric_limits<double>::max(), high = -low;
  for (const Path& p : e.paths)
    for (std::size_t i = e.run_of(p).origin; i < p.y.size(); ++i) {
      low = std::min(low, p.y[i]);
      high = std::max(high, p.y[i]);
    }
  constexpr std::size_t bins = 64;
  std::vector<double> starts(bins), weights(bins, 0);
  double total = 0;
  for (std::size_t b = 0; b < bins; ++b) starts[b] = (high - low) * (static_cast<double>(b) + 0.5) / bins;
  for (const Path& p : e.paths)
    for (std::size_t i = e.run_of(p).origin; i < p.y.size(); ++i)
      if (layer.contains(p.y[i])) {
        weights[std::min(bins - 1, static_cast<std::size_t>(bins * (p.y[i] - low) / (high - low)))] += 1;
        total += 1;
      }
  for (double& w : weights) w /= total;
  const LagSums sums = lag_sums(e, layer, e.steps(lag));
  Estimate out = estimate_ratio("confined", e, resampling, sums.msd(), 0.5 / sums.lag);
  out.lag = sums.lag;
  if (!std::isfinite(out.D)) return out;
  const SlabMsd slab(high - low, starts, weights);
  const auto correct = [&](double D) { return slab.solve(2 * D * sums.lag, sums.lag); };
  const double D = correct(out.D), stretch = (correct(out.D * 1.01) - D) / (0.01 * out.D);
  if (!std::isfinite(D) || !std::isfinite(stretch)) {
    out.note = "MSD at the saturation of the slab: D cannot be told";
    out.D = out.sigma = D;
    return out;
  }
  for (double& c : out.ci68) c = D + stretch * (c - out.D);
  out.sigma *= stretch;
  out.sigma_between_runs *= stretch;
  out.D = D;
  return out;
}

double jump_threshold(const Ensemble& e) {
  if (e.shear_rate > 0) return 5 * e.shear_rate * red_cell_radius * e.interval;
  std::vector<double> steps;
  for (const Path& p : e.paths)
    for (const Segment& s : e.run_of(p).segments)
      for (std::size_t i = s.begin; i + 1 < s.end; ++i) steps.push_back(std::abs(p.y[i + 1] - p.y[i]));
  return 5 * 1.4826 * median(std::move(steps));
}

Estimate without_jumps(const Ensemble& e, const Layer& layer, double lag, const Resampling& resampling) {
  const double limit = jump_threshold(e);
  const auto k = static_cast<std::size_t>(e.steps(lag));
  const std::vector<double> zero(e.paths.size(), 0);
  Ratio msd{zero, zero};
  std::size_t jumps = 0, samples = 0;
  std::vector<double> clean;
  for (std::size_t p = 0; p < e.paths.size(); ++p) {
    const auto& y = e.paths[p].y;
    for (const Segment& s : e.run_of(e.paths[p]).segments) {
      clean.assign(s.end - s.begin, 0);
      for (std::size_t i = s.begin + 1; i < s.end; ++i) {
        const double d = y[i] - y[i - 1];
        const bool jump = std::abs(d) > limit;
        jumps += jump;
        ++samples;
        clean[i - s.begin] = clean[i - 1 - s.begin] + (jump ? 0 : d);
      }
      for (std::size_t i = s.begin; i + k < s.end; ++i) {
        if (!layer.contains(y[i])) continue;
        const double d = clean[i + k - s.begin] - clean[i - s.begin];
        msd.numerator[p] += d * d;
        msd.denominator[p] += 1;
      }
    }
  }
  const double true_lag = static_cast<double>(k) * e.interval;
  Estimate out = estimate_ratio("without_jumps", e, resampling, msd, 0.5 / true_lag);
  out.lag = true_lag;
  char note[160];
  std::snprintf(note, sizeof note, "%zu of %zu one-sample displacements (%.3f %%) above %.3g um removed",
                jumps, samples, 100.0 * static_cast<double>(jumps) / static_cast<double>(samples),
                limit * 1e6);
  if (out.note.empty()) out.note = note;
  return out;
}

Estimate local(const Ensemble& e, const Layer& layer, const Resampling& resampling, const LocalFit& fit) {
  const LagSums sums = lag_sums(e, layer, e.steps(fit.lag));
  const Ratio msd = sums.msd();
  Estimate out = estimate_ratio("local", e, resampling, msd, 0.5 / sums.lag);
  out.lag = sums.lag;
  if (!std::isfinite(out.D)) return out;
  const Propagator propagator(fit.law, fit.cells, fit.lag);
  const double predicted = propagator.msd(layer.low, layer.high);
  const double factor = fit.law.mean_D(layer.low, layer.high) * 2 * fit.lag / predicted;
  // The factor is fitted to the same cells: its draws go with those of the MSD, to first order in the
  // coefficients.
  const Eigen::VectorXd slope =
      fit.law.mean_D_gradient(layer.low, layer.high) / fit.law.mean_D(layer.low, layer.high) -
      propagator.msd_gradient(layer.low, layer.high) / predicted;
  const Eigen::VectorXd centre = fit.law.coefficients();
  std::vector<double> draws;
  for (std::size_t b = 0; b < std::min(fit.draws.size(), static_cast<std::size_t>(resampling.draws())); ++b)
    draws.push_back(0.5 / sums.lag * msd.value(resampling[static_cast<int>(b)]) * factor *
                    std::exp(slope.dot(fit.draws[b].coefficients() - centre)));
  const double between = out.sigma_between_runs * factor, runs = static_cast<double>(e.runs.size());
  out.D *= factor;
  set_errors(out, std::move(draws), {}, {});
  if (between > 0) {
    const double widen = std::sqrt(1 + between * between / runs / (out.sigma * out.sigma));
    out.sigma *= widen;
    out.sigma_between_runs = between;
    for (double& c : out.ci68) c = out.D + widen * (c - out.D);
    out.effective_samples = 2 * (out.D / out.sigma) * (out.D / out.sigma);
  }
  char note[80];
  std::snprintf(note, sizeof note, "plateau times %.4f for walls and D(y) within the lag", factor);
  out.note = note;
  return out;
}

}  // namespace hemowalk::calibration
