#pragma once
/// \file Tracks of one kind of cell from one or several runs, checked and laid out per cell for the
/// estimators.

#include <array>
#include <cstddef>
#include <vector>

#include "calibration/calibration.hpp"

namespace hemowalk::calibration {

/// Consecutive samples [begin, end) that share the nominal interval.
struct Segment {
  std::size_t begin = 0, end = 0;
};

/// One run inside an ensemble.
struct Run {
  std::vector<double> time;         ///< s
  std::vector<Segment> segments;    ///< samples at t >= t0, cut where the interval is irregular
  std::size_t origin = 0;           ///< first sample with t >= t0
  std::size_t first = 0, last = 0;  ///< paths of this run: [first, last)
};

/// The samples of one cell, contiguous in time, m.
struct Path {
  std::vector<double> x, y, z;
  std::size_t run = 0;
};

/// All cells of one kind in all runs. Cells stay whole: they are the unit that the bootstrap draws.
struct Ensemble {
  double interval = 0;            ///< s, nominal sampling interval (the median)
  double t0 = 0;                  ///< s
  double shear_rate = 0;          ///< 1/s, nominal
  double height = 0;              ///< m, box height along y (walls may lie inside the box)
  std::array<double, 2> walls{};  ///< m
  std::vector<Run> runs;
  std::vector<Path> paths;

  const Run& run_of(const Path& p) const { return runs[p.run]; }
  /// Longest usable window after t0, s.
  double window() const;
  /// Steps of the nominal interval closest to \p lag, at least 1.
  int steps(double lag) const;
};

/// Where a displacement must start to be used, m. Cells are never asked to stay inside: that would select the
/// slow ones (method 9).
struct Layer {
  double low = 0, high = 0;
  bool contains(double y) const { return y >= low && y <= high; }
};

/// Checks the runs and lays them out. \throws InputError for NaN, unsorted times, fewer than two cells,
/// wrapped positions, cells outside the walls, unequal sampling or gap between runs, or too short a window
/// after t0.
Ensemble gather(const std::vector<data::Trajectories>& runs, const Options& options);

/// The layer of the `plateau` estimator: the option, else the RBC-rich layer where every run has a hematocrit
/// profile, else min(20 % of the box height, 10 um) away from the box's floor and ceiling.
Layer core_layer(const std::vector<data::Trajectories>& runs, const Ensemble& ensemble,
                 const Options& options);

/// The layer of the paper's estimator: the RBC-rich layer, else min(10 % of the box height, 5 um) away.
Layer paper_layer(const std::vector<data::Trajectories>& runs, const Ensemble& ensemble);

/// The RBC-rich layer: where the time-averaged hematocrit (t >= t0) exceeds half of its core value (mean of
/// the middle third); edges by linear interpolation. {0, 0} when no run has a profile with red cells.
Layer rbc_rich_layer(const std::vector<data::Trajectories>& runs, double t0);

}  // namespace hemowalk::calibration
