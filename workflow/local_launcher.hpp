#pragma once
/// \file The local launcher: runs in child processes of this program, a few at a time, one folder each.

#include <string>
#include <vector>

#include "workflow/run_directory.hpp"

namespace hemowalk::workflow {

/// One run to do: FOLDER/scene.yaml is there, the child writes FOLDER/status.json and FOLDER/log.txt.
struct Job {
  std::string folder, title;
  double cost = 1;  ///< expected share of the whole, any unit
};

enum class OnFailure { abort, retry, skip };

struct LaunchOptions {
  int slots = 1;    ///< runs at a time
  int ranks = 1;    ///< processes per run; more than one: through mpirun
  int threads = 0;  ///< per rank; 0 = the cores shared among slots and ranks
  OnFailure on_failure = OnFailure::abort;
  int attempts = 2;       ///< with retry: how often a run is started in this call
  double time_limit = 0;  ///< s of wall time per attempt; 0 = none
};

/// Runs \p jobs; returns their last status in the same order. With `abort` the first failure stops the rest
/// (they stay queued). A run that failed for a reason that would come back (bad input, blow-up: reruns are
/// bit-identical) is not retried. On a stop signal children write checkpoints and the rest stays queued.
/// \throws InputError when runs of several ranks are asked for and there is no mpirun.
std::vector<Status> run_jobs(const std::vector<Job>& jobs, const LaunchOptions& options);

}  // namespace hemowalk::workflow
