/// \file hemowalk calibrate: trajectories -> D with its uncertainty -> transport_law.yaml; with --plan what
/// an error costs, with --laws the law over conditions

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "calibration/calibration.hpp"
#include "core/check.hpp"
#include "core/io.hpp"
#include "core/log.hpp"
#include "core/units.hpp"
#include "workflow/coarse_walk.hpp"
#include "workflow/command.hpp"
#include "workflow/report.hpp"
#include "workflow/studies.hpp"

namespace hemowalk::workflow {
namespace {

namespace fs = std::filesystem;

struct CalibrateFlags {
  std::string import_folder, t0 = "300 ms", core, lag, kind = "platelet";
  std::vector<std::string> more;  ///< further independent runs
  int bootstrap = 1000;
  bool report = false;
  const CLI::Option* plan = nullptr;
  std::string plan_error, shear_rate = "100 1/s";
  std::vector<std::string> laws, at;
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

/// D of estimators and sources on one logarithmic axis: value `o` (ours) or `x`, range `-`.
void print_chart(const calibration::Calibration& c) {
  struct Row {
    std::string name;
    double D, low, high;
    char mark;
  };
  std::vector<Row> rows;
  for (const auto& e : c.estimators)
    if (e.D > 0) rows.push_back({e.name, e.D, e.ci68[0], e.ci68[1], 'o'});
  for (const auto& v : c.verdict)
    rows.push_back({v.source + (v.matched_conditions ? "" : " *"), v.D, v.D_lo, v.D_hi, 'x'});
  double low = c.law.core.D / 2, high = c.law.core.D * 2;
  for (const auto& r : rows) {
    low = std::min(low, r.low > 0 ? r.low : r.D);
    high = std::max(high, std::isfinite(r.high) ? r.high : r.D);
  }
  constexpr int width = 60;
  const auto place = [&](double D) {
    return std::clamp(static_cast<int>(std::lround((width - 1) * std::log(D / low) / std::log(high / low))),
                      0, width - 1);
  };
  fmt::print("\n{:<34}|{:<9.2g}{:^42}{:>9.2g}|\n", "D, m2/s, logarithmic", low, "", high);
  for (const auto& r : rows) {
    std::string line(width, ' ');
    line[static_cast<std::size_t>(place(c.law.core.D))] = ':';
    if (r.low > 0 && std::isfinite(r.high))
      for (int k = place(r.low); k <= place(r.high); ++k) line[static_cast<std::size_t>(k)] = '-';
    line[static_cast<std::size_t>(place(r.D))] = r.mark;
    fmt::print("{:<34}|{}|\n", r.name, line);
  }
  fmt::print(
      "o this work with its 68 % interval, x published (* other conditions), : what goes into the law\n");
}

void print_result(const calibration::Calibration& c) {
  fmt::print("{} {}s, {:.3g} s, walls at {:.4g} and {:.4g} um\n\n", c.n_platelets, c.kind, c.duration,
             c.walls_y[0] * 1e6, c.walls_y[1] * 1e6);
  fmt::print("{:<14}{:>14}{:>12}{:>26}{:>10}  {}\n", "estimator", "D (m2/s)", "sigma", "68 % interval", "n",
             "");
  for (const auto& e : c.estimators)
    fmt::print("{:<14}{:>14.4g}{:>12.2g}{:>26}{:>10}  {}\n", e.name, e.D, e.sigma,
               fmt::format("{:.4g} .. {:.4g}", e.ci68[0], e.ci68[1]), e.n,
               e.note.empty() && e.lag > 0 ? fmt::format("lag {:.3g} ms", e.lag * 1e3) : e.note);
  fmt::print("\ncore: D = ({:.3f} +- {:.3f})e-10 m2/s from `{}`: {}\n", c.law.core.D * 1e10,
             c.law.core.D_sigma * 1e10, c.core_estimator, c.core_reason);
  fmt::print("step law {}\n", c.step_reason);
  if (!c.shear_note.empty()) fmt::print("shear: {}\n", c.shear_note);
  if (const auto& r = c.residence; r.visits)
    fmt::print(
        "near the walls ({:.2g} um): of {} at t0 {} leave again; mean stay {:.2g} +- {:.1g} s, mean time "
        "away "
        "{:.2g} +- {:.1g} s\n",
        r.zone * 1e6, r.near_at_t0, r.left_of_t0, r.mean_time, r.mean_time_sigma, r.mean_time_out,
        r.mean_time_out_sigma);
  for (const auto& [h, who] :
       {std::pair{&c.holdout, "the fitted law"}, std::pair{&c.holdout_walk, "the coarse walk"}}) {
    if (h->lag.empty()) continue;
    fmt::print("half of the cells, predicted by {} from the others:", who);
    for (std::size_t k = 0; k < h->lag.size(); ++k)
      fmt::print(" MSD({:.3g} ms) observed/predicted {:.2f} +- {:.2f}, histogram p = {:.2g};",
                 h->lag[k] * 1e3, h->msd_ratio[k], h->msd_sigma[k], h->histogram_p[k]);
    fmt::print(" profile after {:.3g} s p = {:.2g}\n", h->profile_lag, h->profile_p);
  }
  print_chart(c);
  if (!c.verdict.empty()) fmt::print("\n");
  for (const auto& v : c.verdict) fmt::print("{}\n", v.statement);
  if (!c.law_file.empty()) fmt::print("\ntransport law: {}\n", c.law_file);
}

calibration::Options options_of(const Flags& flags, const CalibrateFlags& own) {
  calibration::Options options;
  options.kind = own.kind;
  options.t0 = parse_quantity(own.t0, "s", "ms");
  if (!own.core.empty()) options.core = parse_range(own.core);
  if (!own.lag.empty()) options.lag = parse_quantity(own.lag, "s", "ms");
  options.bootstrap = own.bootstrap;
  options.seed = flags.seed.value_or(1);
  options.walk = coarse_walk();
  return options;
}

std::vector<data::Trajectories> read_runs(const Flags& flags, const CalibrateFlags& own) {
  std::vector<data::Trajectories> runs;
  if (!own.import_folder.empty()) {
    require(own.more.empty(),
            "--import and runs together (they do not share one scene) calibrate them apart");
    require(
        fs::is_directory(own.import_folder),
        "no such folder: " + own.import_folder + " (--import reads a folder of text files) check the path");
    runs.push_back(calibration::import_text_folder(own.import_folder));
    return runs;
  }
  runs.push_back(data::read_trajectories(trajectories_path(flags.file)));
  for (const auto& file : own.more) runs.push_back(data::read_trajectories(trajectories_path(file)));
  return runs;
}

/// The gate, loudly. \throws Refused with --strict, before anything is written.
void report_gate(const calibration::Calibration& result, bool strict) {
  if (result.law.gate.passed) return;
  log_warning("artefact gate FAILED: these trajectories carry something that is not diffusion");
  for (const auto& f : result.law.gate.findings)
    if (!f.passed)
      log_warning(fmt::format("  {}: {:.4g} (limit {:.4g}) {}", f.name, f.value, f.limit, f.note));
  if (strict)
    throw Refused(
        "the artefact gate failed (--strict makes that an error) look at the findings above; nothing was "
        "written");
}

/// What an error costs; scaled from the trajectories where there are any. Writes nothing.
int plan(const Flags& flags, const CalibrateFlags& own) {
  const auto errors = errors_asked(own.plan_error);
  calibration::PlanInput input;
  input.shear_rate = parse_quantity(own.shear_rate, "1/s", "1/s");
  input.t0 = parse_quantity(own.t0, "s", "ms");
  input.run_time = std::max(input.run_time, 2 * input.t0);
  calibration::Calibration measured;
  if (!flags.file.empty() || !own.import_folder.empty()) {
    measured = calibration::calibrate(read_runs(flags, own), options_of(flags, own));
    report_gate(measured, flags.strict);
    input.measured = &measured.law;
    input.shear_rate = measured.law.conditions.shear_rate;
    input.lag = measured.law.core.lag;
    input.run_time = measured.duration;
    input.platelets = measured.n_platelets / measured.n_runs;
    input.platelet_seconds = measured.n_platelets * (measured.duration - input.t0);
  }
  if (flags.json) {
    auto object = json_head("calibrate", "", flags.seed, measured.warnings);
    object["plan"] = plans_json(errors, input);
    print_json(object);
  } else {
    fmt::print("{}", plans_table(errors, input));
  }
  return 0;
}

/// The law over conditions from several transport laws; with --at the law at one of them.
int over_conditions(const Flags& flags, const CalibrateFlags& own) {
  require(flags.file.empty() && own.import_folder.empty(),
          "--laws and trajectories together (laws come from calibrations) calibrate the trajectories first");
  const auto laws = read_laws(own.laws);
  const auto fit = calibration::fit_conditions(laws);
  for (const auto& w : fit.warnings) log_warning(w);
  if (flags.strict && !fit.warnings.empty())
    throw Refused(fit.warnings.front() +
                  " (--strict makes that an error) calibrate clean runs; nothing was written");
  const fs::path folder = flags.out.empty() ? "." : flags.out;
  std::string law_file;
  if (!own.at.empty()) {
    const auto law = calibration::law_at(fit, laws, conditions_asked(own.at));
    fs::create_directories(folder);
    law_file = (folder / "transport_law.yaml").lexically_normal().string();
    data::write_transport_law(law, law_file);
    log_info(fmt::format("D there: ({:.3f} +- {:.3f})e-10 m2/s, in {}", law.core.D * 1e10,
                         law.core.D_sigma * 1e10, law_file));
  }
  fs::create_directories(folder);
  const std::string text = calibration::conditions_json(fit, laws);
  const auto file = (folder / "law_over_conditions.json").lexically_normal();
  write_file_atomic(file.string(), text);
  if (flags.json) {
    auto object = json_head("calibrate", "", flags.seed, fit.warnings);
    object["over_conditions"] = Json::parse(text);
    object["over_conditions_file"] = file.string();
    object["law_file"] = law_file.empty() ? Json(nullptr) : Json(law_file);
    print_json(object);
  } else {
    fmt::print("{}\nlaw over conditions: {}\n", conditions_table(fit), file.string());
  }
  return 0;
}

int calibrate(const Session& session, CalibrateFlags& own) {
  Flags flags = session.flags;
  const bool plans = own.plan->count() > 0;
  // `--plan RUN_DIR`: what follows is the run, not an error.
  if (plans && flags.file.empty() && !own.plan_error.empty() && fs::exists(own.plan_error))
    std::swap(flags.file, own.plan_error);
  require(own.at.empty() || !own.laws.empty(),
          "--at needs the laws it goes between (--laws) give them: --laws DIR_OR_LAW ...");
  if (!own.laws.empty()) return over_conditions(flags, own);
  const bool one_source = flags.file.empty() != own.import_folder.empty();
  require(
      one_source || (plans && flags.file.empty()),
      "calibrate needs one source (a run folder, a .h5 file, or --import DIR) see hemowalk calibrate --help");
  if (plans) return plan(flags, own);
  const auto options = options_of(flags, own);
  const auto runs = read_runs(flags, own);
  auto result = calibration::calibrate(runs, options);
  for (const auto& w : result.warnings) log_warning(w);
  report_gate(result, flags.strict);

  const std::string folder = !flags.out.empty()                                    ? flags.out
                             : !flags.file.empty() && fs::is_directory(flags.file) ? flags.file
                                                                                   : ".";
  fs::create_directories(folder);
  result.law_file = (fs::path(folder) / "transport_law.yaml").lexically_normal().string();
  data::write_transport_law(result.law, result.law_file);
  if (own.report) {
    std::string command;
    for (const auto& a : session.arguments) command += (command.empty() ? "" : " ") + a;
    const std::string source = own.import_folder.empty() ? flags.file : own.import_folder;
    const auto file = (fs::path(folder) / "report.html").lexically_normal().string();
    write_file_atomic(file, render_report(single_results(runs, result, options.t0, source, command)));
    log_info("report: " + file);
  }
  if (flags.json)
    print_json(nlohmann::ordered_json::parse(calibration::to_json(result)));
  else
    print_result(result);
  return 0;
}

}  // namespace

void add_calibrate(CLI::App& program, Session& session) {
  auto own = std::make_shared<CalibrateFlags>();
  auto* verb = add_verb(
      program, session, "calibrate", "trajectories -> D with its uncertainty, and a transport law",
      takes_file | takes_out | takes_threads | takes_seed | takes_strict,
      [&session, own] { return calibrate(session, *own); }, "run folder or trajectories .h5 file");
  verb->add_option("MORE", own->more, "further independent runs of the same scene")->type_name("");
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
  verb->add_flag("--report", own->report,
                 "write report.html (charts, the literature among them) beside the law");
  own->plan =
      verb->add_option(
              "--plan", own->plan_error,
              "platelet-seconds for a relative error of D, e.g. 5% (default: a table); scaled from the "
              "trajectories if given")
          ->type_name("[ERROR]")
          ->expected(0, 1);
  verb->add_option("--shear-rate", own->shear_rate,
                   "shear rate of --plan without trajectories (default 100 1/s)")
      ->type_name("RATE");
  verb->add_option("--laws", own->laws, "transport laws or campaign folders: the law over their conditions")
      ->type_name("PATH ...");
  verb->add_option("--at", own->at,
                   "with --laws: write the transport law at these conditions, e.g. 'shear_rate=150 1/s'")
      ->type_name("KEY=VALUE ...");
}

}  // namespace hemowalk::workflow
