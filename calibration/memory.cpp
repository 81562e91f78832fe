/// \file Velocity memory seen in the mean-squared displacement, and the long-time D behind it.

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calibration/diffusivity.hpp"
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

/// MSD/2 of unit D with memory T.
double memory_shape(double t, double T) { return t + T * std::expm1(-t / T); }

}  // namespace

double rise(const Ensemble& e, const Layer& layer, int from, int to) {
  const LagValue a = value_at(e, layer, from), b = value_at(e, layer, to);
  double s = 0;
  for (std::size_t n = 0; n < a.influence.size(); ++n)
    s += (b.influence[n] - a.influence[n]) * (b.influence[n] - a.influence[n]);
  return (b.D - a.D) / std::sqrt(s);
}

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
    MemoryFit best{0, 0, tm / tt, false};
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
        best = {times_[j], kept / (free + kept), free + kept, j + 1 == times_.size()};
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
  if (longest < 4 || rise(e, layer, 1, longest) < 3) return {};
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
  std::vector<double> per_run, per_run_sigma;
  if (e.runs.size() > 1)
    for (const Run& run : e.runs) {
      // One run alone: the weights of all other cells are zero.
      std::vector<std::uint16_t> weight(e.paths.size(), 0);
      std::fill(weight.begin() + static_cast<std::ptrdiff_t>(run.first),
                weight.begin() + static_cast<std::ptrdiff_t>(run.last), std::uint16_t{1});
      per_run.push_back(problem.solve(half_values(problem.msd(), weight.data())).D);
      std::vector<double> own;
      for (int b = 0; b < std::min(resampling.draws(), 100); ++b) {  // an error to 7 %
        std::copy(resampling[b] + run.first, resampling[b] + run.last,
                  weight.begin() + static_cast<std::ptrdiff_t>(run.first));
        own.push_back(problem.solve(half_values(problem.msd(), weight.data())).D);
      }
      std::erase_if(own, [](double d) { return !std::isfinite(d); });
      per_run_sigma.push_back(own.size() < 2 ? 0 : standard_deviation(own));
    }
  set_errors(out, std::move(draws), per_run, per_run_sigma);
  char note[120];
  std::snprintf(note, sizeof note, "memory %s%.3g ms for %.0f %% of D",
                lags.memory.at_limit ? "of at least " : "", lags.memory.memory * 1e3,
                100 * lags.memory.share);
  out.note = note;
  return out;
}

}  // namespace hemowalk::calibration
