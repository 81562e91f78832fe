#include "calibration/diffusivity.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/check.hpp"
#include "core/statistics.hpp"

namespace hemowalk::calibration {
namespace {

/// D(lag) = MSD/(2 lag) with its influences.
struct LagValue {
  double D = 0;
  std::vector<double> influence;
};
LagValue value_at(const Ensemble& e, const Layer& layer, int steps) {
  const LagSums s = lag_sums(e, layer, steps);
  LagValue v{s.msd().value() / (2 * s.lag), s.msd().influence()};
  for (double& p : v.influence) p /= 2 * s.lag;
  return v;
}
/// b - a in units of its own standard error over cells.
double rise(const LagValue& a, const LagValue& b) {
  double s = 0;
  for (std::size_t n = 0; n < a.influence.size(); ++n)
    s += (b.influence[n] - a.influence[n]) * (b.influence[n] - a.influence[n]);
  return (b.D - a.D) / std::sqrt(s);
}

/// MSD/2 of unit D with memory T.
double memory_shape(double t, double T) { return t + T * std::expm1(-t / T); }

constexpr double red_cell_radius = 4e-6;  // m

}  // namespace

double MemoryFit::factor(double lag) const {
  return memory > 0 ? 1 - share + share * memory_shape(lag, memory) / lag : 1;
}

namespace {

/// The least-squares problem of the two-part law over a ladder of lags; solved once per draw.
class MemoryProblem {
 public:
  MemoryProblem(const Ensemble& e, const Layer& layer, double long_lag) {
    for (const LagSums& s : lag_sums(e, layer, lag_ladder(e.steps(long_lag), 6))) {
      const Ratio msd = s.msd();
      const double sigma = msd.sigma();
      if (used_cells(msd) < 2 || !(sigma > 0)) continue;
      msd_.push_back(msd);
      lag_.push_back(s.lag);
      weight_.push_back(1 / (sigma * sigma));
    }
    // Longer memories look like a constant D over these lags: their D would be an extrapolation.
    for (double T = e.interval / 2; T <= 0.25 * long_lag; T *= 1.05) {
      times_.push_back(T);
      for (double t : lag_) shape_.push_back(memory_shape(t, T));
    }
  }
  const std::vector<Ratio>& msd() const { return msd_; }

  /// \p half_msd: MSD/2 at every lag.
  MemoryFit solve(const std::vector<double>& half_msd) const {
    double tt = 0, tm = 0, mm = 0;
    for (std::size_t k = 0; k < lag_.size(); ++k) {
      tt += weight_[k] * lag_[k] * lag_[k];
      tm += weight_[k] * lag_[k] * half_msd[k];
      mm += weight_[k] * half_msd[k] * half_msd[k];
    }
    MemoryFit best{0, 0, tm / tt};
    double least = mm - tm * tm / tt;
    for (std::size_t j = 0; j < times_.size(); ++j) {
      const double* b = &shape_[j * lag_.size()];
      double tb = 0, bb = 0, bm = 0;
      for (std::size_t k = 0; k < lag_.size(); ++k) {
        tb += weight_[k] * lag_[k] * b[k];
        bb += weight_[k] * b[k] * b[k];
        bm += weight_[k] * b[k] * half_msd[k];
      }
      const double det = tt * bb - tb * tb;
      double free = (tm * bb - bm * tb) / det, kept = (tt * bm - tb * tm) / det;
      if (kept < 0) continue;
      if (free < 0) std::tie(free, kept) = std::pair{0.0, bm / bb};
      const double chi = mm - free * tm - kept * bm;  // at the least-squares point
      if (chi < least) {
        least = chi;
        best = {times_[j], kept / (free + kept), free + kept};
      }
    }
    return best;
  }

