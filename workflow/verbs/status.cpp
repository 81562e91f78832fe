/// \file hemowalk status: the states of a campaign's runs, from their folders; also while they run.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "core/check.hpp"
#include "core/progress.hpp"
#include "workflow/command.hpp"
#include "workflow/plan.hpp"

namespace hemowalk::workflow {
namespace {

namespace fs = std::filesystem;

struct Entry {
  std::string hash;
  Status status;
};

/// A process that says it runs holds its folder's lock; otherwise it is gone.
Entry look(const fs::path& folder) {
  Entry entry{folder.filename().string(), read_status(folder).value_or(Status{})};
  if (entry.status.state == State::running &&
      (!fs::exists(folder / ".lock") || Lock((folder / ".lock").string()).held()))
    entry.status.state = State::interrupted,
    entry.status.reason = "its process vanished; run the campaign again to continue";
  return entry;
}

int status(const Flags& flags) {
  require(!flags.file.empty(),
          "status needs a campaign file or the folder it wrote into: hemowalk status FILE");
  require(fs::exists(flags.file),
          "no such file or folder: " + flags.file + " (a campaign is needed) check the path");
  const fs::path folder = fs::is_directory(flags.file) ? flags.file : read_campaign_with(flags).out;
  require(fs::is_directory(folder / "runs"),
          folder.string() + " holds no runs (the campaign was not started) try hemowalk plan");
  std::vector<Entry> entries;
  for (const auto& item : fs::directory_iterator(folder / "runs"))
    if (item.is_directory()) entries.push_back(look(item.path()));
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.hash < b.hash; });

  if (flags.json) {
    auto object = json_head("status", "", std::nullopt);
    object["folder"] = folder.string();
    object["runs"] = nlohmann::ordered_json::array();
    for (const auto& [hash, s] : entries) {
      nlohmann::ordered_json run{{"hash", hash}, {"state", to_string(s.state)}, {"reason", s.reason}};
      run["exit_code"] = s.exit_code ? nlohmann::ordered_json(*s.exit_code) : nlohmann::ordered_json(nullptr);
      run["attempt"] = s.attempt, run["steps"] = s.steps, run["wall_s"] = finite(s.wall),
      run["progress"] = finite(s.progress);
      const double left = s.progress > 0 && s.state == State::running ? s.wall * (1 - s.progress) / s.progress
                          : s.state == State::done                    ? 0
                                                                      : NAN;
      run["estimate"] = {{"wall_s", finite(left)}, {"memory_mb", nullptr}, {"disk_mb", nullptr}};
      object["runs"].push_back(run);
    }
    print_json(object);
    return 0;
  }
  fmt::print("{:<12}  {:<12}{:>8}{:>9}{:>10}  {}\n", "run", "state", "done", "attempt", "time", "reason");
  for (const auto& [hash, s] : entries)
    fmt::print("{:<12}  {:<12}{:>6.0f} %{:>9}{:>10}  {}\n", hash, to_string(s.state), 100 * s.progress,
               s.attempt, format_duration(s.wall), s.state == State::running ? s.line : s.reason);
  return 0;
}

}  // namespace

void add_status(CLI::App& program, Session& session) {
  add_verb(
      program, session, "status", "states of a campaign's runs, also while they run",
      takes_file | takes_set | takes_out, [&session] { return status(session.flags); },
      "campaign.yaml or its folder");
}

}  // namespace hemowalk::workflow
