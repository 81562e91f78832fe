#pragma once
/// \file The face of the resolved solver for the rest of the program: a scene in, a run folder out.

#include <functional>
#include <string>
#include <vector>

#include "core/data/scene.hpp"
#include "core/mpi.hpp"

namespace hemowalk::resolved {

struct RunOptions {
  std::string out;      ///< run folder: trajectories.h5, cells.xdmf, checkpoint/
  bool resume = false;  ///< continue from out/checkpoint if there is one
  std::function<void(double, const std::string&)> progress;  ///< fraction done, one line of state
  /// Polled; true on any rank -> checkpoint, then Interrupted on all.
  std::function<bool()> stop_requested;
  /// Who takes part: each calls resolve() with the same scene. Only the root writes files and reports
  /// progress.
  mpi::Ranks ranks;
};

struct RunSummary {
  std::int64_t steps = 0;
  double wall = 0;             ///< s
  int rbc = 0, platelets = 0;  ///< placed
  double hematocrit_true = 0;
};

/// Simulates \p scene. \throws InputError, PhysicsError (naming cell and step), Interrupted, IoError; an
/// error on one rank is thrown, as an Error of the same code and text, on all. The summary's counts are the
/// root's.
RunSummary resolve(const data::Scene& scene, const RunOptions& options);

/// Cell numbers of a scene before it runs: n_RBC = floor(Ht V_box/V_RBC), n_PLT = floor(n_RBC * ratio).
struct Census {
  int rbc = 0, platelets = 0;
  double rbc_volume = 0, platelet_volume = 0;  ///< m3, of the meshes
};
Census census(const data::Scene& scene);

/// Physics pre-flight: every problem as text, empty when the scene can run.
std::vector<std::string> preflight(const data::Scene& scene);

}  // namespace hemowalk::resolved
