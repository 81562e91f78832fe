#include "workflow/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "coarse/simulation.hpp"
#include "core/check.hpp"
#include "core/progress.hpp"
#include "workflow/command.hpp"

namespace hemowalk::workflow {

namespace {

namespace fs = std::filesystem;

/// "cells.kinds.rbc.kappa_damping" -> "kappa_damping", "domain.size.1" -> "H".
std::string short_key(const std::string& key) {
  if (key == "domain.size.1") return "H";
  const auto parts = yaml::split_path(key);
  const bool indexed = parts.size() > 1 && parts.back().find_first_not_of("0123456789") == std::string::npos;
  return indexed ? parts[parts.size() - 2] + "." + parts.back() : parts.back();
}

std::string label_of(const Run& run, const std::string& fallback) {
  std::string label;
  for (const auto& [key, value] : run.labels)
    label += (label.empty() ? "" : ", ") + short_key(key) + " = " + value;
  return label.empty() ? fallback : label;
}

/// For file names: letters, digits, points; the rest becomes one underscore each.
std::string slug_of(const std::string& label) {
  std::string slug;
  for (const char c : label) {
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '.')
      slug += c;
    else if (!slug.empty() && slug.back() != '_')
      slug += '_';
  }
  while (!slug.empty() && slug.back() == '_') slug.pop_back();
  return slug.empty() ? "point" : slug;
}

/// What the folder says about the run.
void decide(PlannedRun& run) {
  using Action = PlannedRun::Action;
  const auto status = fs::exists(run.folder) ? read_status(run.folder) : std::nullopt;
  if (!status) {
    run.action = Action::fresh, run.reason = "not computed yet";
    return;
  }
  const bool results = fs::exists(run.folder + "/trajectories.h5"),
             checkpoint = fs::exists(run.folder + "/checkpoint");
  const bool alive = fs::exists(run.folder + "/.lock") && !Lock(run.folder + "/.lock").held();
  const std::string from =
      checkpoint ? "continues from its checkpoint" : "starts again, there is no checkpoint";
  switch (status->state) {
    case State::done:
      run.action = results ? Action::cached : Action::fresh;
      run.reason = results ? "done" : "its trajectories.h5 is gone";
      return;
    case State::queued:
      run.action = Action::fresh, run.reason = "queued, never started";
      return;
    case State::running:
      run.action = alive ? Action::running : Action::resume;
      run.reason = alive ? "in progress" : "its process vanished; " + from;
      return;
    case State::interrupted:
      run.action = Action::resume, run.reason = "interrupted; " + from;
      return;
    case State::timed_out:
      run.action = Action::resume, run.reason = "timed out; " + from;
      return;
    case State::failed:
      run.action = Action::retry, run.reason = fmt::format("failed {} time{}: {}", status->attempt,
                                                           status->attempt == 1 ? "" : "s", status->reason);
      return;
  }
}

void add_scenes(const Campaign& campaign, Plan& plan) {
  const auto runs = expand(campaign);
  std::set<std::string> problems;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Run& run = runs[i];
    if (run.replica == 0)
      for (const auto& p : scene_problems(run.scene)) problems.insert(p);
    require(campaign.calibrate.t0 < run.scene.time.end, [&] {
      return fmt::format(
          "calibrate.t0 = {:.4g} ms is not before the end of the runs, {:.4g} ms (nothing would be left to "
          "analyse) shorten t0 or lengthen time.end",
          campaign.calibrate.t0 * 1e3, run.scene.time.end * 1e3);
    });
    if (run.point >= plan.points.size()) {
      Point point;
      point.label = label_of(run, campaign.name);
      point.slug = slug_of(point.label);
      for (const auto& [key, value] : run.labels) point.settings[key] = value;
      plan.points.push_back(point);
    }
    PlannedRun planned;
    planned.hash = run.hash12;
    planned.point = run.point;
    planned.seed = run.scene.seed;
    planned.title =
        plan.points[run.point].label + (campaign.replicas > 1 ? fmt::format(" #{}", run.replica + 1) : "");
    planned.input = run.scene.source_text;
    planned.scene = true;
    planned.cost = scene_cost(run.scene);
    plan.points[run.point].runs.push_back(plan.runs.size());
    plan.runs.push_back(planned);
  }
  std::string all;
  for (const auto& p : problems) all += (all.empty() ? "" : "\n") + p;
  require(all.empty(), all);
}

void add_sources(const Campaign& campaign, Plan& plan) {
  std::map<std::size_t, std::size_t> points;  // the campaign's number -> ours: absent sources leave gaps
  for (std::size_t s = 0; s < campaign.sources.size(); ++s) {
    const auto& source = campaign.sources[s];
    if (!source.present) continue;  // optional: the campaign's warnings say so
    const auto [found, added] = points.emplace(source.point, plan.points.size());
    if (added)
      plan.points.push_back({source.name, slug_of(source.name), nlohmann::ordered_json::object(), {}});
    PlannedRun planned;
    planned.hash = source.hash;
    planned.point = found->second;
    planned.seed = source.type == TrajectorySource::Type::synthetic ? source.synthetic.seed : 0;
    planned.title = source.name + (source.replica > 0 ? fmt::format(" #{}", source.replica + 1) : "");
    planned.input = source.text;
    planned.source = s;
    plan.points[found->second].runs.push_back(plan.runs.size());
    plan.runs.push_back(planned);
  }
}

