#pragma once
/// \file Mean-squared displacements along y: per-cell moment sums, the estimators of docs/reference.md built
/// on them, and the curves for charts.

#include <vector>

#include "calibration/resampling.hpp"
#include "calibration/tracks.hpp"

namespace hemowalk::calibration {

/// Sums over all pairs (t, t + lag) of a cell that start in a layer, inside one regular segment.
struct LagSums {
  int steps = 0;
  double lag = 0;                                    ///< s
  std::vector<double> count, first, second, fourth;  ///< [cell]; powers of the displacement, m^k

  Ratio msd() const { return {second, count}; }
};

/// All origins after t0, overlapping. Cost: cells x samples.
LagSums lag_sums(const Ensemble& ensemble, const Layer& layer, int steps);
std::vector<LagSums> lag_sums(const Ensemble& ensemble, const Layer& layer, const std::vector<int>& steps);

/// Excess kurtosis of the pooled displacements about zero.
double excess_kurtosis(const LagSums& sums);

/// The paper's estimator: ensemble MSD from the single origin t0, straight line with intercept over 0.7 s (to
/// 1000 ms for t0 = 300 ms), slope/2. The slope is linear in the squared displacements, so it is a per-cell
/// sum.
Ratio single_origin_slope(const Ensemble& ensemble, const Layer& layer);

/// MSD curves with delta-method errors. The single-origin line is the paper's fit.
MsdCurve single_origin_curve(const Ensemble& ensemble, const Layer& layer, const std::string& name);
MsdCurve time_averaged_curve(const Ensemble& ensemble, const Layer& layer, const std::string& name,
                             const std::array<double, 2>& fit_range);

/// Lags in steps, denser at the short end, up to \p longest steps.
std::vector<int> lag_ladder(int longest, int per_octave = 4);

/// Kramers-Moyal moments per bin of the starting height at one lag.
struct BinnedMoments {
  double lag = 0;
  std::vector<double> edges;                              ///< [bins + 1] m
  std::vector<std::vector<double>> count, first, second;  ///< [bin][cell]
  std::size_t bins() const { return count.size(); }
};
BinnedMoments binned_moments(const Ensemble& ensemble, int steps, int bins);

/// D(y) = (<d^2> - <d>^2)/(2 lag) and v = <d>/lag - D' with bootstrap errors; NaN where fewer than
/// \p least_cells cells contribute. The first moment is the Ito drift v + D'.
Calibration::Profile kramers_moyal(const BinnedMoments& moments, const Resampling& resampling,
                                   int least_cells = 3);

}  // namespace hemowalk::calibration
