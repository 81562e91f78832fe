#pragma once
/// \file What calibrate does beside one calibration: what an error costs, the law over conditions, a report.

#include <optional>
#include <string>
#include <vector>

#include "calibration/calibration.hpp"
#include "workflow/results.hpp"

namespace hemowalk::workflow {

/// Relative errors asked for, from "5%" or "0.05"; without one: 20, 10, 5, 2 %. \throws InputError.
std::vector<double> errors_asked(const std::string& text);

/// What each error costs: as JSON, and as a table for the terminal.
Json plans_json(const std::vector<double>& errors, const calibration::PlanInput& input);
std::string plans_table(const std::vector<double>& errors, const calibration::PlanInput& input);

/// The transport laws of files and of campaign folders (transport_law.yaml and laws/*.yaml), each once.
/// \throws InputError where there is none.
std::vector<data::TransportLaw> read_laws(const std::vector<std::string>& paths);

/// Conditions from "shear_rate=150 1/s", "hematocrit=0.4", "gap=100 um", "kappa_damping=0.8", "t_c=10 ms",
/// "Ca=0.1"; what is not named is NaN. \throws InputError naming the known ones.
data::TransportLaw::Conditions conditions_asked(const std::vector<std::string>& settings);

/// The regression and its hypotheses as text for the terminal.
std::string conditions_table(const calibration::ConditionFit& fit);

/// results.json of one calibration, for its report.
Json single_results(const std::vector<data::Trajectories>& runs, const calibration::Calibration& result,
                    double t0, const std::string& source, const std::string& command);

}  // namespace hemowalk::workflow
