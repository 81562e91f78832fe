/// \file hemowalk run (and resume): a campaign end to end; what is done already is kept.

#include <fmt/format.h>

#include "core/check.hpp"
#include "core/log.hpp"
#include "core/progress.hpp"
#include "workflow/command.hpp"
#include "workflow/pipeline.hpp"
#include "workflow/plan.hpp"
#include "workflow/process.hpp"

namespace hemowalk::workflow {
namespace {

/// The command as a user would type it again, with the launcher instead of the program's path.
std::string typed(const std::vector<std::string>& arguments) {
  std::string text = "./hemowalk";
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    const bool plain = arguments[i].find_first_of(" \t'\"$*?&|;<>()[]{}") == std::string::npos;
    text += " " + (plain ? arguments[i] : "'" + arguments[i] + "'");
  }
  return text;
}

int run(const Session& session) {
  const Flags& flags = session.flags;
  require(!flags.file.empty(),
          session.verb + " needs a campaign (campaign.yaml) try: hemowalk run examples/quickstart.yaml");
  Campaign campaign = read_campaign_with(flags);
  PipelineOptions options;
  options.strict = flags.strict;
  options.command = typed(session.arguments);
  catch_stop_signals();
  const auto summary = run_pipeline(campaign, options);

  const bool refused = flags.strict && !summary.gate_passed;
  const Exit code = summary.failed ? Exit::failed_runs : refused ? Exit::refused : Exit::done;
  if (!summary.gate_passed) log_warning("an artefact gate failed: see the report's first lines");
  if (summary.failed)
    log_error(fmt::format("{} of {} runs failed (hemowalk status {} says why) the report covers the others",
                          summary.failed, summary.runs, flags.file));
  if (flags.json) {
    auto object = json_head(session.verb, campaign.input_sha256, campaign.seed(), summary.warnings);
    object["runs"] = summary.runs;
    object["done"] = summary.done;
    object["cached"] = summary.cached;
    object["failed"] = summary.failed;
    object["gate_passed"] = summary.gate_passed;
    object["results_file"] = summary.results_file;
    object["report_file"] = summary.report_file;
    object["wall_s"] = finite(summary.wall);
    print_json(object);
  } else {
    for (const auto& line : summary.headlines) fmt::print("{}\n", line);
    fmt::print("{}{} of {} runs done ({} cached) in {}\nresults: {}\nreport:  {}\n",
               summary.headlines.empty() ? "" : "\n", summary.done, summary.runs, summary.cached,
               format_duration(summary.wall), summary.results_file, summary.report_file);
  }
  return static_cast<int>(code);
}

}  // namespace

void add_run(CLI::App& program, Session& session) {
  constexpr unsigned accepts = takes_file | takes_set | takes_out | takes_threads | takes_seed | takes_strict;
  add_verb(
      program, session, "run", "a campaign end to end: runs, D, law, device, report", accepts,
      [&session] { return run(session); }, "campaign.yaml");
  add_verb(
      program, session, "resume", "continue a campaign (the same as run)", accepts,
      [&session] { return run(session); }, "campaign.yaml");
}

}  // namespace hemowalk::workflow
