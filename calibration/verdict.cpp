#include "calibration/verdict.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.hpp"
#include "core/text.hpp"

namespace hemowalk::calibration {
namespace {

std::vector<double> range(const YAML::Node& n) {
  return n ? n.as<std::vector<double>>() : std::vector<double>{};
}
std::optional<double> value(const YAML::Node& n) { return n ? std::optional(n.as<double>()) : std::nullopt; }

Source read_source(const YAML::Node& n) {
  Source s;
  s.id = n["id"].as<std::string>();
  for (auto [key, member] : {std::pair{"citation", &Source::citation},
                             {"particle", &Source::particle},
                             {"kind", &Source::kind},
                             {"direction", &Source::direction},
                             {"method", &Source::method},
                             {"checked", &Source::checked}})
    s.*member = n[key].as<std::string>();
  s.note = n["note"].as<std::string>("");
  s.shear_rate = range(n["shear_rate"]);
  s.hematocrit = range(n["hematocrit"]);
  s.D = value(n["D"]);
  s.low = value(n["low"]);
  s.high = value(n["high"]);
  s.same_tracks = n["same_tracks"].as<bool>(false);
  if (const auto f = n["formula"])
    s.formula = Formula{f["prefactor"].as<double>(), f["exponent"].as<double>(), f["phi_power"].as<double>(1),
                        range(f["radius_m"])};
  require(s.D.has_value() != s.formula.has_value(),
          "literature source " + s.id +
              " has neither or both of D and formula (one of them is needed) repair the file");
  return s;
}

/// Which conditions differ, in words; empty when they match.
std::string mismatch(const Source& s, const Ours& o) {
  std::string why;
  const auto add = [&](const std::string& x) { why += (why.empty() ? "" : ", ") + x; };
  if (s.direction != "wall-normal") add(s.direction + " instead of wall-normal");
  if (!s.formula) {
    if (s.shear_rate.size() != 2)
      add("shear rate not stated");
    else if (!(o.shear_rate >= 0.75 * s.shear_rate[0] && o.shear_rate <= 1.25 * s.shear_rate[1]))
      add(formatted("shear %g .. %g 1/s", s.shear_rate[0], s.shear_rate[1]));
    if (s.hematocrit.size() != 2)
      add("hematocrit not stated");
    else if (!(o.hematocrit >= s.hematocrit[0] - 0.05 && o.hematocrit <= s.hematocrit[1] + 0.05))
      add(formatted("hematocrit %g .. %g", s.hematocrit[0], s.hematocrit[1]));
  }
  return why;
}

/// The sentence: never just "validated".
std::string sentence(const Source& s, const Ours& o, const Verdict& v, const std::string& differs) {
  std::string out = formatted("%s (%s): %.3g m2/s", s.id.c_str(), s.kind.c_str(), v.D);
  if (v.D_hi > v.D_lo) out += formatted(" (%.2g .. %.2g)", v.D_lo, v.D_hi);
  out += formatted(", ours %.3g is %.2g times that", o.D, o.D / v.D);
  if (std::isfinite(v.z))
    out += formatted(", %.1f combined standard errors %s: %s", std::abs(v.z), v.z >= 0 ? "above" : "below",
                     std::abs(v.z) <= 2 ? "not distinguishable" : "they disagree");
  else
    out += "; it states no error, so the distance cannot be put in standard errors";
  out +=
      differs.empty() ? "; conditions match" : "; conditions differ (" + differs + "), for orientation only";
  if (s.same_tracks && o.imported)
    out += "; the same trajectories, so a check of the program and not of the physics";
  if (s.checked.find("memory") != std::string::npos)
    out += "; source not verified (" + s.checked + ")";
  else if (s.checked.find("abstract") != std::string::npos)
    out += "; source known by its abstract only (" + s.checked + ")";
  if (!o.gate_passed) out += "; our run fails the artefact gate";
  return out;
}

}  // namespace

double Formula::operator()(double radius, double shear_rate, double hematocrit) const {
  return prefactor * radius * radius * shear_rate * std::pow(hematocrit, phi_power) *
         std::pow(1 - hematocrit, exponent);
}

std::vector<Source> read_literature(const std::string& content) {
  try {
    const YAML::Node root = YAML::Load(content);
    require(root["format"] && root["format"].as<std::string>() == "hemowalk.literature/1",
            "literature file is not of format hemowalk.literature/1 (other file or version) use the one of "
            "this program");
    std::vector<Source> all;
    for (const auto& n : root["sources"]) all.push_back(read_source(n));
    return all;
  } catch (const YAML::Exception& e) {
    throw InputError(std::string("literature file cannot be read (") + e.what() + ") repair it");
  }
}

std::vector<Verdict> compare_with_literature(const Ours& ours, const std::vector<Source>& sources) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<Verdict> all;
  for (const Source& s : sources) {
    // The formulas proper are about what red cells do.
    const bool any_particle = s.kind == "formula" && ours.particle == "rbc";
    if ((s.particle == "rbc") != (ours.particle == "rbc") && !any_particle) continue;
    Verdict v;
    v.source = s.id;
    v.D_lo = s.low.value_or(nan);
    v.D_hi = s.high.value_or(nan);
    if (s.formula) {
      std::vector<double> values;
      for (double a : s.formula->radii) values.push_back((*s.formula)(a, ours.shear_rate, ours.hematocrit));
      if (values.empty() || !std::isfinite(values.front())) continue;  // our conditions are not known
      v.D_lo = *std::min_element(values.begin(), values.end());
      v.D_hi = *std::max_element(values.begin(), values.end());
      v.D = (v.D_lo + v.D_hi) / 2;
    } else {
      v.D = *s.D;
    }
    const bool has_error = v.D_hi > v.D_lo;
    v.z = has_error ? (ours.D - v.D) / std::hypot(ours.sigma, (v.D_hi - v.D_lo) / 2) : nan;
    std::string differs = mismatch(s, ours);
    if (s.particle != ours.particle && !any_particle) differs += (differs.empty() ? "" : ", ") + s.particle;
    v.matched_conditions = differs.empty();
    v.statement = sentence(s, ours, v, differs);
    all.push_back(v);
  }
  return all;
}

}  // namespace hemowalk::calibration
