#pragma once
/// \file Estimators of D beyond one lag: choice of lags, generalised least squares, Green-Kubo, confinement,
/// jumps.

#include <string>
#include <vector>

#include "calibration/local_law.hpp"
#include "calibration/msd.hpp"
#include "calibration/resampling.hpp"
#include "calibration/tracks.hpp"

namespace hemowalk::calibration {

/// Two-part displacement law MSD = 2 D [(1 - share) t + share (t - T (1 - exp(-t/T)))]: a share of D whose
/// velocity remembers for T, the rest without memory at the sampling interval.
struct MemoryFit {
  double memory = 0;  ///< T, s; 0 = none seen
  double share = 0;   ///< of D
  double D = 0;       ///< m2/s, at long times
  /// The best T is the longest that these lags can tell (a quarter of the longest lag): T and D are lower
  /// bounds.
  bool at_limit = false;
  /// MSD(lag)/(2 D lag): below 1 where the lag is not long against the memory.
  double factor(double lag) const;
};
/// D(\p to steps) - D(\p from steps) in units of its own standard error, paired over cells.
double rise(const Ensemble& ensemble, const Layer& layer, int from, int to);

/// Weighted least squares on the time-averaged MSD; memory is only reported when D at the shortest lag lies
/// three standard errors below D at \p long_lag (paired over cells).
MemoryFit fit_memory(const Ensemble& ensemble, const Layer& layer, double long_lag);

/// The lags at which D is read.
struct Lags {
  double plateau = 0;        ///< s, lag of the one-lag estimators
  double low = 0, high = 0;  ///< s, range of the straight line
  MemoryFit memory;
  double memory_range = 0;  ///< s, longest lag of the memory fit
  std::string reason;
};
/// plateau: the user's lag, else 2/shear rate (method 9), or longer where D(lag) still rises significantly
/// (paired over cells, one standard error, lag against twice the lag). Line: from max(plateau of 2/shear
/// rate, 3.5 memory times) to five plateau lags, short enough that platelets from the layer do not feel the
/// walls.
Lags choose_lags(const Ensemble& ensemble, const Layer& layer, const Options& options);

/// Straight line with intercept through the time-averaged MSD at nine lags, weighted by its full covariance:
/// variances of Brownian motion, correlations between cells shrunk (Schaefer and Strimmer 2005) towards those
/// of Brownian motion with overlapping displacements. The intercept takes up what happens below the shortest
/// lag.
Estimate gls(const Ensemble& ensemble, const Layer& layer, const Lags& lags, const Resampling& resampling);

/// Covariance matrix (row-major, in units of (2 D interval)^2) of the time-averaged MSDs of one Brownian
/// walker from overlapping displacements at the given lags: 2 sum of squared overlaps / (pairs x pairs).
std::vector<double> brownian_msd_covariance(const std::vector<Segment>& segments,
                                            const std::vector<int>& steps);

/// Integral of the velocity autocorrelation, mean over upper limits in [low, 2 low]. A cross-check: in
/// discrete time it equals the local slope of the MSD.
Estimate green_kubo(const Ensemble& ensemble, const Layer& layer, const Lags& lags,
                    const Resampling& resampling);

/// Long-time D of the two-part law, its memory fitted anew in every draw. NaN where no memory is seen.
Estimate with_memory(const Ensemble& ensemble, const Layer& layer, const Lags& lags,
                     const Resampling& resampling);

/// MSD after \p lag of reflected diffusion in a slab, averaged over given starts: exact cosine series.
class SlabMsd {
 public:
  /// \p starts: heights above the lower face, m, with weights that sum to 1.
  SlabMsd(double width, const std::vector<double>& starts, const std::vector<double>& weights);
  double operator()(double D, double lag) const;
  /// The D that gives this MSD; NaN at or above the plateau of the confined MSD.
  double solve(double msd, double lag) const;

 private:
  double width_, at_rest_ = 0;
  std::vector<double> amplitude_;
};
/// One-lag estimator corrected for the walls: the slab is the range of heights that cells visit.
Estimate confined(const Ensemble& ensemble, const Layer& layer, double lag, const Resampling& resampling);

/// Cross-stream displacement per sample beyond which no red cell can carry a platelet: five red-cell radii
/// per unit shear, 5 gamma a interval with a = 4 um; five robust standard deviations where there is no shear,
/// m.
double jump_threshold(const Ensemble& ensemble);
/// One-lag estimator after removing (not shortening) all one-sample displacements beyond the jump threshold.
Estimate without_jumps(const Ensemble& ensemble, const Layer& layer, double lag,
                       const Resampling& resampling);

/// `plateau` at the fit's lag, corrected by the fitted local law for what happens within the lag: walls and
/// the variation of D(y). The factor is (mean D over the layer)/(MSD of the law's own propagator/(2 lag));
/// its error is in the draws. Needs a fit with draws.
Estimate local(const Ensemble& ensemble, const Layer& layer, const Resampling& resampling,
               const LocalFit& fit);

/// All estimators of docs/reference.md (paper, paper_all, plateau, gls, green_kubo), then memory, confined,
/// local and without_jumps.
std::vector<Estimate> estimators(const Ensemble& ensemble, const Layer& core, const Layer& paper,
                                 const Lags& lags, const Resampling& resampling, const LocalFit& fit);

/// The estimate that goes into the law, and why: `plateau`, unless memory biases it by more than its error
/// (`memory`; where the memory is longer than the lags can tell `gls`, or `green_kubo` if the MSD is no
/// straight line there, more than three standard errors apart) or walls and D(y) by more than a tenth of it
/// (`local`).
struct Recommended {
  Estimate estimate;
  std::string reason;
};
Recommended recommend(const std::vector<Estimate>& all, const Lags& lags);

}  // namespace hemowalk::calibration
