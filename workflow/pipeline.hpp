#pragma once
/// \file A campaign end to end: runs, D and law per sweep point, device-scale walks, results.json,
/// report.html.

#include <string>

#include "workflow/campaign.hpp"

namespace hemowalk::workflow {

struct PipelineOptions {
  bool strict = false;
  std::string command;  ///< as typed, for "how to reproduce"
};

struct PipelineSummary {
  int runs = 0, done = 0, cached = 0, failed = 0;
  bool gate_passed = true;
  std::string results_file, report_file;
  std::vector<std::string> headlines;  ///< "D of platelets, ..." per point, for the terminal
  std::vector<std::string> warnings;
  double wall = 0;  ///< s
};

/// Does what is not done yet. \throws Interrupted after a stop signal; Error of whatever went wrong
/// otherwise. Failed runs are counted, not thrown.
PipelineSummary run_pipeline(const Campaign& campaign, const PipelineOptions& options);

}  // namespace hemowalk::workflow
