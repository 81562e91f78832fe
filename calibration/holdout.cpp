#include "calibration/holdout.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "core/statistics.hpp"
#include "core/text.hpp"

namespace hemowalk::calibration {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
using Fold = std::vector<char>;

Fold fold_of(const Ensemble& e, std::size_t parity) {
  Fold use(e.paths.size());
  for (const Run& r : e.runs)
    for (std::size_t p = r.first; p < r.last; ++p) use[p] = (p - r.first) % 2 == parity;
  return use;
}

/// Predictions of a fitted law over one lag, per starting cell of the grid.
class Forecast {
 public:
  /// \p P over the walls' distance, in equal bins.
  Forecast(const std::array<double, 2>& walls, Eigen::MatrixXd P)
      : low_(walls[0]),
        width_((walls[1] - walls[0]) / static_cast<double>(P.rows())),
        cells_(static_cast<int>(P.rows())),
        P_(std::move(P)) {
    cumulative_ = P_;
    for (int j = 1; j < cells_; ++j) cumulative_.col(j) += cumulative_.col(j - 1);
    for (int i = 0; i < cells_; ++i) {
      double m = 0, s = 0;
      for (int j = 0; j < cells_; ++j) {
        const double d = (j - i) * width_;
        m += P_(i, j) * d;
        s += P_(i, j) * d * d;
      }
      mean_.push_back(m);
      square_.push_back(s);
    }
  }
  double mean(double y) const { return mean_[cell(y)]; }
  double square(double y) const { return square_[cell(y)]; }
  double sigma(double y) const { return std::sqrt(square(y) - mean(y) * mean(y)); }
  /// P(end <= y1 | start y0), linear inside the cell of y1; the start is shifted with its place in its cell.
  double cdf(double y0, double y1) const {
    const auto i = static_cast<Eigen::Index>(cell(y0));
    const double inside0 = (y0 - low_) / width_ - static_cast<double>(i) - 0.5;
    const double u = std::clamp((y1 - low_) / width_ - (near_wall(y0) || near_wall(y1) ? 0 : inside0), 0.0,
                                static_cast<double>(cells_) - 1e-9);
    const auto j = static_cast<Eigen::Index>(u);
    const double before = j ? cumulative_(i, j - 1) : 0;
    return before + (u - static_cast<double>(j)) * P_(i, j);
  }
  const Eigen::MatrixXd& matrix() const { return P_; }
  std::size_t cell(double y) const {
    return static_cast<std::size_t>(std::clamp(static_cast<int>((y - low_) / width_), 0, cells_ - 1));
  }

 private:
  bool near_wall(double y) const { return y < low_ + width_ || y > low_ + (cells_ - 1) * width_; }
  double low_, width_;
  int cells_;
  Eigen::MatrixXd P_, cumulative_;
  std::vector<double> mean_, square_;
};

Forecast forecast(const LocalFit& fit, double lag) {
  return {fit.law.walls, Propagator(fit.law, fit.cells, lag).matrix()};
}

LocalFit fit_half(const Ensemble& e, double lag, const Fold& use) {
  return fit_local_law(e, lag, Resampling(e, 0, 0), 0, use);
}

/// p-value of "uniform" for probability integral transforms.
double uniform_p(const std::vector<double>& u, int bins) {
  if (u.size() < static_cast<std::size_t>(5 * bins)) return nan;
  std::vector<double> count(static_cast<std::size_t>(bins), 0);
  for (double v : u)
    count[static_cast<std::size_t>(std::clamp(static_cast<int>(v * bins), 0, bins - 1))] += 1;
  const double expected = static_cast<double>(u.size()) / bins;
  double chi = 0;
  for (double c : count) chi += (c - expected) * (c - expected) / expected;
  return chi_squared_tail(chi, bins - 1);
}

/// One cell's standardised disjoint steps at one lag; starts outside the layer break the chain.
struct Steps {
  std::vector<double> value;
  std::vector<char> follows;  ///< whether the previous entry is the step just before
};
Steps standardised_steps(const Ensemble& e, const Path& p, const Layer& core, const Forecast& f,
                         std::size_t k) {
  Steps s;
  for (const Segment& seg : e.run_of(p).segments) {
    bool chain = false;
    for (std::size_t i = seg.begin; i + k < seg.end; i += k) {
      const double y = p.y[i];
      if (!core.contains(y)) {
        chain = false;
        continue;
      }
      s.value.push_back((p.y[i + k] - y - f.mean(y)) / f.sigma(y));
      s.follows.push_back(chain);
      chain = true;
    }
  }
  return s;
}

double log_gaussian(double x, double sigma) {
  return -0.5 * (x / sigma) * (x / sigma) - std::log(sigma) - 0.9189385332046727;
}
double log_student(double x, double scale, double nu) {
  return std::lgamma((nu + 1) / 2) - std::lgamma(nu / 2) - 0.5 * std::log(nu * M_PI) - std::log(scale) -
         (nu + 1) / 2 * std::log1p(x * x / (nu * scale * scale));
}

/// The three laws of one standardised step, fitted to one half.
struct StepModels {
  double sigma = 1;           // gaussian and persistent
  double correlation = 0;     // persistent: of successive steps
  double nu = 50, scale = 1;  // heavy tail: Student's t

