/// \file hemowalk report: a campaign folder's report, made again from its results.json

#include <fmt/format.h>

#include <filesystem>

#include "core/check.hpp"
#include "core/io.hpp"
#include "workflow/command.hpp"
#include "workflow/report.hpp"
#include "workflow/run_directory.hpp"

namespace hemowalk::workflow {
namespace {

namespace fs = std::filesystem;

int report(const Flags& flags) {
  require(!flags.file.empty(),
          "report needs a campaign folder (the one `run` wrote into) give it: hemowalk report DIR");
  const fs::path folder = flags.file;
  require(fs::exists(folder / "results.json"),
          flags.file + " holds no results.json (nothing was computed there) run the campaign first");
  auto results = nlohmann::ordered_json::parse(read_file(folder / "results.json"), nullptr, false);
  require(results.is_object() && results.value("format", "") == "hemowalk.results/1",
          (folder / "results.json").string() +
              " is no hemowalk.results/1 (it is damaged or of another program) run the campaign again");
  // The states are read anew: a run may have been repeated since.
  if (results.contains("runs"))
    for (auto& run : results["runs"])
      if (const auto status = read_status(folder / "runs" / run.value("hash", "?"))) {
        run["state"] = to_string(status->state), run["reason"] = status->reason;
        run["attempt"] = status->attempt, run["wall_s"] = status->wall;
      }
  const std::string file = (flags.out.empty() ? folder : fs::path(flags.out)) / "report.html";
  write_file_atomic(file, render_report(results));
  if (flags.json) {
    auto object = json_head(
        "report", results["input_sha256"].is_string() ? results["input_sha256"].get<std::string>() : "",
        std::nullopt);
    object["file"] = file;
    print_json(object);
  } else {
    fmt::print("{}\n", file);
  }
  return 0;
}

}  // namespace

void add_report(CLI::App& program, Session& session) {
  add_verb(
      program, session, "report", "make a campaign's report.html again", takes_file | takes_out,
      [&session] { return report(session.flags); }, "campaign folder");
}

}  // namespace hemowalk::workflow
