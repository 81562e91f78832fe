#include "calibration/resampling.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/random.hpp"
#include "core/statistics.hpp"

namespace hemowalk::calibration {

Resampling::Resampling(const Ensemble& ensemble, int draws, std::uint64_t seed)
    : draws_(draws), cells_(ensemble.paths.size()), weight_(static_cast<std::size_t>(draws) * cells_, 0) {
#pragma omp parallel for schedule(static) if (weight_.size() > worth_threads)
  for (int b = 0; b < draws; ++b) {
    std::uint16_t* w = &weight_[static_cast<std::size_t>(b) * cells_];
    RandomSequence random(seed, Stream::bootstrap, static_cast<std::uint64_t>(b));
    for (const Run& run : ensemble.runs) {
      const std::size_t n = run.last - run.first;
      for (std::size_t k = 0; k < n; ++k) ++w[run.first + random.below(n)];
    }
  }
}

double Ratio::value() const {
  double a = 0, b = 0;
  for (std::size_t n = 0; n < numerator.size(); ++n) {
    a += numerator[n];
    b += denominator[n];
  }
  return a / b;
}

double Ratio::value(const std::uint16_t* weight) const {
  double a = 0, b = 0;
  for (std::size_t n = 0; n < numerator.size(); ++n) {
    a += weight[n] * numerator[n];
    b += weight[n] * denominator[n];
  }
  return a / b;
}

std::vector<double> Ratio::influence() const {
  const double v = value();
  double b = 0, used = 0;
  for (double d : denominator) {
    b += d;
    used += d > 0;
  }
  const double small_sample =
      used > 1 ? std::sqrt(used / (used - 1)) : std::numeric_limits<double>::quiet_NaN();
  std::vector<double> psi(numerator.size());
  for (std::size_t n = 0; n < psi.size(); ++n)
    psi[n] = small_sample * (numerator[n] - v * denominator[n]) / b;
  return psi;
}

double Ratio::sigma() const {
  double s = 0;
  for (double p : influence()) s += p * p;
  return std::sqrt(s);
}

int used_cells(const Ratio& ratio) {
  return static_cast<int>(
      std::count_if(ratio.denominator.begin(), ratio.denominator.end(), [](double d) { return d > 0; }));
}

namespace {
/// Variance of the runs' values beyond their own errors, by the method of moments; never negative.
double between_run_variance(const std::vector<double>& value, const std::vector<double>& sigma) {
  double w0 = 0, w1 = 0, w2 = 0, m = 0;
  std::size_t runs = 0;
  for (std::size_t r = 0; r < value.size(); ++r) {
    if (!std::isfinite(value[r]) || !(sigma[r] > 0)) continue;
    const double w = 1 / (sigma[r] * sigma[r]);
    w0 += w;
    w1 += w * value[r];
    w2 += w * w;
    ++runs;
  }
  if (runs < 2) return 0;
  m = w1 / w0;
  double q = 0;
  for (std::size_t r = 0; r < value.size(); ++r)
    if (std::isfinite(value[r]) && sigma[r] > 0) q += (value[r] - m) * (value[r] - m) / (sigma[r] * sigma[r]);
  return std::max(0.0, (q - static_cast<double>(runs - 1)) / (w0 - w2 / w0));
}
}  // namespace

void set_errors(Estimate& e, std::vector<double> draws, const std::vector<double>& per_run,
                const std::vector<double>& per_run_sigma) {
  std::erase_if(draws, [](double d) { return !std::isfinite(d); });
  if (draws.size() < 2) {
    e.sigma = std::numeric_limits<double>::quiet_NaN();
    e.ci68 = {e.sigma, e.sigma};
    return;
  }
  // A bootstrap over n cells is short by sqrt(n/(n-1)), and each cell pulls the value it is measured against
  // towards itself by 1/n (the jackknife's correction): 1 + 3/(2n) in all.
  const double within = standard_deviation(draws) * (e.n > 1 ? 1 + 1.5 / e.n : 1);
  const double runs = static_cast<double>(std::max<std::size_t>(1, per_run.size()));
  e.sigma_between_runs = std::sqrt(between_run_variance(per_run, per_run_sigma));
  e.sigma = std::sqrt(within * within + e.sigma_between_runs * e.sigma_between_runs / runs);
  const double widen = within > 0 ? e.sigma / standard_deviation(draws) : 1;
  e.ci68 = {e.D + widen * (quantile(draws, 0.1587) - e.D), e.D + widen * (quantile(draws, 0.8413) - e.D)};
  e.effective_samples = 2 * (e.D / e.sigma) * (e.D / e.sigma);
}

Estimate estimate_ratio(const std::string& name, const Ensemble& ensemble, const Resampling& resampling,
                        const Ratio& ratio, double scale) {
  Estimate e;
  e.name = name;
  e.n = used_cells(ratio);
  if (e.n < 2) {
    e.D = e.sigma = std::numeric_limits<double>::quiet_NaN();
    e.ci68 = {e.D, e.D};
    e.note = "fewer than two cells in the layer";
    return e;
  }
  e.D = scale * ratio.value();
  std::vector<double> draws(static_cast<std::size_t>(resampling.draws()));
#pragma omp parallel for schedule(static) if (draws.size() * resampling.cells() > worth_threads)
  for (int b = 0; b < resampling.draws(); ++b)
    draws[static_cast<std::size_t>(b)] = scale * ratio.value(resampling[b]);
  std::vector<double> per_run, per_run_sigma;
  if (ensemble.runs.size() > 1)
    for (const Run& run : ensemble.runs) {
      const auto a = static_cast<std::ptrdiff_t>(run.first), b = static_cast<std::ptrdiff_t>(run.last);
      const Ratio part{{ratio.numerator.begin() + a, ratio.numerator.begin() + b},
                       {ratio.denominator.begin() + a, ratio.denominator.begin() + b}};
      per_run.push_back(scale * part.value());
      per_run_sigma.push_back(scale * part.sigma());
    }
  set_errors(e, std::move(draws), per_run, per_run_sigma);
  return e;
}

}  // namespace hemowalk::calibration
