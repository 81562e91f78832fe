/// \file hemowalk resolve: one scene -> trajectories. Also what the campaign starts in child processes.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <chrono>
#include <filesystem>
#include <memory>

#include "core/check.hpp"
#include "core/device.hpp"
#include "core/io.hpp"
#include "core/log.hpp"
#include "core/mpi.hpp"
#include "core/progress.hpp"
#include "resolved/resolve.hpp"
#include "workflow/command.hpp"
#include "workflow/process.hpp"
#include "workflow/run_directory.hpp"

namespace hemowalk::workflow {
namespace {

namespace fs = std::filesystem;
using clock = std::chrono::steady_clock;

/// All problems at once, as one error.
void require_feasible(const data::Scene& scene, const std::string& file) {
  const auto problems = resolved::preflight(scene);
  std::string text;
  for (const auto& p : problems) text += (text.empty() ? "" : "\n") + file + ": " + p;
  require(problems.empty(), text);
}

/// Runs the scene and keeps status.json up to date until the very end, whatever the end is.
resolved::RunSummary run_with_status(const data::Scene& scene, const std::string& folder, bool resume,
                                     const mpi::Ranks& ranks) {
  const auto start = clock::now();
  auto last = start - std::chrono::hours(1);
  Status status = read_status(folder).value_or(Status{});
  const double earlier = status.wall;
  status.state = State::running, status.exit_code.reset(), status.reason.clear(), status.attempt += 1;
  const auto save = [&] {
    status.wall = earlier + std::chrono::duration<double>(clock::now() - start).count();
    write_status(folder, status);
  };
  save();
  Progress progress(fs::path(folder).filename().string());
  resolved::RunOptions options;
  options.out = folder;
  options.resume = resume;
  options.stop_requested = stop_requested;
  options.ranks = ranks;
  options.progress = [&](double fraction, const std::string& line) {
    progress.update(fraction, line);
    status.progress = fraction, status.line = line;
    if (clock::now() - last < std::chrono::seconds(1)) return;
    last = clock::now();
    save();
  };
  try {
    const auto summary = resolved::resolve(scene, options);
    status.state = State::done, status.exit_code = 0, status.reason = "finished", status.progress = 1;
    status.steps = summary.steps, status.line.clear();
    save();
    return summary;
  } catch (const Error& error) {
    status.state = error.code == Exit::interrupted ? State::interrupted : State::failed;
    status.exit_code = static_cast<int>(error.code), status.reason = error.what();
    save();
    throw;
  } catch (const std::exception& error) {
    status.state = State::failed, status.exit_code = static_cast<int>(Exit::internal),
    status.reason = error.what();
    save();
    throw;
  }
}

int resolve(const Flags& flags, bool resume) {
  require(!flags.file.empty(), "resolve needs a scene (scene.yaml) give its file: hemowalk resolve FILE");
  catch_stop_signals();
  mpi::start();  // under mpirun or srun: one run on many ranks, of which the root speaks to the user
  if (mpi::world_rank() != 0) set_log_level(LogLevel::error);
  const auto scene = data::read_scene(flags.file, overrides(flags));
  require_feasible(scene, flags.file);
  require((scene.place.fluid == Place::host && scene.place.solid == Place::host) || device_present(),
          flags.file + ": " + no_device);
  const std::string folder = flags.out.empty() ? "out/" + scene.input_sha256.substr(0, 12) : flags.out;
  const auto ranks = mpi::Ranks::world();
  std::unique_ptr<Lock> lock;
  ranks.on_root([&] {
    fs::create_directories(folder);
    lock = std::make_unique<Lock>(folder + "/.lock");
    if (!lock->held()) log_info("another process works in " + folder + ": waiting for it to stop");
    require(lock->wait(60), "another process works in " + folder +
                                " (it holds the folder's lock) wait for it or choose another --out");

    const std::string copy = folder + "/scene.yaml";
    const bool known = fs::exists(copy);
    require(!known || fs::equivalent(copy, flags.file) ||
                data::read_scene(copy).input_sha256 == scene.input_sha256,
            folder + " holds the run of another scene (its scene.yaml differs) choose another --out");
    if (!known) write_file_atomic(copy, scene.source_text);
  });
  if (!ranks.root()) {
    resolved::RunOptions options;
    options.out = folder;
    options.resume = resume;
    options.stop_requested = stop_requested;
    options.ranks = ranks;
    (void)resolved::resolve(scene, options);
    return 0;
  }
  const auto summary = run_with_status(scene, folder, resume, ranks);

  if (flags.json) {
    auto object = json_head("resolve", scene.input_sha256, scene.seed);
    object["folder"] = folder;
    object["steps"] = summary.steps;
    object["wall_s"] = finite(summary.wall);
    object["rbc"] = summary.rbc;
    object["platelets"] = summary.platelets;
    object["hematocrit_true"] = finite(summary.hematocrit_true);
    print_json(object);
  } else {
    fmt::print("{} red cells, {} platelets, hematocrit {:.1f} %, {} steps in {}: {}\n", summary.rbc,
               summary.platelets, 100 * summary.hematocrit_true, summary.steps, format_duration(summary.wall),
               folder);
  }
  return 0;
}

}  // namespace

void add_resolve(CLI::App& program, Session& session) {
  auto resume = std::make_shared<bool>(false);
  auto* verb = add_verb(
      program, session, "resolve", "scene -> trajectories, with every cell resolved",
      takes_file | takes_set | takes_out | takes_threads | takes_seed,
      [&session, resume] { return resolve(session.flags, *resume); }, "scene.yaml");
  verb->add_flag("--resume", *resume, "continue from the checkpoint in DIR if there is one");
}

}  // namespace hemowalk::workflow
