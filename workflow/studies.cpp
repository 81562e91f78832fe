#include "workflow/studies.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <limits>
#include <set>

#include "core/check.hpp"
#include "core/io.hpp"
#include "core/provenance.hpp"
#include "core/units.hpp"
#include "workflow/command.hpp"

namespace hemowalk::workflow {
namespace {

namespace fs = std::filesystem;
using Conditions = data::TransportLaw::Conditions;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The laws of one campaign folder: the first point's is transport_law.yaml, the others lie in laws/.
std::vector<fs::path> laws_in(const fs::path& folder) {
  std::vector<fs::path> files;
  if (fs::exists(folder / "transport_law.yaml")) files.push_back(folder / "transport_law.yaml");
  if (fs::is_directory(folder / "laws"))
    for (const auto& entry : fs::directory_iterator(folder / "laws"))
      if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

struct Known {
  const char* name;
  double Conditions::*member;
  const char *unit, *suggested;  ///< nullptr: a bare number
};
constexpr Known known_conditions[] = {{"shear_rate", &Conditions::shear_rate, "1/s", "1/s"},
                                      {"hematocrit", &Conditions::hematocrit, nullptr, nullptr},
                                      {"gap", &Conditions::gap, "m", "um"},
                                      {"kappa_damping", &Conditions::kappa_damping, nullptr, nullptr},
                                      {"t_c", &Conditions::t_c, "s", "ms"},
                                      {"Ca", &Conditions::Ca, nullptr, nullptr}};

double bare_number(const std::string& text, const std::string& what) {
  std::size_t used = 0;
  double value = nan;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
  }
  require(used == text.size() && std::isfinite(value),
          what + " `" + text + "` is no number (a bare one is expected) write it like 0.4");
  return value;
}

}  // namespace

std::vector<double> errors_asked(const std::string& text) {
  if (text.empty()) return {0.2, 0.1, 0.05, 0.02};
  const bool percent = text.back() == '%';
  const double value = bare_number(percent ? text.substr(0, text.size() - 1) : text, "--plan");
  const double error = percent ? value / 100 : value;
  require(error > 0 && error < 1,
          "--plan `" + text + "` is no relative error (it lies between 0 and 1) write it like 5% or 0.05");
  return {error};
}

Json plans_json(const std::vector<double>& errors, const calibration::PlanInput& input) {
  Json all = Json::array();
  for (const double error : errors) {
    const auto p = calibration::plan_for(error, input);
    all.push_back({{"relative_error", p.relative_error},
                   {"platelet_seconds", p.platelet_seconds},
                   {"runs", p.runs},
                   {"platelets_per_run", input.platelets},
                   {"run_time_s", input.run_time},
                   {"t0_s", input.t0},
                   {"shear_rate_1_per_s", input.shear_rate},
                   {"platelets_single_origin", p.platelets_single_origin},
                   {"note", p.note}});
  }
  return all;
}

std::string plans_table(const std::vector<double>& errors, const calibration::PlanInput& input) {
  std::string out = fmt::format("{:>8}{:>20}{:>8}{:>36}\n", "error", "platelet-seconds", "runs",
                                "platelets for the single-origin line");
  for (const double error : errors) {
    const auto p = calibration::plan_for(error, input);
    out += fmt::format("{:>6.1f} %{:>20.3g}{:>8}{:>36}\n", 100 * error, p.platelet_seconds, p.runs,
                       p.platelets_single_origin);
    if (error == errors.back())
      out += fmt::format(
          "\n{}. Runs of {} cells, {:.3g} s each from {:.3g} s on, at {:.4g} 1/s; never fewer than three "
          "(cells of one box share its flow).\n",
          p.note, input.platelets, input.run_time, input.t0, input.shear_rate);
  }
  return out;
}

std::vector<data::TransportLaw> read_laws(const std::vector<std::string>& paths) {
  std::vector<data::TransportLaw> laws;
  std::set<std::string> seen;
  for (const auto& path : paths) {
    const auto files = fs::is_directory(path) ? laws_in(path) : std::vector<fs::path>{path};
    require(!files.empty(),
            path + " holds no transport law (transport_law.yaml or laws/*.yaml) calibrate it first");
    for (const auto& file : files) {
      const std::string text = read_input_file(file.string());
      if (seen.insert(sha256(text)).second) laws.push_back(data::parse_transport_law(text, file.string()));
    }
  }
  return laws;
}

Conditions conditions_asked(const std::vector<std::string>& settings) {
  Conditions at{nan, nan, nan, nan, nan, nan, nan};
  for (const auto& setting : settings) {
    const auto equals = setting.find('=');
    const std::string name = setting.substr(0, equals);
    const auto found = std::find_if(std::begin(known_conditions), std::end(known_conditions),
                                    [&](const Known& k) { return name == k.name; });
    require(equals != std::string::npos && found != std::end(known_conditions), [&] {
      std::string names;
      for (const auto& k : known_conditions) names += (names.empty() ? "" : ", ") + std::string(k.name);
      return "--at `" + setting + "` names no condition (known: " + names +
             ") write it like 'shear_rate=150 1/s'";
    });
    const std::string value = setting.substr(equals + 1);
    at.*found->member = found->unit ? parse_quantity(value, found->unit, found->suggested)
                                    : bare_number(value, "--at " + name);
  }
  return at;
}

std::string conditions_table(const calibration::ConditionFit& fit) {
  std::string out = fmt::format("D at the mean conditions {:.4g} m2/s; D ~ shear rate^({:.2f} +- {:.2f})\n",
                                fit.D_centre, fit.shear_exponent, fit.shear_exponent_sigma);
  for (const auto& t : fit.trends) out += t.statement + "\n";
  for (const auto& text : fit.left_out) out += "left out: " + text + "\n";
  if (fit.degrees_of_freedom > 0)
    out += fmt::format("chi squared {:.2f} for {} degrees of freedom\n", fit.chi_squared,
                       fit.degrees_of_freedom);
  out += "\nstated before the data:\n";
  for (const auto& h : fit.hypotheses) out += h.statement + "\n";
  return out;
}

Json single_results(const std::vector<data::Trajectories>& runs, const calibration::Calibration& result,
                    double t0, const std::string& source, const std::string& command) {
  Json json = json_head("results", result.law.provenance.inputs_sha256.front(), result.law.provenance.seed);
  json["name"] = json["title"] = "Calibration of " + source;
  json["command"] = command;
  json["written"] = fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr)));
  json["program"] = program_description();
  json["wall_s"] = result.wall;
  Json point{{"label", source}, {"slug", "calibration"}, {"settings", Json::object()}};
  point["runs"] = Json::array();
  for (const auto& run : runs) point["runs"].push_back(run.input_sha256.substr(0, 12));
  point["source"] = {{"text", source}};
  point["conditions"] = conditions_json(runs.front());
  point["cells"] = cells_json(runs.front());
  point["record"] = record_json(runs, result.kind, t0);
  point["warnings"] = Json::array();
  point["calibrations"] = {{result.kind, calibration_json(result)}};
  if (auto blood = blood_json(runs, t0); !blood.is_null()) point["blood"] = blood;
  if (auto diagnostics = diagnostics_json(runs.front()); !diagnostics.is_null())
    point["diagnostics"] = diagnostics;
  json["points"] = Json::array({point});
  json["runs"] = json["coarse"] = Json::array();
  return json;
}

}  // namespace hemowalk::workflow
