#pragma once
/// \file Bootstrap over cells. Every estimator here is a function of per-cell sums, so one draw costs a
/// weighted sum and never touches a trajectory again.

#include <cstdint>
#include <vector>

#include "calibration/calibration.hpp"
#include "calibration/tracks.hpp"

namespace hemowalk::calibration {

/// Loops with less work (multiply-adds, roughly) run on one thread: waking the others costs more.
inline constexpr std::size_t worth_threads = 2'000'000;

/// Weights [draw][cell]: how often each cell was drawn, stratified by run (each run keeps its number of
/// cells). Counter-based: a draw depends on (seed, draw) only, not on threads.
class Resampling {
 public:
  Resampling(const Ensemble& ensemble, int draws, std::uint64_t seed);
  int draws() const { return draws_; }
  std::size_t cells() const { return cells_; }
  const std::uint16_t* operator[](int draw) const {
    return &weight_[static_cast<std::size_t>(draw) * cells_];
  }

 private:
  int draws_;
  std::size_t cells_;
  std::vector<std::uint16_t> weight_;
};

/// A value that is (sum of numerators)/(sum of denominators) over cells, e.g. an MSD or a D.
struct Ratio {
  std::vector<double> numerator, denominator;  ///< [cell]

  double value() const;
  double value(const std::uint16_t* weight) const;
  /// Influence of each cell on the value: their squares sum to the variance (delta method).
  std::vector<double> influence() const;
  /// Standard error of the value over cells by the delta method.
  double sigma() const;
};

/// Standard error and 68 % interval from bootstrap draws. With several runs the spread of the runs' own
/// values beyond what their cells explain (DerSimonian-Laird) widens both: platelets of one box share its
/// flow. \p per_run, \p per_run_sigma: the value and its cell-level error in each run (empty for a single
/// run).
void set_errors(Estimate& estimate, std::vector<double> draws, const std::vector<double>& per_run,
                const std::vector<double>& per_run_sigma);

/// Estimate of scale * ratio with bootstrap errors over cells and runs.
Estimate estimate_ratio(const std::string& name, const Ensemble& ensemble, const Resampling& resampling,
                        const Ratio& ratio, double scale);

/// Cells with a non-zero denominator.
int used_cells(const Ratio& ratio);

}  // namespace hemowalk::calibration
