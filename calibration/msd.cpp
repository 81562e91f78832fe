#include "calibration/msd.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/statistics.hpp"

namespace hemowalk::calibration {

LagSums lag_sums(const Ensemble& e, const Layer& layer, int steps) {
  LagSums s;
  s.steps = steps;
  s.lag = steps * e.interval;
  const std::size_t n = e.paths.size();
  s.count.resize(n);
  s.first.resize(n);
  s.second.resize(n);
  s.fourth.resize(n);
  const auto k = static_cast<std::size_t>(steps);
#pragma omp parallel for schedule(static) if (n * e.runs.front().time.size() > worth_threads)
  for (std::size_t p = 0; p < n; ++p) {
    const double* y = e.paths[p].y.data();
    double count = 0, m1 = 0, m2 = 0, m4 = 0;
    for (const Segment& seg : e.run_of(e.paths[p]).segments)
      for (std::size_t i = seg.begin; i + k < seg.end; ++i) {
        const double inside = layer.contains(y[i]), d = y[i + k] - y[i], d2 = d * d;
        count += inside;
        m1 += inside * d;
        m2 += inside * d2;
        m4 += inside * d2 * d2;
      }
    s.count[p] = count;
    s.first[p] = m1;
    s.second[p] = m2;
    s.fourth[p] = m4;
  }
  return s;
}

std::vector<LagSums> lag_sums(const Ensemble& e, const Layer& layer, const std::vector<int>& steps) {
  std::vector<LagSums> all;
  all.reserve(steps.size());
  for (int k : steps) all.push_back(lag_sums(e, layer, k));
  return all;
}

double excess_kurtosis(const LagSums& s) {
  double n = 0, m2 = 0, m4 = 0;
  for (std::size_t p = 0; p < s.count.size(); ++p) {
    n += s.count[p];
    m2 += s.second[p];
    m4 += s.fourth[p];
  }
  return m4 * n / (m2 * m2) - 3;
}

namespace {
constexpr double paper_window = 0.7;  // s: from 300 to 1000 ms

/// End of the paper's fit window in one run: first sample beyond t(origin) + 0.7 s (one interval of grace,
/// since t0 rarely falls on a sample).
std::size_t window_end(const Run& run, double interval) {
  const double last = run.time[run.origin] + paper_window + 0.5 * interval;
  return static_cast<std::size_t>(std::upper_bound(run.time.begin(), run.time.end(), last) -
                                  run.time.begin());
}
}  // namespace

Ratio single_origin_slope(const Ensemble& e, const Layer& layer) {
  Ratio r;
  r.numerator.assign(e.paths.size(), 0);
  r.denominator.assign(e.paths.size(), 0);
  for (const Run& run : e.runs) {
    if (run.origin >= run.time.size()) continue;
    const std::size_t end = window_end(run, e.interval), n = end - run.origin;
    if (n < 3) continue;
    double mean_t = 0, spread = 0;
    for (std::size_t i = run.origin; i < end; ++i) mean_t += run.time[i] / static_cast<double>(n);
    for (std::size_t i = run.origin; i < end; ++i) spread += (run.time[i] - mean_t) * (run.time[i] - mean_t);
    for (std::size_t p = run.first; p < run.last; ++p) {
      const auto& y = e.paths[p].y;
      const double start = y[run.origin];
      if (!layer.contains(start)) continue;
      double slope = 0;
      for (std::size_t i = run.origin; i < end; ++i)
        slope += (run.time[i] - mean_t) / spread * (y[i] - start) * (y[i] - start);
      r.numerator[p] = slope;
      r.denominator[p] = 1;
    }
  }
  return r;
}

MsdCurve single_origin_curve(const Ensemble& e, const Layer& layer, const std::string& name) {
  MsdCurve c;
  c.layer = name;
  c.method = "single_origin";
  // Runs of one scene share their sampling; the longest run sets the grid.
  const Run& grid = *std::max_element(e.runs.begin(), e.runs.end(), [](const Run& a, const Run& b) {
    return a.time.size() - a.origin < b.time.size() - b.origin;
  });
  const std::size_t samples = grid.time.size() - grid.origin, thin = std::max<std::size_t>(1, samples / 200);
  for (std::size_t k = thin; k < samples; k += thin) {
    Ratio r;
    r.numerator.assign(e.paths.size(), 0);
    r.denominator.assign(e.paths.size(), 0);
    for (const Run& run : e.runs)
      for (std::size_t p = run.first; p < run.last && run.origin + k < run.time.size(); ++p) {
        const auto& y = e.paths[p].y;
        if (!layer.contains(y[run.origin])) continue;
        const double d = y[run.origin + k] - y[run.origin];
        r.numerator[p] = d * d;
        r.denominator[p] = 1;
      }
    if (used_cells(r) < 2) continue;
    c.lag.push_back(grid.time[grid.origin + k] - grid.time[grid.origin]);
    c.msd.push_back(r.value());
    c.sigma.push_back(r.sigma());
  }
  c.fit_range = {0, std::min(paper_window, c.lag.empty() ? 0 : c.lag.back())};
  const Ratio slope = single_origin_slope(e, layer);
  if (used_cells(slope) < 2) return c;
  c.fit_slope = slope.value();
  double mean_lag = 0, mean_msd = 0, n = 0;
  for (std::size_t k = 0; k < c.lag.size(); ++k)
    if (c.lag[k] <= c.fit_range[1] + 0.5 * e.interval) {
      mean_lag += c.lag[k];
      mean_msd += c.msd[k];
      ++n;
    }
  c.fit_intercept = (mean_msd - c.fit_slope * mean_lag) / n;
  return c;
}

MsdCurve time_averaged_curve(const Ensemble& e, const Layer& layer, const std::string& name,
                             const std::array<double, 2>& fit_range) {
  MsdCurve c;
  c.layer = name;
  c.method = "time_averaged";
  c.fit_range = fit_range;
  std::vector<double> x, y, s;
  for (const LagSums& sums :
       lag_sums(e, layer, lag_ladder(static_cast<int>(0.4 * e.window() / e.interval), 6))) {
    const Ratio msd = sums.msd();
    if (used_cells(msd) < 2) continue;
    c.lag.push_back(sums.lag);
    c.msd.push_back(msd.value());
    c.sigma.push_back(msd.sigma());
    if (sums.lag >= fit_range[0] * 0.999 && sums.lag <= fit_range[1] * 1.001 && c.sigma.back() > 0) {
      x.push_back(sums.lag);
      y.push_back(c.msd.back());
      s.push_back(c.sigma.back());
    }
  }
  if (x.size() >= 2) {
    const LinearFit fit = fit_line(x, y, s);
    c.fit_slope = fit.slope;
    c.fit_intercept = fit.intercept;
  }
  return c;
}

std::vector<int> lag_ladder(int longest, int per_octave) {
  std::vector<int> steps;
  for (int k = 0;; ++k) {
    const int s = static_cast<int>(std::lround(std::exp2(static_cast<double>(k) / per_octave)));
    if (s > longest) break;
    if (steps.empty() || s > steps.back()) steps.push_back(s);
  }
  return steps;
}

BinnedMoments binned_moments(const Ensemble& e, int steps, int bins) {
  BinnedMoments m;
  m.lag = steps * e.interval;
  const double h = (e.walls[1] - e.walls[0]) / bins;
  for (int b = 0; b <= bins; ++b) m.edges.push_back(e.walls[0] + b * h);
  const std::vector<double> zero(e.paths.size(), 0);
  m.count.assign(static_cast<std::size_t>(bins), zero);
  m.first = m.second = m.count;
  const auto k = static_cast<std::size_t>(steps);
  for (std::size_t p = 0; p < e.paths.size(); ++p) {
    const auto& y = e.paths[p].y;
    for (const Segment& seg : e.run_of(e.paths[p]).segments)
      for (std::size_t i = seg.begin; i + k < seg.end; ++i) {
        const int b = std::clamp(static_cast<int>((y[i] - e.walls[0]) / h), 0, bins - 1);
        const double d = y[i + k] - y[i];
        m.count[static_cast<std::size_t>(b)][p] += 1;
        m.first[static_cast<std::size_t>(b)][p] += d;
        m.second[static_cast<std::size_t>(b)][p] += d * d;
      }
  }
  return m;
}

namespace {
struct LocalMoments {
  std::vector<double> D, v;
};

/// Centred differences of D inside, one-sided at the ends; NaN neighbours make NaN.
double derivative(const std::vector<double>& D, double h, std::size_t b) {
  const std::size_t lo = b == 0 ? b : b - 1, hi = b + 1 == D.size() ? b : b + 1;
  return (D[hi] - D[lo]) / (static_cast<double>(hi - lo) * h);
}

template <class Sum>
LocalMoments local_moments(const BinnedMoments& m, const std::vector<char>& enough, Sum&& sum) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), h = m.edges[1] - m.edges[0];
  LocalMoments r;
  r.D.assign(m.bins(), nan);
  r.v = r.D;
  std::vector<double> drift(m.bins(), nan);
  for (std::size_t b = 0; b < m.bins(); ++b) {
    if (!enough[b]) continue;
    const double n = sum(m.count[b]), mean = sum(m.first[b]) / n;
    r.D[b] = (sum(m.second[b]) / n - mean * mean) / (2 * m.lag);
    drift[b] = mean / m.lag;
  }
  for (std::size_t b = 0; b < m.bins(); ++b) r.v[b] = drift[b] - derivative(r.D, h, b);
  return r;
}

