/// \file The calibrate --json object of docs/reference.md.

#include <cmath>
#include <nlohmann/json.hpp>

#include "calibration/calibration.hpp"
#include "calibration/conditions.hpp"
#include "core/provenance.hpp"

namespace hemowalk::calibration {
namespace {

using Json = nlohmann::ordered_json;

/// Finite numbers only; unknown = null.
Json number(double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); }
template <class Container>
Json numbers(const Container& values) {
  Json a = Json::array();
  for (double v : values) a.push_back(number(v));
  return a;
}

Json estimators(const std::vector<Estimate>& all) {
  Json o = Json::object();
  for (const auto& e : all) {
    Json& j = o[e.name];
    j["D_m2_per_s"] = number(e.D);
    j["sigma"] = number(e.sigma);
    j["ci68"] = numbers(e.ci68);
    j["n"] = e.n;
    if (e.lag > 0) j["lag_s"] = number(e.lag);
    j["effective_samples"] = number(e.effective_samples);
    j["sigma_between_runs"] = number(e.sigma_between_runs);
    if (!e.note.empty()) j["note"] = e.note;
  }
  return o;
}

Json holdout(const Calibration::Holdout& h) {
  return {{"lag_s", numbers(h.lag)},
          {"msd_ratio", numbers(h.msd_ratio)},
          {"msd_sigma", numbers(h.msd_sigma)},
          {"histogram_p", numbers(h.histogram_p)},
          {"profile_lag_s", number(h.profile_lag)},
          {"profile_p", number(h.profile_p)}};
}

Json curves(const std::vector<MsdCurve>& all) {
  Json a = Json::array();
  for (const auto& c : all)
    a.push_back({{"layer", c.layer},
                 {"method", c.method},
                 {"lag_s", numbers(c.lag)},
                 {"msd_m2", numbers(c.msd)},
                 {"sigma_m2", numbers(c.sigma)},
                 {"fit",
                  {{"slope_m2_per_s", number(c.fit_slope)},
                   {"intercept_m2", number(c.fit_intercept)},
                   {"range_s", numbers(c.fit_range)}}}});
  return a;
}

Json profile(const Calibration::Profile& p) {
  return {{"y_m", numbers(p.y)},           {"D_m2_per_s", numbers(p.D)},
          {"sigma", numbers(p.sigma)},     {"v_m_per_s", numbers(p.v)},
          {"v_sigma", numbers(p.v_sigma)}, {"density_1_per_m", numbers(p.density)}};
}

Json step_choices(const std::vector<Calibration::StepChoice>& all) {
  Json a = Json::array();
  for (const auto& s : all)
    a.push_back({{"lag_s", number(s.lag)},
                 {"best", s.best},
                 {"persistent_gain_nats", number(s.persistent_gain)},
                 {"persistent_sigma", number(s.persistent_sigma)},
                 {"heavy_tail_gain_nats", number(s.heavy_tail_gain)},
                 {"heavy_tail_sigma", number(s.heavy_tail_sigma)}});
  return a;
}

Json gate(const data::TransportLaw::Gate& g) {
  Json findings = Json::array();
  for (const auto& f : g.findings)
    findings.push_back({{"name", f.name},
                        {"value", number(f.value)},
                        {"limit", number(f.limit)},
                        {"passed", f.passed},
                        {"note", f.note}});
  return {{"passed", g.passed}, {"findings", findings}};
}

Json verdicts(const std::vector<Verdict>& all) {
  Json a = Json::array();
  for (const auto& v : all)
    a.push_back({{"source", v.source},
                 {"matched_conditions", v.matched_conditions},
                 {"D_m2_per_s", number(v.D)},
                 {"D_lo", number(v.D_lo)},
                 {"D_hi", number(v.D_hi)},
                 {"z", number(v.z)},
                 {"statement", v.statement}});
  return a;
}

/// One hash for the inputs: the run's own, or the hash of all runs' hashes.
std::string input_hash(const std::vector<std::string>& inputs) {
  if (inputs.size() == 1) return inputs.front();
  std::string all;
  for (const auto& h : inputs) all += h;
  return sha256(all);
}

}  // namespace

std::string to_json(const Calibration& c) {
  const data::TransportLaw& law = c.law;
  Json j;
  j["format"] = "hemowalk.calibrate/1";
  j["version"] = law.provenance.version;
  j["input_sha256"] = input_hash(law.provenance.inputs_sha256);
  j["seed"] = law.provenance.seed;
  j["warnings"] = c.warnings;
  j["kind"] = c.kind;
  j["n_platelets"] = c.n_platelets;
  j["n_runs"] = c.n_runs;
  j["duration_s"] = number(c.duration);
  j["walls_y_m"] = numbers(c.walls_y);
  j["core_y_m"] = numbers(c.core);
  j["estimators"] = estimators(c.estimators);
  j["profile"] = profile(c.profile);
  j["profile_smooth"] = profile(c.smooth);
  j["kurtosis"] = {{"lag_s", numbers(c.kurtosis.lag)}, {"excess", numbers(c.kurtosis.excess)}};
  j["msd"] = curves(c.msd);
  j["gate"] = gate(law.gate);
  j["verdict"] = verdicts(c.verdict);
  j["holdout"] = holdout(c.holdout);
  if (!c.holdout_walk.lag.empty()) j["holdout_walk"] = holdout(c.holdout_walk);
  j["step_choices"] = step_choices(c.step_choices);
  j["residence"] = {{"zone_m", number(c.residence.zone)},
                    {"near_at_t0", c.residence.near_at_t0},
                    {"left_of_t0", c.residence.left_of_t0},
                    {"visits", c.residence.visits},
                    {"left", c.residence.left},
                    {"mean_time_s", number(c.residence.mean_time)},
                    {"mean_time_sigma", number(c.residence.mean_time_sigma)},
                    {"arrivals", c.residence.arrivals},
                    {"mean_time_out_s", number(c.residence.mean_time_out)},
                    {"mean_time_out_sigma", number(c.residence.mean_time_out_sigma)}};
  const double unit = law.conditions.shear_rate * red_cell_radius * red_cell_radius;
  j["law"] = {{"core_D_m2_per_s", number(law.core.D)},
              {"core_sigma", number(law.core.D_sigma)},
              {"D_over_gamma_r2", number(law.core.D / unit)},
              {"D_over_gamma_r2_sigma", number(law.core.D_sigma / unit)},
              {"core_estimator", c.core_estimator},
              {"core_reason", c.core_reason},
              {"memory_s", number(law.memory)},
              {"step_law", law.step_law.kind},
              {"step_reason", c.step_reason},
              {"dt_min_s", number(law.valid.dt_min)},
              {"cell_free_layer_m", number(law.cell_free_layer)},
              {"shear_exponent", number(law.scaling.shear_exponent)},
              {"shear_exponent_sigma", number(law.scaling.sigma)},
              {"shear_note", c.shear_note}};
  j["law_file"] = c.law_file.empty() ? Json(nullptr) : Json(c.law_file);
  j["wall_s"] = number(c.wall);
  return j.dump(2);
}

}  // namespace hemowalk::calibration
