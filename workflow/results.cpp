#include "workflow/results.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "workflow/command.hpp"

namespace hemowalk::workflow {

namespace {

/// At most about \p count entries of a series, evenly spaced: enough ink for a chart.
std::size_t stride_for(std::size_t size, std::size_t count) { return std::max<std::size_t>(1, size / count); }

/// Rows [P][Y] of one quantity, averaged over the times after t0 and over runs.
struct ProfileMean {
  std::vector<double> sum, weight;
  void add(const std::vector<double>& rows, const data::Profiles& p, double t0, std::size_t components,
           std::size_t component) {
    const std::size_t heights = p.y.size();
    if (rows.size() != p.time.size() * heights * components) return;
    sum.resize(heights), weight.resize(heights);
    for (std::size_t t = 0; t < p.time.size(); ++t)
      for (std::size_t y = 0; p.time[t] > t0 && y < heights; ++y) {
        const double v = rows[(t * heights + y) * components + component];
        if (!std::isfinite(v)) continue;
        sum[y] += v, weight[y] += 1;
      }
  }
  Json json() const {
    auto values = Json::array();
    for (std::size_t y = 0; y < sum.size(); ++y)
      values.push_back(weight[y] > 0 ? finite(sum[y] / weight[y]) : Json(nullptr));
    return values;
  }
};

/// Standard deviation of posterior draws at each height; empty without draws.
std::vector<double> spread_of(const std::vector<std::vector<double>>& draws, std::size_t heights) {
  if (draws.size() < 2) return {};
  std::vector<double> sigma(heights);
  const double n = static_cast<double>(draws.size());
  for (std::size_t y = 0; y < heights; ++y) {
    double mean = 0, square = 0;
    for (const auto& d : draws) mean += d.at(y) / n;
    for (const auto& d : draws) square += (d.at(y) - mean) * (d.at(y) - mean);
    sigma[y] = std::sqrt(square / (n - 1));
  }
  return sigma;
}

const char* name_of(coarse::Face::Type type) {
  switch (type) {
    case coarse::Face::Type::absorb:
      return "absorb";
    case coarse::Face::Type::robin:
      return "robin";
    case coarse::Face::Type::trap:
      return "trap";
    case coarse::Face::Type::periodic:
      return "periodic";
    default:
      return "reflect";
  }
}

/// The series where the faces only reflect and absorb. Where D varies it is a comparison, not the answer.
Json exact_json(const coarse::Case& the_case, const data::TransportLaw& law) {
  using Type = coarse::Face::Type;
  const auto absorbs = [](const coarse::Face& f) { return f.type == Type::absorb ? 1 : 0; };
  const auto plain = [](const coarse::Face& f) { return f.type == Type::absorb || f.type == Type::reflect; };
  const int faces = absorbs(the_case.bottom) + absorbs(the_case.top);
  const double D = the_case.constant_D.value_or(law.core.D);
  if (!faces || !plain(the_case.bottom) || !plain(the_case.top) || the_case.release || !(D > 0))
    return nullptr;
  Json exact;
  exact["D_m2_per_s"] = D;
  exact["same_problem"] = the_case.constant_D.has_value() || law.profile.y.empty();
  for (int i = 0; i <= 80; ++i) {
    const double t = the_case.end * i / 80;
    exact["time_s"].push_back(t);
    exact["absorbed_fraction"].push_back(absorbed_fraction(D, the_case.height, t, faces));
  }
  return exact;
}

}  // namespace

double absorbed_fraction(double D, double H, double t, int absorbing_faces) {
  const double h = absorbing_faces == 2 ? H / 2 : H, s = D * t / (h * h);
  // For short times the series converges slowly, and the half-space result is exact to exp(-1/s).
  if (s < 5e-3) return 2 * std::sqrt(s / std::numbers::pi);
  double remaining = 0;
  for (int k = 0; k < 60; ++k) {
    const double l = (k + 0.5) * std::numbers::pi;
    remaining += 2 / (l * l) * std::exp(-l * l * s);
  }
  return 1 - remaining;
}

Json conditions_json(const data::Trajectories& run) {
  Json json;
  json["box_m"] = finite(std::vector<double>(run.box.begin(), run.box.end()));
  json["gap_m"] = finite(run.walls_y[1] - run.walls_y[0]);
  json["shear_rate_1_per_s"] = finite(run.shear_rate);
  json["hematocrit"] = finite(run.hematocrit_true);
  json["kappa_damping"] = finite(run.kappa_damping);
  json["t_c_s"] = finite(run.t_c);
  json["Ca"] = finite(run.Ca);
  json["Re"] = finite(run.Re);
  json["acceleration"] = finite(run.acceleration);
  return json;
}

Json cells_json(const data::Trajectories& run) {
  auto json = Json::object();
  for (const auto& [kind, tracks] : run.kinds) json[kind] = tracks.cells();
  return json;
}

Json record_json(const std::vector<data::Trajectories>& runs, const std::string& kind, double t0) {
  const auto& first = runs.front();
  Json json;
  json["t0_s"] = t0;
  json["duration_s"] = first.time.back() - first.time.front();
  if (!first.kinds.count(kind)) return json;
  const std::size_t step = stride_for(first.time.size(), 250);
  for (std::size_t t = 0; t < first.time.size(); t += step) {
    double sum = 0;
    std::size_t count = 0;
    for (const auto& run : runs) {
      const auto found = run.kinds.find(kind);
      if (found == run.kinds.end() || t >= run.time.size()) continue;
      for (std::size_t n = 0; n < found->second.cells(); ++n, ++count) {
        const double dy = found->second.at(t, n, 1) - found->second.at(0, n, 1);
        sum += dy * dy;
      }
    }
    json["time_s"].push_back(first.time[t] - first.time.front());
    json["msd_m2"].push_back(count ? finite(sum / static_cast<double>(count)) : Json(nullptr));
  }
  return json;
}

Json blood_json(const std::vector<data::Trajectories>& runs, double t0) {
  const auto& first = runs.front();
  if (first.profile.y.empty() || first.profile.time.empty()) return nullptr;
  ProfileMean velocity, hematocrit, stress;
  for (const auto& run : runs) {
    if (run.profile.y.size() != first.profile.y.size()) continue;
    // A run shorter than the transient still shows its profiles: from its second half.
    const double from = run.profile.time.back() > t0 ? t0 : run.profile.time.back() / 2;
    velocity.add(run.profile.velocity, run.profile, from, 3, 2);
    hematocrit.add(run.profile.hematocrit, run.profile, from, 1, 0);
    stress.add(run.profile.shear_stress, run.profile, from, 1, 0);
  }
  Json json;
  json["y_m"] = finite(first.profile.y);
  json["velocity_z_m_per_s"] = velocity.json();
  json["hematocrit"] = hematocrit.json();
  json["shear_stress_pa"] = stress.json();
  json["shear_rate_1_per_s"] = finite(first.shear_rate);
  // The straight line between the walls, through the middle of the measured profile: right for any frame.
  const std::size_t heights = first.profile.y.size();
  const double gap = first.walls_y[1] - first.walls_y[0];
  double middle = 0;
  for (const auto& v : json["velocity_z_m_per_s"])
    middle += (v.is_number() ? v.get<double>() : 0) / static_cast<double>(heights);
  json["walls_y_m"] = finite(std::vector<double>{first.walls_y[0], first.walls_y[1]});
  json["wall_velocity_m_per_s"] =
      finite(std::vector<double>{middle - first.shear_rate * gap / 2, middle + first.shear_rate * gap / 2});
  if (first.profile.shear_stress.size() == first.profile.time.size() * heights)
    for (std::size_t t = 0; t < first.profile.time.size(); ++t) {
      double sum = 0;
      for (std::size_t y = 0; y < heights; ++y) sum += first.profile.shear_stress[t * heights + y];
      json["time_s"].push_back(first.profile.time[t]);
      json["mean_stress_pa"].push_back(finite(sum / static_cast<double>(heights)));
    }
  return json;
}

Json diagnostics_json(const data::Trajectories& run) {
  const auto& d = run.diagnostics;
  if (d.time.empty()) return nullptr;
  const std::size_t step = stride_for(d.time.size(), 300);
  Json json;
  const auto add = [&](const char* key, const std::vector<double>& values) {
    if (values.size() != d.time.size()) return;
    for (std::size_t t = 0; t < values.size(); t += step) json[key].push_back(finite(values[t]));
  };
  add("time_s", d.time);
  if (d.momentum_residual.size() == 3 * d.time.size())
    for (std::size_t t = 0; t < d.time.size(); t += step) {
      const double* r = &d.momentum_residual[3 * t];
      json["momentum_residual"].push_back(finite(std::hypot(r[0], r[1], r[2])));
    }
  add("energy_residual", d.energy_residual);
  add("mass_error", d.mass_error);
  add("volume_error_max", d.volume_error_max);
  add("max_speed_ratio", d.max_speed_ratio);
  add("overlap_max", d.overlap_max);
  add("slip_rms", d.slip_rms);
  return json;
}

Json calibration_json(const calibration::Calibration& result) {
  auto json = Json::parse(calibration::to_json(result));
  const auto& core = result.law.core;
  json["core"] = {{"D_m2_per_s", finite(core.D)},
                  {"D_sigma", finite(core.D_sigma)},
                  {"lag_s", finite(core.lag)},
                  {"y_range_m", finite(std::vector<double>(core.y_range.begin(), core.y_range.end()))}};
  const auto& law = result.law.profile;
  json["law_profile"] = {{"y_m", finite(law.y)},
                         {"D_m2_per_s", finite(law.D)},
                         {"sigma", finite(spread_of(law.D_draws, law.y.size()))},
                         {"v_m_per_s", finite(law.v)},
                         {"v_sigma", finite(spread_of(law.v_draws, law.y.size()))}};
  json["cell_free_layer_m"] = finite(result.law.cell_free_layer);
  return json;
}

Json coarse_json(const coarse::Result& result, const coarse::Case& the_case, const data::TransportLaw& law) {
  Json json;
  json["name"] = the_case.name;
  const auto contract = Json::parse(coarse::to_json(result, the_case));
  for (const auto& [key, value] : contract.items())
    if (key != "name") json[key] = value;
  json["case"] = {{"height_m", the_case.height},
                  {"bottom", name_of(the_case.bottom.type)},
                  {"top", name_of(the_case.top.type)},
                  {"dt_s", the_case.dt},
                  {"end_s", the_case.end},
                  {"shear_rate_1_per_s", the_case.shear_rate}};
  json["exact"] = exact_json(the_case, law);
  return json;
}

}  // namespace hemowalk::workflow