  explicit StepModels(const std::vector<Steps>& cells) {
    double n = 0, s = 0, cc = 0, aa = 0, bb = 0;
    std::vector<double> all;
    for (const Steps& c : cells)
      for (std::size_t k = 0; k < c.value.size(); ++k) {
        const double x = c.value[k];
        all.push_back(x);
        s += x * x;
        ++n;
        if (c.follows[k]) {
          cc += x * c.value[k - 1];
          aa += x * x;
          bb += c.value[k - 1] * c.value[k - 1];
        }
      }
    sigma = std::sqrt(s / n);
    if (aa > 0 && bb > 0) correlation = std::clamp(cc / std::sqrt(aa * bb), -0.95, 0.95);
    double best = -std::numeric_limits<double>::max();
    for (double candidate : {2.2, 2.6, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 12.0, 20.0, 50.0, 200.0})
      fit_scale(all, candidate, best);
  }
  double gaussian(double x) const { return log_gaussian(x, sigma); }
  double heavy(double x) const { return log_student(x, scale, nu); }
  double persistent(double x, double before, bool follows) const {
    if (!follows) return gaussian(x);
    return log_gaussian(x - correlation * before, sigma * std::sqrt(1 - correlation * correlation));
  }

 private:
  /// Scale by the EM fixed point of Student's t; keeps the best degrees of freedom.
  void fit_scale(const std::vector<double>& all, double candidate, double& best) {
    double s2 = 0.5 * sigma * sigma;
    for (int k = 0; k < 60; ++k) {
      double sum = 0;
      for (double x : all) sum += (candidate + 1) / (candidate + x * x / s2) * x * x;
      s2 = sum / static_cast<double>(all.size());
    }
    double total = 0;
    for (double x : all) total += log_student(x, std::sqrt(s2), candidate);
    if (total > best) {
      best = total;
      nu = candidate;
      scale = std::sqrt(s2);
    }
  }
};

Calibration::StepChoice compare(const Ensemble& e, const Layer& core, const HalfFits& fits, double lag) {
  Calibration::StepChoice c;
  const auto k = static_cast<std::size_t>(e.steps(lag));
  c.lag = static_cast<double>(k) * e.interval;
  std::vector<double> persistent, heavy, steps;  // per unseen cell: gain over the Gaussian, in nats
  for (std::size_t half = 0; half < 2; ++half) {
    const Fold seen = fold_of(e, half);
    const Forecast f = forecast(fits[half], c.lag);
    std::vector<Steps> train, test;
    for (std::size_t p = 0; p < e.paths.size(); ++p)
      (seen[p] ? train : test).push_back(standardised_steps(e, e.paths[p], core, f, k));
    const StepModels m(train);
    c.correlation += m.correlation / 2;
    c.tail_exponent += m.nu / 2;
    for (const Steps& s : test) {
      double a = 0, b = 0;
      for (std::size_t i = 0; i < s.value.size(); ++i) {
        const double g = m.gaussian(s.value[i]);
        a += m.persistent(s.value[i], i ? s.value[i - 1] : 0, s.follows[i]) - g;
        b += m.heavy(s.value[i]) - g;
      }
      persistent.push_back(a);
      heavy.push_back(b);
      steps.push_back(static_cast<double>(s.value.size()));
    }
  }
  const double n = mean(steps) * static_cast<double>(steps.size());
  const auto gain = [&](const std::vector<double>& x, double& value, double& sigma) {
    value = mean(x) * static_cast<double>(x.size()) / n;
    sigma = standard_error(x) * static_cast<double>(x.size()) / n;
  };
  gain(persistent, c.persistent_gain, c.persistent_sigma);
  gain(heavy, c.heavy_tail_gain, c.heavy_tail_sigma);
  c.best = "gaussian";
  const bool p = c.persistent_gain > 2 * c.persistent_sigma, h = c.heavy_tail_gain > 2 * c.heavy_tail_sigma;
  if (p && (!h || c.persistent_gain >= c.heavy_tail_gain)) c.best = "persistent";
  if (h && (!p || c.heavy_tail_gain > c.persistent_gain)) c.best = "heavy_tail";
  return c;
}

/// Share of steps beyond three standard deviations: what the tail law has to carry.
double tail_share(const Ensemble& e, const Layer& core, const LocalFit& fit, double lag) {
  const Forecast f = forecast(fit, lag);
  double n = 0, beyond = 0;
  for (const Path& p : e.paths)
    for (double x : standardised_steps(e, p, core, f, static_cast<std::size_t>(e.steps(lag))).value) {
      beyond += std::abs(x) > 3;
      ++n;
    }
  return beyond / n;
}

}  // namespace