 private:
  std::vector<Ratio> msd_;
  std::vector<double> lag_, weight_, times_, shape_;
};

std::vector<double> half_values(const std::vector<Ratio>& msd, const std::uint16_t* weight) {
  std::vector<double> h;
  for (const Ratio& r : msd) h.push_back((weight ? r.value(weight) : r.value()) / 2);
  return h;
}

}  // namespace

MemoryFit fit_memory(const Ensemble& e, const Layer& layer, double long_lag) {
  const int longest = e.steps(long_lag);
  if (longest < 4 || rise(value_at(e, layer, 1), value_at(e, layer, longest)) < 3) return {};
  const MemoryProblem problem(e, layer, long_lag);
  return problem.solve(half_values(problem.msd(), nullptr));
}

Estimate with_memory(const Ensemble& e, const Layer& layer, const Lags& lags, const Resampling& resampling) {
  Estimate out;
  out.name = "memory";
  if (!(lags.memory.memory > 0)) {
    out.D = out.sigma = std::numeric_limits<double>::quiet_NaN();
    out.ci68 = {out.D, out.D};
    out.note = "no memory seen";
    return out;
  }
  const MemoryProblem problem(e, layer, lags.memory_range);
  out.n = used_cells(problem.msd().front());
  out.D = problem.solve(half_values(problem.msd(), nullptr)).D;
  std::vector<double> draws(static_cast<std::size_t>(resampling.draws()));
#pragma omp parallel for schedule(static)
  for (int b = 0; b < resampling.draws(); ++b)
    draws[static_cast<std::size_t>(b)] = problem.solve(half_values(problem.msd(), resampling[b])).D;
  set_errors(out, std::move(draws), {}, {});
  char note[120];
  std::snprintf(note, sizeof note, "memory %.3g ms for %.0f %% of D", lags.memory.memory * 1e3,
                100 * lags.memory.share);
  out.note = note;
  return out;
}

Lags choose_lags(const Ensemble& e, const Layer& layer, const Options& options) {
  Lags l;
  const double nominal = e.steps(e.shear_rate > 0 ? 2 / e.shear_rate : 10 * e.interval) * e.interval;
  l.memory_range = std::min(4 * nominal, e.window() / 8);
  l.memory = fit_memory(e, layer, l.memory_range);
  const int reference = e.steps(std::min(nominal, e.window() / 8));
  const double D = value_at(e, layer, reference).D / l.memory.factor(reference * e.interval);
  // 2 D t < (distance/2)^2: fewer than 5 % of the walkers that start at the edge of the layer meet the wall.
  const double to_wall = std::max(0.0, std::min(layer.low - e.walls[0], e.walls[1] - layer.high));
  const double longest = std::min(e.window() / 4, std::max(2 * nominal, to_wall * to_wall / (8 * D)));
  l.plateau = std::min(nominal, longest);
  l.reason = "2/shear rate";
  for (int k : lag_ladder(e.steps(longest) / 2, 4)) {
    if (rise(value_at(e, layer, k), value_at(e, layer, 2 * k)) > 1) continue;
    if (k * e.interval > l.plateau) {
      l.plateau = k * e.interval;
      l.reason = "first lag at which D(lag) no longer rises";
    }
    break;
  }
  if (options.lag) {
    l.plateau = *options.lag;
    l.reason = "given";
  }
  require(l.plateau > 0 && l.plateau <= e.window() / 2, [&] {
    return "lag of " + std::to_string(l.plateau) + " s does not fit a window of " +
           std::to_string(e.window()) + " s (at least two lags are needed) shorten the lag or run longer";
  });
  l.plateau = e.steps(l.plateau) * e.interval;
  l.low = std::min(std::max(options.lag.value_or(nominal), 3.5 * l.memory.memory), longest / 2);
  l.low = e.steps(l.low) * e.interval;
  l.high = e.steps(std::max(2 * l.low, std::min(longest, 5 * l.low))) * e.interval;
  return l;
}

std::vector<double> brownian_msd_covariance(const std::vector<Segment>& segments,
                                            const std::vector<int>& steps) {
  const std::size_t L = steps.size();
  std::vector<double> c(L * L), pairs(L, 0);
  for (std::size_t a = 0; a < L; ++a)
    for (const Segment& s : segments) pairs[a] += std::max(0, static_cast<int>(s.end - s.begin) - steps[a]);
  for (std::size_t a = 0; a < L; ++a)
    for (std::size_t b = a; b < L; ++b) {
      double sum = 0;
      for (const Segment& s : segments) {
        const int K = static_cast<int>(s.end - s.begin), m = steps[a], n = steps[b];
        for (int shift = -n + 1; shift < m; ++shift) {  // second displacement starts `shift` after the first
          const double overlap = std::min(m, shift + n) - std::max(0, shift);
          const int first = std::max(0, -shift),
                    last = std::min(K - m, K - n - shift);  // starts of the first
          if (last > first) sum += overlap * overlap * (last - first);
        }
      }
      c[a * L + b] = c[b * L + a] = 2 * sum / (pairs[a] * pairs[b]);
    }
  return c;
}

namespace {

using Matrix = Eigen::MatrixXd;

/// Covariance between lags, up to a factor. The variances are Brownian: estimated ones are correlated with
/// the MSD itself and would bias the line (lags that came out high get less weight). The correlations are
/// those between cells, shrunk towards the Brownian ones.
Matrix shrunk_covariance(const std::vector<std::vector<double>>& influence,
                         const std::vector<double>& brownian) {
  const auto L = static_cast<Eigen::Index>(influence.size());
  const std::size_t cells = influence.front().size();
  const Eigen::Map<const Matrix> target(brownian.data(), L, L);
  Matrix s(L, L);
  for (Eigen::Index a = 0; a < L; ++a)
    for (Eigen::Index b = 0; b < L; ++b) {
      double sum = 0;
      for (std::size_t n = 0; n < cells; ++n)
        sum += influence[static_cast<std::size_t>(a)][n] * influence[static_cast<std::size_t>(b)][n];
      s(a, b) = sum;
    }
  const auto correlation = [](const Matrix& m, Eigen::Index a, Eigen::Index b) {
    return m(a, b) / std::sqrt(m(a, a) * m(b, b));
  };
  double noise = 0, misfit = 0;
  for (Eigen::Index a = 0; a < L; ++a)
    for (Eigen::Index b = 0; b < L; ++b) {
      if (a == b) continue;
      const double r = correlation(s, a, b), t = correlation(target, a, b);
      noise += (1 - r * r) * (1 - r * r) / static_cast<double>(cells - 1);
      misfit += (r - t) * (r - t);
    }
  const double shrink = misfit > 0 ? std::clamp(noise / misfit, 0.0, 1.0) : 1;
  Matrix c = target;
  for (Eigen::Index a = 0; a < L; ++a)
    for (Eigen::Index b = 0; b < L; ++b)
      if (a != b)
        c(a, b) = ((1 - shrink) * correlation(s, a, b) + shrink * correlation(target, a, b)) *
                  std::sqrt(target(a, a) * target(b, b));
  return c;
}

/// A value that is a fixed weighted sum of ratios: errors by the same bootstrap.
Estimate estimate_sum(const std::string& name, const Ensemble& e, const Resampling& resampling,
                      const std::vector<Ratio>& ratio, const std::vector<double>& weight) {
  Estimate out;
  out.name = name;
  out.n = used_cells(ratio.front());
  if (out.n < 2) {
    out.D = out.sigma = std::numeric_limits<double>::quiet_NaN();
    out.ci68 = {out.D, out.D};
    out.note = "fewer than two cells in the layer";
    return out;
  }
  const auto total = [&](auto&& value) {
    double s = 0;
    for (std::size_t k = 0; k < ratio.size(); ++k) s += weight[k] * value(ratio[k]);
    return s;
  };
  out.D = total([](const Ratio& r) { return r.value(); });
  std::vector<double> draws(static_cast<std::size_t>(resampling.draws()));
#pragma omp parallel for schedule(static) if (draws.size() * ratio.size() * e.paths.size() > worth_threads)
  for (int b = 0; b < resampling.draws(); ++b)
    draws[static_cast<std::size_t>(b)] = total([&](const Ratio& r) { return r.value(resampling[b]); });
  std::vector<double> per_run, per_run_sigma;
  if (e.runs.size() > 1)
    for (const Run& run : e.runs) {
      const auto part = [&](const Ratio& r) {
        const auto a = static_cast<std::ptrdiff_t>(run.first), b = static_cast<std::ptrdiff_t>(run.last);
        return Ratio{{r.numerator.begin() + a, r.numerator.begin() + b},
                     {r.denominator.begin() + a, r.denominator.begin() + b}};
      };
      per_run.push_back(total([&](const Ratio& r) { return part(r).value(); }));
      std::vector<double> psi(run.last - run.first, 0);
      for (std::size_t k = 0; k < ratio.size(); ++k) {
        const std::vector<double> p = part(ratio[k]).influence();
        for (std::size_t n = 0; n < psi.size(); ++n) psi[n] += weight[k] * p[n];
      }
      double s = 0;
      for (double p : psi) s += p * p;
      per_run_sigma.push_back(std::sqrt(s));
    }
  set_errors(out, std::move(draws), per_run, per_run_sigma);
  return out;
}

}  // namespace

Estimate gls(const Ensemble& e, const Layer& layer, const Lags& lags, const Resampling& resampling) {
  constexpr int points = 9;
  std::vector<int> steps;
  for (int k = 0; k < points; ++k) {
    const int s = e.steps(lags.low + (lags.high - lags.low) * k / (points - 1));
    if (steps.empty() || s > steps.back()) steps.push_back(s);
  }
  std::vector<Ratio> msd;
  std::vector<std::vector<double>> influence;
  for (const LagSums& s : lag_sums(e, layer, steps)) {
    msd.push_back(s.msd());
    influence.push_back(msd.back().influence());
  }
  const auto L = static_cast<Eigen::Index>(steps.size());
  std::vector<double> weight(steps.size(), 0);
  if (used_cells(msd.back()) >= 2 && L >= 2) {
    std::vector<Segment> segments;
    for (const Run& run : e.runs) segments.insert(segments.end(), run.segments.begin(), run.segments.end());
    const Matrix c = shrunk_covariance(influence, brownian_msd_covariance(segments, steps));
    Matrix x(L, 2);
    for (Eigen::Index k = 0; k < L; ++k) x.row(k) << 1, steps[static_cast<std::size_t>(k)] * e.interval;
    const Matrix ci_x = c.ldlt().solve(x);
    const Matrix rows = (x.transpose() * ci_x).ldlt().solve(ci_x.transpose());  // intercept; slope
    for (Eigen::Index k = 0; k < L; ++k) weight[static_cast<std::size_t>(k)] = rows(1, k) / 2;
  }
  Estimate out = estimate_sum("gls", e, resampling, msd, weight);
  out.lag = lags.low;
  if (L < 2) {
    out.D = out.sigma = std::numeric_limits<double>::quiet_NaN();
    out.note = "too few lags for a line";
  }
  return out;
}

Estimate green_kubo(const Ensemble& e, const Layer& layer, const Lags& lags, const Resampling& resampling) {
  const auto low = static_cast<std::size_t>(e.steps(lags.low)), high = 2 * low;
  const std::vector<double> zero(e.paths.size(), 0);
  std::vector<Ratio> c(high + 1, Ratio{zero, zero});  // autocorrelation of one-sample displacements
#pragma omp parallel for schedule(static) if (high * e.paths.size() * e.runs.front().time.size() > \
                                              worth_threads)
  for (std::size_t p = 0; p < e.paths.size(); ++p) {
    const auto& y = e.paths[p].y;
    for (const Segment& s : e.run_of(e.paths[p]).segments)
      for (std::size_t i = s.begin; i + 1 < s.end; ++i) {
        if (!layer.contains(y[i])) continue;
        const double d = y[i + 1] - y[i];
        const std::size_t most = std::min(high, s.end - 2 - i);
        for (std::size_t k = 0; k <= most; ++k) {
          c[k].numerator[p] += d * (y[i + k + 1] - y[i + k]);
          c[k].denominator[p] += 1;
        }
      }
  }
  std::vector<double> weight(high + 1);
  for (std::size_t k = 0; k <= high; ++k) {
    const double reach =
        k <= low ? 1 : static_cast<double>(high + 1 - k) / static_cast<double>(high - low + 1);
    weight[k] = (k == 0 ? 0.5 : reach) / e.interval;
  }
  Estimate out = estimate_sum("green_kubo", e, resampling, c, weight);
  out.lag = lags.low;
  return out;
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

Estimate local(const Estimate& plateau, const LocalFit& fit, const Layer& layer) {
  const auto factor_of = [&](const LocalLaw& law) {
    return law.mean_D(layer.low, layer.high) * 2 * fit.lag /
           Propagator(law, fit.cells, fit.lag).msd(layer.low, layer.high);
  };
  Estimate out = plateau;
  out.name = "local";
  const double factor = factor_of(fit.law);
  // The correction grows with D itself, so the error grows more than D does.
  LocalLaw faster = fit.law;
  faster.D_scale *= 1.05;
  const double stretch = factor * (1 + std::log(factor_of(faster) / factor) / std::log(1.05));
  out.D *= factor;
  out.sigma *= stretch;
  out.sigma_between_runs *= stretch;
  for (double& c : out.ci68) c = out.D + stretch * (c - plateau.D);
  char note[80];
  std::snprintf(note, sizeof note, "plateau times %.4f for walls and D(y) within the lag", factor);
  out.note = note;
  return out;
}

std::vector<Estimate> estimators(const Ensemble& e, const Layer& core, const Layer& paper, const Lags& lags,
                                 const Resampling& resampling, const LocalFit& fit) {
  const Layer all{e.walls[0] - e.height, e.walls[1] + e.height};
  std::vector<Estimate> out;
  out.push_back(estimate_ratio("paper", e, resampling, single_origin_slope(e, paper), 0.5));
  out.push_back(estimate_ratio("paper_all", e, resampling, single_origin_slope(e, all), 0.5));
  const LagSums sums = lag_sums(e, core, e.steps(lags.plateau));
  out.push_back(estimate_ratio("plateau", e, resampling, sums.msd(), 0.5 / sums.lag));
  out.back().lag = sums.lag;
  out.push_back(gls(e, core, lags, resampling));
  out.push_back(green_kubo(e, core, lags, resampling));
  out.push_back(with_memory(e, core, lags, resampling));
  out.push_back(confined(e, core, lags.plateau, resampling));
  out.push_back(local(out[2], fit, core));
  out.push_back(without_jumps(e, core, lags.plateau, resampling));
  return out;
}

Recommended recommend(const std::vector<Estimate>& all, const Lags& lags) {
  const auto find = [&](const std::string& name) -> const Estimate& {
    return *std::find_if(all.begin(), all.end(), [&](const Estimate& e) { return e.name == name; });
  };
  const Estimate &plateau = find("plateau"), &memory = find("memory"), &walls = find("local");
  char why[200];
  const double missing = 1 / lags.memory.factor(plateau.lag) - 1;
  if (missing * plateau.D > plateau.sigma && std::isfinite(memory.D)) {
    std::snprintf(why, sizeof why,
                  "memory of %.3g ms lowers D at the plateau lag by %.0f %%, more than its error",
                  lags.memory.memory * 1e3, 100 * missing / (1 + missing));
    return {memory, why};
  }
  if (std::abs(walls.D - plateau.D) > 0.1 * plateau.sigma) {
    std::snprintf(why, sizeof why, "walls and the variation of D(y) change D at the plateau lag by %.1f %%",
                  100 * std::abs(walls.D / plateau.D - 1));
    return {walls, why};
  }
  return {plateau, "smallest error; neither memory nor walls nor D(y) bias it noticeably"};
}

}  // namespace hemowalk::calibration
