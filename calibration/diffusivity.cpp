#include "calibration/diffusivity.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.hpp"
#include "core/statistics.hpp"

namespace hemowalk::calibration {
Lags choose_lags(const Ensemble& e, const Layer& layer, const Options& options) {
  Lags l;
  const double nominal = e.steps(e.shear_rate > 0 ? 2 / e.shear_rate : 10 * e.interval) * e.interval;
  l.memory_range = std::min(4 * nominal, e.window() / 8);
  l.memory = fit_memory(e, layer, l.memory_range);
  const int reference = e.steps(std::min(nominal, e.window() / 8));
  const LagSums sums = lag_sums(e, layer, reference);
  const double D = sums.msd().value() / (2 * sums.lag) / l.memory.factor(sums.lag);
  // 2 D t < (distance/2)^2: fewer than 5 % of the walkers that start at the edge of the layer meet the wall.
  const double to_wall = std::max(0.0, std::min(layer.low - e.walls[0], e.walls[1] - layer.high));
  const double longest = std::min(e.window() / 4, std::max(2 * nominal, to_wall * to_wall / (8 * D)));
  l.plateau = std::min(nominal, longest);
  l.reason = "2/shear rate";
  for (int k : lag_ladder(e.steps(longest) / 2, 4)) {
    if (rise(e, layer, k, 2 * k) > 1) continue;
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
  out.push_back(local(e, core, resampling, fit));
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
  const Estimate &line = find("gls"), &slope = find("green_kubo");
  if (missing * plateau.D > plateau.sigma && lags.memory.at_limit && std::isfinite(line.D)) {
    // Where the MSD still bends, the weighted line through its strongly correlated points has no meaning.
    const bool straight = std::abs(line.D - slope.D) <= 3 * std::hypot(line.sigma, slope.sigma);
    std::snprintf(why, sizeof why,
                  "memory of at least %.3g ms, longer than these lags can tell: %s %.3g ms on",
                  lags.memory.memory * 1e3,
                  straight ? "line from" : "the MSD still bends, its mean slope from", line.lag * 1e3);
    return {straight || !std::isfinite(slope.D) ? line : slope, why};
  }
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