/// Runs of this folder that are done tell how this machine compares with the estimate.
void correct_costs(Plan& plan) {
  double measured = 0, expected = 0;
  for (const auto& run : plan.runs)
    if (run.action == PlannedRun::Action::cached && std::isfinite(run.cost.wall))
      if (const auto status = read_status(run.folder)) measured += status->wall, expected += run.cost.wall;
  if (!(measured > 0 && expected > 0)) return;
  for (auto& run : plan.runs) run.cost.wall *= measured / expected;
}

std::string or_dash(double value, double unit, const char* name) {
  return std::isfinite(value) ? fmt::format("{:.3g} {}", value / unit, name) : "-";
}

}  // namespace

std::string to_string(PlannedRun::Action action) {
  constexpr std::array<const char*, 5> names{"new", "cached", "resume", "retry", "running"};
  return names[static_cast<std::size_t>(action)];
}

Campaign read_campaign_with(const Flags& flags) {
  auto changes = flags.set;
  auto campaign = read_campaign(flags.file, changes);
  if (flags.seed) {  // of the scene, and of what is generated instead of one
    const std::string seed = "seed=" + std::to_string(*flags.seed);
    if (campaign.scene.type != yaml::Node::Type::null) changes.push_back("scene." + seed);
    std::set<std::size_t> seen;
    for (const auto& source : campaign.sources)
      if (source.type == TrajectorySource::Type::synthetic && seen.insert(source.point).second)
        changes.push_back("trajectories." + std::to_string(source.point) + ".synthetic." + seed);
    campaign = read_campaign(flags.file, changes);
  }
  if (!flags.out.empty()) campaign.out = flags.out;
  if (flags.threads > 0) campaign.launcher.threads = flags.threads;
  return campaign;
}

Plan make_plan(const Campaign& campaign) {
  require(campaign.launcher.type == Launcher::Type::local,
          "launcher: slurm is not in this version (campaigns run on one machine) use type: local");
  Plan plan;
  plan.folder = campaign.out;
  plan.warnings = campaign.warnings;
  for (const auto& the_case : campaign.coarse)  // a plan may be made on another machine than the run
    if (const std::string problem = coarse::place_problem(the_case); !problem.empty())
      plan.warnings.push_back(problem);
  add_scenes(campaign, plan);
  add_sources(campaign, plan);
  require(!plan.runs.empty(),
          "the campaign has nothing to run (no scene, and none of its trajectories is present) check the "
          "paths of its sources");
  for (auto& run : plan.runs) {
    run.folder = plan.folder + "/runs/" + run.hash;
    decide(run);
  }
  correct_costs(plan);
  return plan;
}

std::string plan_table(const Plan& plan) {
  std::size_t width = 5;
  for (const auto& run : plan.runs) width = std::max(width, run.title.size());
  std::string text = fmt::format("{:<12}  {:<{}}  {:<8}{:>10}{:>10}{:>10}  {}\n", "run", "point", width,
                                 "action", "time", "memory", "disk", "reason");
  double total = 0;
  int due = 0;
  for (const auto& run : plan.runs) {
    const bool cached = run.action == PlannedRun::Action::cached;
    if (!cached) {
      ++due;
      if (std::isfinite(run.cost.wall)) total += run.cost.wall;
    }
    text += fmt::format("{:<12}  {:<{}}  {:<8}{:>10}{:>10}{:>10}  {}\n", run.hash, run.title, width,
                        to_string(run.action),
                        cached || !std::isfinite(run.cost.wall) ? "-" : format_duration(run.cost.wall),
                        or_dash(run.cost.memory, 1e6, "MB"), or_dash(run.cost.disk, 1e6, "MB"), run.reason);
  }
  text += fmt::format("\n{} of {} runs to do{}; results in {}\n", due, plan.runs.size(),
                      total > 0 ? ", about " + format_duration(total) : "", plan.folder);
  return text;
}

nlohmann::ordered_json plan_json(const Plan& plan) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& run : plan.runs) {
    nlohmann::ordered_json entry{{"hash", run.hash},
                                 {"point", plan.points[run.point].label},
                                 {"seed", run.seed},
                                 {"action", to_string(run.action)},
                                 {"reason", run.reason}};
    entry["estimate"] = {{"wall_s", finite(run.cost.wall)},
                         {"memory_mb", finite(run.cost.memory / 1e6)},
                         {"disk_mb", finite(run.cost.disk / 1e6)}};
    list.push_back(entry);
  }
  return list;
}

}  // namespace hemowalk::workflow
