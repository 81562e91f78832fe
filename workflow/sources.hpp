#pragma once
/// \file Trajectories that are not resolved: generated with a known answer, imported from publications, or
/// read.

#include <nlohmann/json.hpp>
#include <string>

#include "workflow/campaign.hpp"

namespace hemowalk::workflow {

/// Makes FOLDER/trajectories.h5 and FOLDER/source.yaml and says so in status.json.
/// \throws Error of what went wrong, after status.json says it too.
void make_trajectories(const TrajectorySource& source, const std::string& folder);

/// One line for the report.
std::string describe(const TrajectorySource& source);

/// D(y) that went into synthetic trajectories, for charts; null for others.
nlohmann::ordered_json truth_json(const TrajectorySource& source);

}  // namespace hemowalk::workflow