/// Standard deviation over the finite entries; NaN when fewer than half are.
double spread(std::vector<double> draws) {
  const std::size_t all = draws.size();
  std::erase_if(draws, [](double d) { return !std::isfinite(d); });
  if (draws.size() < 2 || 2 * draws.size() < all) return std::numeric_limits<double>::quiet_NaN();
  return standard_deviation(draws);
}
}  // namespace

Calibration::Profile kramers_moyal(const BinnedMoments& m, const Resampling& resampling, int least_cells) {
  const std::size_t bins = m.bins(), cells = resampling.cells(),
                    draws = static_cast<std::size_t>(resampling.draws());
  std::vector<char> enough(bins);
  double total = 0;
  Calibration::Profile p;
  for (std::size_t b = 0; b < bins; ++b) {
    enough[b] =
        std::count_if(m.count[b].begin(), m.count[b].end(), [](double c) { return c > 0; }) >= least_cells;
    double n = 0;
    for (double c : m.count[b]) n += c;
    p.density.push_back(n);
    total += n;
    p.y.push_back((m.edges[b] + m.edges[b + 1]) / 2);
  }
  for (std::size_t b = 0; b < bins; ++b) p.density[b] /= total * (m.edges[b + 1] - m.edges[b]);
  const LocalMoments best = local_moments(m, enough, [](const std::vector<double>& x) {
    double s = 0;
    for (double v : x) s += v;
    return s;
  });
  p.D = best.D;
  p.v = best.v;
  std::vector<std::vector<double>> D(bins, std::vector<double>(draws)), v = D;
#pragma omp parallel for schedule(static) if (draws * bins * cells > worth_threads)
  for (int k = 0; k < resampling.draws(); ++k) {
    const std::uint16_t* w = resampling[k];
    const LocalMoments draw = local_moments(m, enough, [&](const std::vector<double>& x) {
      double s = 0;
      for (std::size_t n = 0; n < cells; ++n) s += w[n] * x[n];
      return s;
    });
    for (std::size_t b = 0; b < bins; ++b) {
      D[b][static_cast<std::size_t>(k)] = draw.D[b];
      v[b][static_cast<std::size_t>(k)] = draw.v[b];
    }
  }
  for (std::size_t b = 0; b < bins; ++b) {
    p.sigma.push_back(enough[b] ? spread(D[b]) : std::numeric_limits<double>::quiet_NaN());
    p.v_sigma.push_back(enough[b] ? spread(v[b]) : std::numeric_limits<double>::quiet_NaN());
  }
  return p;
}

}  // namespace hemowalk::calibration
