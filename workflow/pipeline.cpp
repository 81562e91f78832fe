#include "workflow/pipeline.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>

#include "calibration/calibration.hpp"
#include "coarse/simulation.hpp"
#include "core/check.hpp"
#include "core/io.hpp"
#include "core/log.hpp"
#include "core/progress.hpp"
#include "core/provenance.hpp"
#include "workflow/coarse_walk.hpp"
#include "workflow/command.hpp"
#include "workflow/local_launcher.hpp"
#include "workflow/plan.hpp"
#include "workflow/process.hpp"
#include "workflow/report.hpp"
#include "workflow/results.hpp"
#include "workflow/sources.hpp"

namespace hemowalk::workflow {

namespace {

namespace fs = std::filesystem;
using clock = std::chrono::steady_clock;

void stop_if_asked() {
  if (stop_requested())
    throw Interrupted(
        "stopped by a signal (everything finished so far is kept) run the same command again to continue");
}

/// The entry of \p list that was computed from the same inputs before, or null.
Json reusable(const Json& previous, const char* list, const std::string& key) {
  if (previous.contains(list))
    for (const auto& entry : previous[list])
      if (entry.value("key", "") == key) return entry;
  return nullptr;
}

class Pipeline {
 public:
  Pipeline(const Campaign& campaign, const PipelineOptions& options)
      : campaign_(campaign),
        options_(options),
        start_(clock::now()),
        plan_(make_plan(campaign)),
        folder_(plan_.folder) {}

  PipelineSummary execute() {
    for (const auto& the_case : campaign_.coarse) {
      const std::string problem = coarse::place_problem(the_case);
      require(problem.empty(), problem);
    }
    fs::create_directories(folder_ / "runs");
    Lock lock(folder_ / ".lock");
    require(lock.held(), folder_.string() +
                             " is in use by another hemowalk (it holds the folder's lock) wait for it, or "
                             "choose another --out");
    plan_ = make_plan(campaign_);  // again, now that nobody else can change the folder
    for (const auto& w : plan_.warnings) warn(w);
    if (fs::exists(folder_ / "results.json"))
      previous_ = Json::parse(read_file(folder_ / "results.json"), nullptr, false);
    if (!previous_.is_object()) previous_ = Json::object();
    write_file_atomic(folder_ / "campaign.yaml", campaign_.source_text);

    produce();
    stop_if_asked();
    if (!(campaign_.on_failure.action == OnFailureAction::abort && summary_.failed)) {
      analyse();
      walk();
    }
    write();
    require(trouble_.empty(), trouble_);  // said last: the report shows what could be done
    summary_.wall = seconds();
    return summary_;
  }

 private:
  double seconds() const { return std::chrono::duration<double>(clock::now() - start_).count(); }
  void warn(const std::string& text) {
    log_warning(text);
    summary_.warnings.push_back(text);
  }

  /// Trajectories of all runs: scenes in child processes, everything else here.
  void produce() {
    std::vector<Job> jobs;
    for (const auto& run : plan_.runs) {
      if (run.action == PlannedRun::Action::cached) {
        ++summary_.cached;
        continue;
      }
      fs::create_directories(run.folder);
      Status status = read_status(run.folder).value_or(Status{});
      status.state = State::queued, status.exit_code.reset(), status.reason = run.reason;
      if (run.scene) {
        write_file_atomic(run.folder + "/scene.yaml", run.input);
        write_status(run.folder, status);
        jobs.push_back({run.folder, run.title, std::isfinite(run.cost.wall) ? run.cost.wall : 1});
      } else {
        make_trajectories(campaign_.sources[run.source], run.folder);
      }
    }
    if (summary_.cached)
      log_info(fmt::format("{} of {} runs are done already", summary_.cached, plan_.runs.size()));
    LaunchOptions launch;
    launch.slots = campaign_.launcher.slots;
    launch.ranks = campaign_.launcher.ranks;
    launch.threads = campaign_.launcher.threads;
    launch.on_failure = static_cast<OnFailure>(campaign_.on_failure.action);
    launch.attempts = campaign_.on_failure.attempts;
    run_jobs(jobs, launch);
    summary_.runs = static_cast<int>(plan_.runs.size());
    for (const auto& run : plan_.runs) {
      const auto status = read_status(run.folder).value_or(Status{});
      summary_.done += status.state == State::done;
      summary_.failed += status.state == State::failed || status.state == State::timed_out;
    }
  }

  std::vector<const PlannedRun*> finished_runs(const Point& point) const {
    std::vector<const PlannedRun*> result;
    for (const auto r : point.runs) {
      const auto status = read_status(plan_.runs[r].folder);
      if (status && status->state == State::done) result.push_back(&plan_.runs[r]);
    }
    return result;
  }

  /// The law of a point; the first point's is the campaign's.
  std::string law_file(const Point& point) const {
    return &point == &plan_.points.front() ? "transport_law.yaml" : "laws/" + point.slug + ".yaml";
  }