HalfFits fit_halves(const Ensemble& e, double lag) {
  return {fit_half(e, lag, fold_of(e, 0)), fit_half(e, lag, fold_of(e, 1))};
}

Prediction propagated(const HalfFits& halves) {
  return [&halves](std::size_t half, const std::vector<double>& lags) {
    std::vector<Eigen::MatrixXd> P;
    for (const double lag : lags) P.push_back(Propagator(halves[half].law, halves[half].cells, lag).matrix());
    return P;
  };
}

namespace {

/// Mean-squared displacement and histogram at one lag, over the cells that each half has not seen.
void hold_out_lag(const Ensemble& e, const Layer& core, double lag, const std::array<Forecast, 2>& forecasts,
                  Calibration::Holdout& out) {
  const auto k = static_cast<std::size_t>(e.steps(lag));
  double observed = 0, predicted = 0, variance = 0;
  std::vector<double> transform;
  for (std::size_t half = 0; half < 2; ++half) {
    const Fold seen = fold_of(e, half);
    const Forecast& f = forecasts[half];
    for (std::size_t p = 0; p < e.paths.size(); ++p) {
      if (seen[p]) continue;
      const auto& y = e.paths[p].y;
      const Run& run = e.run_of(e.paths[p]);
      double a = 0, b = 0;
      for (std::size_t i = run.origin; i + k < y.size(); ++i) {
        const double dt = run.time[i + k] - run.time[i];
        if (std::abs(dt - lag) > 0.01 * lag)
          continue;  // lags this long span irregular intervals: use true times
        const double d = y[i + k] - y[i];
        if ((i - run.origin) % k == 0) transform.push_back(f.cdf(y[i], y[i + k]));
        if (!core.contains(y[i])) continue;
        a += d * d;
        b += f.square(y[i]);
      }
      observed += a;
      predicted += b;
      variance += (a - b) * (a - b);
    }
  }
  if (!(predicted > 0)) return;
  out.lag.push_back(lag);
  out.msd_ratio.push_back(observed / predicted);
  out.msd_sigma.push_back(std::sqrt(variance) / predicted);
  out.histogram_p.push_back(uniform_p(transform, 10));
}

}  // namespace

Calibration::Holdout hold_out(const Ensemble& e, const Layer& core, const Prediction& predict) {
  std::vector<double> lags;
  for (const double lag : {0.1, 0.2, 0.5, 1.0})
    if (lag <= e.window() * 0.9) lags.push_back(lag);
  const std::size_t short_lags = lags.size();
  for (const Run& run : e.runs) {  // and the whole window of each run
    const double whole = run.time.back() - run.time[run.origin];
    if (std::find(lags.begin(), lags.end(), whole) == lags.end()) lags.push_back(whole);
  }
  std::array<std::vector<Forecast>, 2> forecasts;
  for (std::size_t half = 0; half < 2; ++half)
    for (auto& P : predict(half, lags)) forecasts[half].emplace_back(e.walls, std::move(P));

  Calibration::Holdout out;
  for (std::size_t l = 0; l < short_lags; ++l)
    hold_out_lag(e, core, lags[l], {forecasts[0][l], forecasts[1][l]}, out);
  std::vector<double> ends;
  for (std::size_t half = 0; half < 2; ++half) {
    const Fold seen = fold_of(e, half);
    for (const Run& run : e.runs) {
      const double whole = run.time.back() - run.time[run.origin];
      const auto at = std::find(lags.begin(), lags.end(), whole) - lags.begin();
      const Forecast& f = forecasts[half][static_cast<std::size_t>(at)];
      for (std::size_t p = run.first; p < run.last; ++p)
        if (!seen[p]) ends.push_back(f.cdf(e.paths[p].y[run.origin], e.paths[p].y.back()));
    }
  }
  out.profile_lag = e.window();
  out.profile_p = uniform_p(ends, 6);
  return out;
}

