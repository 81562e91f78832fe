#pragma once
/// \file The plan of a campaign: its sweep points, their runs, and what has to be done about each. Changes
/// nothing.

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "workflow/campaign.hpp"
#include "workflow/command.hpp"
#include "workflow/run_directory.hpp"
#include "workflow/scenes.hpp"

namespace hemowalk::workflow {

/// One run: a scene to resolve, or trajectories to generate, import or read.
struct PlannedRun {
  enum class Action { fresh, cached, resume, retry, running };
  std::string hash;    ///< 12 digits of the hash of input and program version
  std::string folder;  ///< DIR/runs/<hash>
  std::string title;   ///< for a line on the terminal
  std::size_t point = 0;
  std::uint64_t seed = 0;
  std::string input;       ///< canonical text: scene.yaml, or the source of the trajectories
  bool scene = false;      ///< resolved in a child process; otherwise made here from
  std::size_t source = 0;  ///< this one of the campaign's sources
  Action action = Action::fresh;
  std::string reason;  ///< why this action
  Cost cost;
};

/// One point of the sweep: its runs differ in their seed only.
struct Point {
  std::string label;  ///< "kappa_damping = 0.5"; the campaign's name without a sweep
  std::string slug;   ///< for file names
  nlohmann::ordered_json settings = nlohmann::ordered_json::object();
  std::vector<std::size_t> runs;
};

struct Plan {
  std::string folder;
  std::vector<Point> points;
  std::vector<PlannedRun> runs;
  std::vector<std::string> warnings;
};

std::string to_string(PlannedRun::Action action);

/// The campaign of the flags: FILE with --set, --out, --threads and --seed applied.
Campaign read_campaign_with(const Flags& flags);

/// Looks at the campaign and at its folder. \throws InputError for scenes that cannot run.
Plan make_plan(const Campaign& campaign);

/// The table for the terminal.
std::string plan_table(const Plan& plan);
/// The list of runs for --json.
nlohmann::ordered_json plan_json(const Plan& plan);

}  // namespace hemowalk::workflow