  void analyse() {
    points_ = Json::array();
    for (const auto& point : plan_.points) {
      stop_if_asked();
      const auto runs = finished_runs(point);
      if (runs.empty()) continue;
      std::string inputs = version() + commit() + campaign_.calibrate_text() + point.label;
      for (const auto* run : runs) inputs += run->hash;
      const std::string key = sha256(inputs);
      Json entry = reusable(previous_, "points", key);
      if (entry.is_null() || !fs::exists(folder_ / law_file(point))) {
        entry = analyse_point(point, runs);
        entry["key"] = key;
      }
      for (const auto& [kind, c] : entry["calibrations"].items()) tell(point, kind, c);
      points_.push_back(entry);
      save();
    }
    compare_points();
  }

  /// What the laws of all points say together, where their conditions differ.
  void compare_points() {
    std::vector<data::TransportLaw> laws;
    for (const auto& entry : points_)
      if (entry.contains("law_file"))
        laws.push_back(data::read_transport_law(folder_ / entry["law_file"].get<std::string>()));
    if (laws.size() < 2) return;
    const auto fit = calibration::fit_conditions(laws);
    if (fit.trends.empty()) return;
    const std::string text = calibration::conditions_json(fit, laws);
    write_file_atomic(folder_ / "law_over_conditions.json", text);
    over_conditions_ = Json::parse(text);
    for (const auto& h : fit.hypotheses)
      if (h.outcome != "not tested") summary_.headlines.push_back(h.statement);
  }

  /// The result for the terminal, and the gate for the exit code.
  void tell(const Point& point, const std::string& kind, const Json& c) {
    const bool passed = c["gate"].value("passed", true);
    summary_.gate_passed = summary_.gate_passed && passed;
    const auto& D = c["core"]["D_m2_per_s"];
    const auto& sigma = c["core"]["D_sigma"];
    if (!D.is_number() || !sigma.is_number()) return;
    summary_.headlines.push_back(fmt::format("{}: D of {} = ({:.3f} +- {:.3f})e-10 m2/s{}", point.label, kind,
                                             D.get<double>() * 1e10, sigma.get<double>() * 1e10,
                                             passed ? "" : "   ARTEFACT GATE FAILED"));
  }

  Json analyse_point(const Point& point, const std::vector<const PlannedRun*>& planned) {
    log_info("calibrating " + point.label);
    std::vector<data::Trajectories> runs;
    for (const auto* run : planned) runs.push_back(data::read_trajectories(run->folder + "/trajectories.h5"));
    const double t0 = campaign_.calibrate.t0;
    Json entry;
    entry["label"] = point.label;
    entry["slug"] = point.slug;
    entry["settings"] = point.settings;
    for (const auto* run : planned) entry["runs"].push_back(run->hash);
    entry["source"] = {{"text", source_text(*planned.front())}};
    entry["conditions"] = conditions_json(runs.front());
    entry["cells"] = cells_json(runs.front());
    entry["record"] = record_json(runs, main_kind(runs.front()), t0);
    if (!planned.front()->scene)
      if (auto truth = truth_json(campaign_.sources[planned.front()->source]); !truth.is_null())
        entry["truth"] = truth;
    entry["warnings"] = Json::array();
    calibrate_kinds(point, runs, entry);
    if (auto blood = blood_json(runs, t0); !blood.is_null()) entry["blood"] = blood;
    if (auto diagnostics = diagnostics_json(runs.front()); !diagnostics.is_null())
      entry["diagnostics"] = diagnostics;
    return entry;
  }

  std::string source_text(const PlannedRun& run) const {
    return run.scene ? "resolved by hemowalk " + version() : describe(campaign_.sources[run.source]);
  }

  /// The kind of cell whose law goes on to the walks.
  std::string main_kind(const data::Trajectories& run) const {
    return run.kinds.count(campaign_.calibrate.kind) || run.kinds.empty() ? campaign_.calibrate.kind
                                                                          : run.kinds.begin()->first;
  }

  /// Every kind of cell that was tracked; the platelets' law (or that of the only kind) goes on to the walks.
  void calibrate_kinds(const Point& point, const std::vector<data::Trajectories>& runs, Json& entry) {
    entry["calibrations"] = Json::object();
    const std::string first = main_kind(runs.front());
    for (const auto& [kind, tracks] : runs.front().kinds) {
      calibration::Options options = campaign_.calibrate;
      options.kind = kind;
      options.walk = coarse_walk();
      try {
        auto result = calibration::calibrate(runs, options);
        if (kind == first) {
          result.law_file = law_file(point);
          data::write_transport_law(result.law, folder_ / law_file(point));
          entry["law_file"] = law_file(point);
          entry["law_yaml"] = read_file(folder_ / law_file(point));
        }
        entry["calibrations"][kind] = calibration_json(result);
      } catch (const InputError& error) {
        const std::string text = kind + " is not calibrated: " + error.what();
        entry["warnings"].push_back(text);
        if (kind != first) continue;
        fs::remove(folder_ / law_file(point));  // an older one would pass for this one's
        if (trouble_.empty()) trouble_ = point.label + ": " + text;
      }
    }
    if (runs.size() < 3)
      entry["warnings"].push_back(fmt::format(
          "{} independent run{}: cells of one box share its flow, a published interval needs three or more",
          runs.size(), runs.size() == 1 ? "" : "s"));
  }

