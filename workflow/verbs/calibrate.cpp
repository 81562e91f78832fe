/// \file hemowalk calibrate: trajectories -> D with its uncertainty -> transport_law.yaml

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>

#include "calibration/calibration.hpp"
#include "core/check.hpp"
#include "core/log.hpp"
#include "core/units.hpp"
#include "workflow/command.hpp"

namespace hemowalk::workflow {
namespace {

namespace fs = std::filesystem;

struct CalibrateFlags {
  std::string import_folder, t0 = "300 ms", core, lag, kind = "platelet";
  int bootstrap = 1000;
};

/// The HDF5 file meant by a run folder or a file.
std::string trajectories_path(const std::string& file) {
  require(fs::exists(file), "no such file or folder: " + file +
                                " (trajectories are needed) give a run folder, a .h5 file or --import DIR");
  if (!fs::is_directory(file)) return file;
  const std::string inside = file + "/trajectories.h5";
  require(
      fs::exists(inside),
      file +
          " holds no trajectories.h5 (it is no finished run) give a run folder, a .h5 file or --import DIR");
  return inside;
}

/// "10um:40um" -> m.
std::array<double, 2> parse_range(const std::string& text) {
  const auto colon = text.find(':');
  require(colon != std::string::npos,
          "--core `" + text + "` is no range (two heights are expected) write it like 10um:40um");
  const std::array<double, 2> range{parse_quantity(text.substr(0, colon), "m", "um"),
                                    parse_quantity(text.substr(colon + 1), "m", "um")};
  require(range[0] < range[1],
          "--core `" + text + "` is empty (the lower height comes first) write it like 10um:40um");
  return range;
}

void print_table(const calibration::Calibration& c, const std::string& law_file) {
  fmt::print("{} {}s, {:.3g} s, walls at {:.4g} and {:.4g} um\n\n", c.n_platelets, c.kind, c.duration,
             c.walls_y[0] * 1e6, c.walls_y[1] * 1e6);
  fmt::print("{:<14}{:>14}{:>12}{:>26}{:>10}  {}\n", "estimator", "D (m2/s)", "sigma", "68 % interval", "n",
             "");
  for (const auto& e : c.estimators)
    fmt::print("{:<14}{:>14.4g}{:>12.2g}{:>26}{:>10}  {}\n", e.name, e.D, e.sigma,
               fmt::format("{:.4g} .. {:.4g}", e.ci68[0], e.ci68[1]), e.n,
               e.note.empty() && e.lag > 0 ? fmt::format("lag {:.3g} ms", e.lag * 1e3) : e.note);
  if (!c.verdict.empty()) fmt::print("\n");
  for (const auto& v : c.verdict) fmt::print("{}\n", v.statement);
  if (!law_file.empty()) fmt::print("\ntransport law: {}\n", law_file);
}

int calibrate(const Flags& flags, const CalibrateFlags& own) {
  require(
      flags.file.empty() != own.import_folder.empty(),
      "calibrate needs one source (a run folder, a .h5 file, or --import DIR) see hemowalk calibrate --help");
  calibration::Options options;
  options.kind = own.kind;
  options.t0 = parse_quantity(own.t0, "s", "ms");
  if (!own.core.empty()) options.core = parse_range(own.core);
  if (!own.lag.empty()) options.lag = parse_quantity(own.lag, "s", "ms");
  options.bootstrap = own.bootstrap;
  options.seed = flags.seed.value_or(1);

  std::vector<data::Trajectories> runs;
  if (!own.import_folder.empty()) {
    require(
        fs::is_directory(own.import_folder),
        "no such folder: " + own.import_folder + " (--import reads a folder of text files) check the path");
    runs.push_back(calibration::import_text_folder(own.import_folder));
  } else {
    runs.push_back(data::read_trajectories(trajectories_path(flags.file)));
  }
  auto result = calibration::calibrate(runs, options);
  for (const auto& w : result.warnings) log_warning(w);
  if (!result.law.gate.passed) {
    log_warning("artefact gate FAILED: these trajectories carry something that is not diffusion");
    for (const auto& f : result.law.gate.findings)
      if (!f.passed)
        log_warning(fmt::format("  {}: {:.4g} (limit {:.4g}) {}", f.name, f.value, f.limit, f.note));
    if (flags.strict)
      throw Refused(
          "the artefact gate failed (--strict makes that an error) look at the findings above; nothing was "
          "written");
  }

  const std::string folder = !flags.out.empty()                                    ? flags.out
                             : !flags.file.empty() && fs::is_directory(flags.file) ? flags.file
                                                                                   : ".";
  fs::create_directories(folder);
  result.law_file = (fs::path(folder) / "transport_law.yaml").lexically_normal().string();
  data::write_transport_law(result.law, result.law_file);
  if (flags.json)
    print_json(nlohmann::ordered_json::parse(calibration::to_json(result)));
  else
    print_table(result, result.law_file);
  return 0;
}

}  // namespace

void add_calibrate(CLI::App& program, Session& session) {
  auto own = std::make_shared<CalibrateFlags>();
  auto* verb = add_verb(
      program, session, "calibrate", "trajectories -> D with its uncertainty, and a transport law",
      takes_file | takes_out | takes_threads | takes_seed | takes_strict,
      [&session, own] { return calibrate(session.flags, *own); }, "run folder or trajectories .h5 file");
  verb->add_option("--import", own->import_folder,
                   "folder of published text files (iT, x, y, z per platelet)")
      ->type_name("DIR");
  verb->add_option("--t0", own->t0, "start of the window, after the transient (default 300ms)")
      ->type_name("TIME");
  verb->add_option(
          "--core", own->core,
          "layer whose cells count, e.g. 10um:40um (default: from the red-cell profile or the walls)")
      ->type_name("Y:Y");
  verb->add_option("--lag", own->lag, "lag of the plateau estimator (default: 2/shear rate)")
      ->type_name("TIME");
  verb->add_option("--kind", own->kind, "kind of cell (default platelet)")->type_name("NAME");
  verb->add_option("--bootstrap", own->bootstrap, "bootstrap draws (default 1000)")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
}

}  // namespace hemowalk::workflow
