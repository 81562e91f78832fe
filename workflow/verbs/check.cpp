/// \file hemowalk check: everything that is wrong with a file, at once; what it means if nothing is.

#include <fmt/format.h>

#include <filesystem>

#include "coarse/simulation.hpp"
#include "core/check.hpp"
#include "core/log.hpp"
#include "core/provenance.hpp"
#include "workflow/command.hpp"
#include "workflow/plan.hpp"

namespace hemowalk::workflow {
namespace {

struct Finding {
  std::string sha256, summary;
  std::optional<std::uint64_t> seed;
  std::vector<std::string> warnings;
};

Finding check_scene(const Flags& flags) {
  const auto scene = data::read_scene(flags.file, overrides(flags));
  std::string problems;
  for (const auto& p : scene_problems(scene))
    problems += (problems.empty() ? "" : "\n") + flags.file + ": " + p;
  require(problems.empty(), problems);
  return {scene.input_sha256, scene_summary(scene), scene.seed, scene.warnings};
}

Finding check_campaign(const Flags& flags) {
  const auto campaign = read_campaign_with(flags);
  const auto plan = make_plan(campaign);
  return {campaign.input_sha256,
          fmt::format("{}: {} point{}, {} run{}, {} coarse case{}", campaign.name, plan.points.size(),
                      plan.points.size() == 1 ? "" : "s", plan.runs.size(), plan.runs.size() == 1 ? "" : "s",
                      campaign.coarse.size(), campaign.coarse.size() == 1 ? "" : "s"),
          campaign.seed(), plan.warnings};
}

Finding check_coarse(const Flags& flags) {
  const auto the_case = coarse::read_case(flags.file, overrides(flags));
  if (!the_case.law_file.empty()) data::read_transport_law(the_case.law_file);
  auto warnings = the_case.warnings;
  if (const std::string problem = coarse::place_problem(the_case); !problem.empty())
    warnings.push_back(problem);
  return {the_case.input_sha256,
          fmt::format("{} walkers, {:.4g} mm, {:.4g} s in steps of {:.4g} ms", the_case.walkers,
                      the_case.height * 1e3, the_case.end, the_case.dt * 1e3),
          the_case.seed, warnings};
}

Finding check_law(const Flags& flags) {
  const auto law = data::read_transport_law(flags.file);
  return {sha256_of_file(flags.file),
          fmt::format("D = {:.4g} +- {:.2g} m2/s at {:.4g} 1/s, hematocrit {:.3g}", law.core.D,
                      law.core.D_sigma, law.conditions.shear_rate, law.conditions.hematocrit),
          law.provenance.seed,
          {}};
}

int check(const Flags& flags) {
  require(
      !flags.file.empty(),
      "check needs a file (a scene, campaign, coarse case or transport law) give one: hemowalk check FILE");
  const std::string kind = kind_of_file(flags.file);
  require(!kind.empty(), flags.file +
                             ": its format is not known (the first key must read, for example, `format: "
                             "hemowalk.scene/1`) write scene, campaign, coarse or transport_law");
  const Finding finding = kind == "scene"      ? check_scene(flags)
                          : kind == "campaign" ? check_campaign(flags)
                          : kind == "coarse"   ? check_coarse(flags)
                                               : check_law(flags);
  for (const auto& w : finding.warnings) log_warning(w);
  if (flags.json) {
    auto object = json_head("check", finding.sha256, finding.seed, finding.warnings);
    object["kind"] = kind;
    object["summary"] = finding.summary;
    print_json(object);
  } else {
    fmt::print("{}: a valid {} ({})\n", flags.file, kind, finding.summary);
  }
  return 0;
}

}  // namespace

void add_check(CLI::App& program, Session& session) {
  add_verb(
      program, session, "check", "all errors of a scene, campaign, coarse case or law at once",
      takes_file | takes_set | takes_seed, [&session] { return check(session.flags); },
      "scene.yaml, campaign.yaml, coarse.yaml or transport_law.yaml");
}

}  // namespace hemowalk::workflow