  /// Each case with each point's law; a case with its own D once.
  void walk() {
    walks_ = Json::array();
    for (const auto& the_case : campaign_.coarse)
      for (const auto& point : plan_.points) {
        if (!fs::exists(folder_ / law_file(point))) continue;
        stop_if_asked();
        const bool own_law = the_case.constant_D || !the_case.law_file.empty();
        const auto law = the_case.constant_D          ? data::TransportLaw::constant(*the_case.constant_D)
                         : !the_case.law_file.empty() ? data::read_transport_law(the_case.law_file)
                                                      : data::read_transport_law(folder_ / law_file(point));
        const std::string law_text =
            the_case.constant_D
                ? std::to_string(*the_case.constant_D)
                : read_file(own_law ? the_case.law_file : (folder_ / law_file(point)).string());
        const std::string file = "coarse/" + the_case.name +
                                 (own_law || &point == &plan_.points.front() ? "" : "-" + point.slug) + ".h5";
        const std::string key =
            sha256(version() + commit() + the_case.input_sha256 + sha256(law_text) + file);
        Json entry = reusable(previous_, "coarse", key);
        if (entry.is_null() || !fs::exists(folder_ / file)) {
          entry = walk_case(the_case, law, file);
          entry["point"] = own_law ? "" : point.label;
          entry["key"] = key;
        }
        walks_.push_back(entry);
        save();
        if (own_law) break;
      }
  }

  Json walk_case(const coarse::Case& the_case, const data::TransportLaw& law, const std::string& file) {
    Progress progress("walk " + the_case.name);
    coarse::RunOptions options;
    options.strict = options_.strict;
    options.progress = [&](double fraction) {
      progress.update(fraction);
      stop_if_asked();
    };
    const auto result = coarse::run(the_case, law, options);
    coarse::write_result(result, the_case, folder_ / file);
    Json entry = coarse_json(result, the_case, law);
    entry["file"] = file;
    return entry;
  }

  Json results() const {
    Json json = json_head("results", campaign_.input_sha256, campaign_.seed(), summary_.warnings);
    json["name"] = campaign_.name;
    json["title"] = campaign_.title();
    json["command"] = options_.command;
    json["written"] = fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr)));
    json["machine"] = {{"threads", std::thread::hardware_concurrency()}};
    json["program"] = program_description();
    json["wall_s"] = seconds();
    json["runs"] = Json::array();
    for (const auto& run : plan_.runs) {
      const auto status = read_status(run.folder).value_or(Status{});
      Json entry{{"hash", run.hash},
                 {"point", plan_.points[run.point].label},
                 {"seed", run.seed},
                 {"state", to_string(status.state)}};
      entry["exit_code"] = status.exit_code ? Json(*status.exit_code) : Json(nullptr);
      entry["reason"] = status.reason, entry["attempt"] = status.attempt, entry["steps"] = status.steps,
      entry["wall_s"] = finite(status.wall);
      json["runs"].push_back(entry);
    }
    json["points"] = points_;
    if (!over_conditions_.is_null()) json["over_conditions"] = over_conditions_;
    json["coarse"] = walks_;
    json["campaign_yaml"] = campaign_.source_text;
    return json;
  }

  /// Keeps what is known so far: the next call starts from here even after a kill.
  void save() const {
    Json json = results();
    // Not yet visited entries of the previous call stay until they are replaced.
    for (const char* list : {"points", "coarse"})
      if (previous_.contains(list))
        for (const auto& entry : previous_[list])
          if (reusable(json, list, entry.value("key", "")).is_null() && !final_) json[list].push_back(entry);
    write_file_atomic(folder_ / "results.json", json.dump(1, ' ', false, Json::error_handler_t::replace));
  }

  void write() {
    final_ = true;
    save();
    summary_.results_file = (folder_ / "results.json").string();
    summary_.report_file = (folder_ / "report.html").string();
    write_file_atomic(summary_.report_file, render_report(results()));
  }

  const Campaign& campaign_;
  const PipelineOptions& options_;
  clock::time_point start_;
  Plan plan_;
  fs::path folder_;
  PipelineSummary summary_;
  Json previous_ = Json::object(), points_ = Json::array(), walks_ = Json::array(), over_conditions_;
  bool final_ = false;
  std::string trouble_;  ///< the first point whose main kind could not be calibrated
};

}  // namespace

PipelineSummary run_pipeline(const Campaign& campaign, const PipelineOptions& options) {
  return Pipeline(campaign, options).execute();
}

}  // namespace hemowalk::workflow
