/// \file hemowalk plan: what run would do, and what it would cost. Changes nothing.

#include <fmt/format.h>

#include "core/check.hpp"
#include "core/log.hpp"
#include "workflow/command.hpp"
#include "workflow/plan.hpp"

namespace hemowalk::workflow {
namespace {

int plan(const Flags& flags) {
  require(!flags.file.empty(),
          "plan needs a campaign (campaign.yaml) try: hemowalk plan examples/quickstart.yaml");
  const auto campaign = read_campaign_with(flags);
  const auto plan = make_plan(campaign);
  for (const auto& w : plan.warnings) log_warning(w);
  if (flags.json) {
    auto object = json_head("plan", campaign.input_sha256, campaign.seed(), plan.warnings);
    object["folder"] = plan.folder;
    object["runs"] = plan_json(plan);
    print_json(object);
  } else {
    fmt::print("{}", plan_table(plan));
  }
  return 0;
}

}  // namespace

void add_plan(CLI::App& program, Session& session) {
  add_verb(
      program, session, "plan", "the runs a campaign would do, with reason and estimate; changes nothing",
      takes_file | takes_set | takes_out | takes_seed, [&session] { return plan(session.flags); },
      "campaign.yaml");
}

}  // namespace hemowalk::workflow
