#pragma once
/// \file Bench: where the time of a step goes, beside what the machine could do at most.

#include <cstddef>
#include <functional>
#include <string>

#include "core/data/scene.hpp"
#include "resolved/simulation.hpp"

namespace hemowalk::resolved {

struct BenchOptions {
  int steps = 50;    ///< timed coupling steps
  int warm_up = 10;  ///< before them
  mpi::Ranks ranks;  ///< who takes part; all get the report
  Place device =
      Place::device;  ///< where what the scene puts on a device runs (Place::host: emulated, for tests)
  std::function<void(double fraction, const std::string& what)> progress;
};

struct BenchReport {
  std::size_t nodes = 0, markers = 0;
  int rbc = 0, platelets = 0, ranks = 1, threads = 0;  ///< threads: per rank
  std::string packing;                                 ///< how the cells were placed
  struct StepTime {
    double median = 0, mean = 0, min = 0, mad = 0;
  } step;  ///< s per fluid step; mean: with the searches for neighbours; mad: median absolute deviation
  /// Medians, s per fluid step; steps: how many were timed. With the whole step on a device: means of steps
  /// whose kernels are launched one by one, NaN on several ranks.
  Timings parts;
  Timings least;  ///< the shortest time the ceilings allow each part on the host, s; 0 = not estimated
  double bandwidth = 0, fma = 0;  ///< ceilings, bytes/s and flop/s
  double bytes_per_node = 0;      ///< that one fluid step must move
  double memory = 0;              ///< resident, bytes
  double iterations_mean = 0;     ///< of the solid
  double momentum_residual = 0;   ///< largest component, relative, over the timed steps
  double simulated_per_step = 0;  ///< s of blood per fluid step
  double mlups() const { return 1e-6 * static_cast<double>(nodes) / parts.fluid; }
};

/// Packs \p scene, runs it and times each part. Boxes of several 50 um are filled with repetitions of one
/// packed box: no pair of neighbours is new, and the time does not depend on it. Each part runs where the
/// scene's place says. \throws InputError, PhysicsError.
BenchReport bench(const data::Scene& scene, const BenchOptions& options);

}  // namespace hemowalk::resolved