Calibration::StepChoice compare_steps(const Ensemble& e, const Layer& core, const HalfFits& halves,
                                      double lag) {
  return compare(e, core, halves, lag);
}

StepSelection select_step_law(const Ensemble& e, const Layer& core, const HalfFits& fits, double memory,
                              double longest) {
  StepSelection s;
  for (double lag : {1e-3, 2e-3, 5e-3, 10e-3, 20e-3, 50e-3, 100e-3}) {
    if (lag < 0.99 * e.interval || lag > 1.01 * longest || lag > e.window() / 6) continue;
    s.choices.push_back(compare(e, core, fits, lag));
  }
  std::size_t first = s.choices.size();
  while (first > 0 && s.choices[first - 1].best == "gaussian") --first;
  if (first < s.choices.size()) {
    s.dt_min = s.choices[first].lag;
    s.reason = first == 0 ? "unseen cells prefer no other law at any lag"
                          : formatted("from %.3g ms on unseen cells prefer no other law (%s wins at %.3g ms)",
                                      s.dt_min * 1e3, s.choices[first - 1].best.c_str(),
                                      s.choices[first - 1].lag * 1e3);
    return s;
  }
  if (s.choices.empty()) {
    s.reason = "window too short to compare step laws";
    s.dt_min = fits[0].lag;
    return s;
  }
  const auto& last = s.choices.back();
  s.law.kind = last.best;
  s.dt_min = e.interval;
  const bool persistent = last.best == "persistent";
  s.reason = formatted("unseen cells prefer it to a Gaussian even at %.3g ms, by %.3g +- %.2g nats per step",
                       last.lag * 1e3, persistent ? last.persistent_gain : last.heavy_tail_gain,
                       persistent ? last.persistent_sigma : last.heavy_tail_sigma);
  if (persistent) {
    // Correlation of successive steps of length t of an Ornstein-Uhlenbeck walk fixes T where the fit saw
    // none.
    s.law.memory = memory > 0 ? memory : last.lag * std::max(0.01, last.correlation);
  } else {
    s.law.tail_exponent = last.tail_exponent;
    s.law.tail_fraction = tail_share(e, core, fits[0], last.lag);
    s.dt_min = last.lag;
  }
  return s;
}

Calibration::Residence residence(const Ensemble& e, const Layer& core, double zone) {
  Calibration::Residence r;
  r.zone = zone;
  double inside = 0, outside = 0;  // s
  for (const Path& p : e.paths) {
    const Run& run = e.run_of(p);
    bool near = false, first = true;
    for (std::size_t i = run.origin; i < p.y.size(); ++i) {
      const double height = std::min(p.y[i] - e.walls[0], e.walls[1] - p.y[i]);
      if (i > run.origin) (near ? inside : outside) += run.time[i] - run.time[i - 1];
      if (!near && height < zone) {
        near = true;
        ++r.visits;
        ++(i == run.origin ? r.near_at_t0 : r.arrivals);
        first = i == run.origin;
      } else if (near && core.contains(p.y[i])) {
        near = false;
        ++r.left;
        if (first) ++r.left_of_t0;
      }
    }
  }
  // Exponential stays: the maximum-likelihood mean is the time at risk per end, its error 1/sqrt(ends).
  const auto mean_time = [](double time, int ends, double& value, double& sigma) {
    value = ends > 0 ? time / ends : nan;
    sigma = ends > 0 ? value / std::sqrt(static_cast<double>(ends)) : nan;
  };
  mean_time(inside, r.left, r.mean_time, r.mean_time_sigma);
  mean_time(outside, r.arrivals, r.mean_time_out, r.mean_time_out_sigma);
  return r;
}

}  // namespace hemowalk::calibration
