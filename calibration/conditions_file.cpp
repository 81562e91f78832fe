/// \file The law over conditions as a file, and the transport law it gives at one condition.

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "calibration/conditions.hpp"
#include "core/check.hpp"
#include "core/provenance.hpp"
#include "core/random.hpp"
#include "core/text.hpp"
#include "core/units.hpp"

namespace hemowalk::calibration {
namespace {

using Conditions = data::TransportLaw::Conditions;
using Laws = std::vector<data::TransportLaw>;
using Json = nlohmann::ordered_json;

constexpr double margin = 0.02;  // of a scale: conditions this near to a calibrated one count as the same

/// What the calibrations span of one condition; shear rate and hematocrit as far as each of them vouches for.
std::array<double, 2> span_of(const ConditionFit& fit, const Laws& laws, double Conditions::*member) {
  if (member == &Conditions::shear_rate) return fit.valid.shear_rate;
  if (member == &Conditions::hematocrit) return fit.valid.hematocrit;
  std::array<double, 2> span{std::numeric_limits<double>::max(), -std::numeric_limits<double>::max()};
  for (const auto& l : laws) {
    if (!std::isfinite(l.conditions.*member)) continue;
    span = {std::min(span[0], l.conditions.*member * (1 - margin)),
            std::max(span[1], l.conditions.*member * (1 + margin))};
  }
  return span;
}

/// \p at with what is not asked filled in: the centre of what varies, the common value of what does not.
Conditions completed(const ConditionFit& fit, const Laws& laws, Conditions at) {
  for (const Regressor& r : regressors()) {
    const auto span = span_of(fit, laws, r.member);
    double& x = at.*r.member;
    if (std::isfinite(x)) {
      if (span[0] <= x && x <= span[1]) continue;
      const bool known = span[0] <= span[1];
      throw Refused(r.name + " is asked at " + formatted("%.4g", x) +
                    (known ? formatted(" (the calibrations span %.4g to %.4g", span[0], span[1])
                           : std::string(" (it is not known in the calibrations")) +
                    "; beyond them the law is a guess) calibrate a run there");
    }
    const auto t = std::find_if(fit.trends.begin(), fit.trends.end(),
                                [&](const Trend& trend) { return trend.name == r.name; });
    x = t != fit.trends.end() ? r.backward(t->centre) : laws.front().conditions.*r.member;
  }
  at.Re = std::numeric_limits<double>::quiet_NaN();
  for (const auto& l : laws)
    if (l.conditions.shear_rate > 0 && std::isfinite(l.conditions.Re)) {
      at.Re = l.conditions.Re * at.shear_rate / l.conditions.shear_rate;
      break;
    }
  return at;
}

const data::TransportLaw& nearest(const ConditionFit& fit, const Laws& laws, const Conditions& at) {
  const auto distance = [&](const data::TransportLaw& l) {
    double sum = 0;
    for (const Trend& t : fit.trends)
      for (const Regressor& r : regressors())
        if (r.name == t.name)
          sum += std::pow(
              (r.forward(l.conditions.*r.member) - r.forward(at.*r.member)) / (t.range[1] - t.range[0]), 2);
    return sum;
  };
  return *std::min_element(laws.begin(), laws.end(),
                           [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
}

double interpolate(const std::vector<double>& y, const std::vector<double>& f, double at) {
  const auto above = std::upper_bound(y.begin(), y.end(), at);
  if (above == y.begin()) return f.front();
  if (above == y.end()) return f.back();
  const auto k = static_cast<std::size_t>(above - y.begin());
  const double s = (at - y[k - 1]) / (y[k] - y[k - 1]);
  return (1 - s) * f[k - 1] + s * f[k];
}

/// Mean of a profile over a layer.
double layer_mean(const std::vector<double>& y, const std::vector<double>& f,
                  const std::array<double, 2>& layer) {
  constexpr int n = 128;
  double sum = 0;
  for (int k = 0; k < n; ++k) sum += interpolate(y, f, layer[0] + (layer[1] - layer[0]) * (k + 0.5) / n) / n;
  return sum;
}

/// A profile carried to another gap: every distance to the nearer wall is kept. A wider gap gets a middle
/// that is as the old middle (drift: none there), a narrower one loses it.
void carry_profile(data::TransportLaw& law, const data::TransportLaw::Profile& from, double gap) {
  auto& to = law.profile;
  to = {};
  if (from.y.empty()) return;
  if (!std::isfinite(gap)) gap = from.y.back() - from.y.front();
  const std::size_t n = from.y.size();
  const double low = from.y.front(), high = from.y.back(), half = (high - low) / 2;
  const auto carried = [&](const std::vector<double>& f, bool drift) {
    std::vector<double> out;
    for (double y : to.y) {
      const double below = y - low, above = low + gap - y, d = std::min(below, above);
      out.push_back(
          drift && d > half
              ? 0
              : interpolate(from.y, f, below <= above ? low + std::min(d, half) : high - std::min(d, half)));
    }
    return out;
  };
  for (std::size_t k = 0; k < n; ++k)
    to.y.push_back(low + gap * static_cast<double>(k) / static_cast<double>(n - 1));
  to.D = carried(from.D, false);
  to.v = carried(from.v, true);
  for (const auto& d : from.D_draws) to.D_draws.push_back(carried(d, false));
  for (const auto& v : from.v_draws) to.v_draws.push_back(carried(v, true));
  const double shrink = high - (low + gap);
  law.core.y_range[1] -= shrink;
  if (law.core.y_range[1] <= law.core.y_range[0]) law.core.y_range = {low + gap / 4, low + 3 * gap / 4};
}

void multiply(std::vector<double>& x, double factor) {
  for (double& v : x) v *= factor;
}

Json number(double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); }

}  // namespace

data::TransportLaw law_at(const ConditionFit& fit, const Laws& laws, const Conditions& asked) {
  const Conditions at = completed(fit, laws, asked);
  Predicted p = predict(fit, at);
  const bool fitted_shear = std::any_of(fit.trends.begin(), fit.trends.end(),
                                        [](const Trend& t) { return t.name == "ln shear rate"; });
  if (!fitted_shear && std::isfinite(at.shear_rate)) {
    const double step = std::log(at.shear_rate / laws.front().conditions.shear_rate);
    p.log_D += fit.shear_exponent * step;
    if (step != 0) p.sigma = std::hypot(p.sigma, fit.shear_exponent_sigma * step);
  }
  if (!std::isfinite(p.log_D) || !std::isfinite(p.sigma))
    throw Refused(
        "no D with an error can be given there (a calibration does not state its shear rate, or its "
        "exponent's "
        "error) complete the conditions of the laws");
  data::TransportLaw law = nearest(fit, laws, at);
  const auto source = law.profile;
  law.conditions = at;
  law.core.D = std::exp(p.log_D);
  law.core.D_sigma = p.sigma * law.core.D;
  const auto layer = law.core.y_range;
  carry_profile(law, source, at.gap);
  if (!source.y.empty()) {
    // Shape from the nearest calibration, level from the regression; the draws scatter by the error of both.
    const double factor = law.core.D / layer_mean(source.y, source.D, layer);
    multiply(law.profile.D, factor);
    multiply(law.profile.v, factor);
    for (std::size_t b = 0; b < source.D_draws.size(); ++b) {
      RandomSequence random(law.provenance.seed, Stream::law_draw, b);
      const double level =
          law.core.D * std::exp(p.sigma * random.normal()) / layer_mean(source.y, source.D_draws[b], layer);
      multiply(law.profile.D_draws[b], level);
      multiply(law.profile.v_draws[b], level);
    }
  }
  law.scaling = {fit.shear_exponent, fit.shear_exponent_sigma};
  law.valid = fit.valid;
  law.gate = {};
  law.provenance.inputs_sha256.clear();
  for (const auto& l : laws) {
    law.gate.passed = law.gate.passed && l.gate.passed;
    for (const auto& f : l.gate.findings)
      if (!f.passed) law.gate.findings.push_back(f);
    for (const auto& hash : l.provenance.inputs_sha256)
      if (std::find(law.provenance.inputs_sha256.begin(), law.provenance.inputs_sha256.end(), hash) ==
          law.provenance.inputs_sha256.end())
        law.provenance.inputs_sha256.push_back(hash);
  }
  law.provenance.version = version();
  return law;
}

std::string conditions_json(const ConditionFit& fit, const Laws& laws) {
  Json j;
  j["format"] = "hemowalk.law_over_conditions/1";
  j["version"] = version();
  j["quantity"] = "ln D, D in m2/s, linear in the terms; D/(gamma r^2) with r = 4 um is `D_scaled`";
  j["D_at_centre_m2_per_s"] = number(fit.D_centre);
  j["ln_D_at_centre_sigma"] = number(std::sqrt(fit.covariance[0][0]));
  j["scatter_ln_D"] = number(fit.scatter);
  j["terms"] = Json::array();
  for (const Trend& t : fit.trends)
    j["terms"].push_back({{"name", t.name},
                          {"coefficient", number(t.coefficient)},
                          {"sigma", number(t.sigma)},
                          {"centre", number(t.centre)},
                          {"valid", {number(t.range[0]), number(t.range[1])}},
                          {"claimed", t.claimed},
                          {"statement", t.statement}});
  j["covariance"] = fit.covariance;
  j["chi_squared"] = number(fit.chi_squared);
  j["degrees_of_freedom"] = fit.degrees_of_freedom;
  j["scaling"] = {{"shear_exponent", number(fit.shear_exponent)},
                  {"sigma", number(fit.shear_exponent_sigma)}};
  j["left_out"] = fit.left_out;
  j["hypotheses"] = Json::array();
  for (const Hypothesis& h : fit.hypotheses)
    j["hypotheses"].push_back({{"claim", h.claim}, {"outcome", h.outcome}, {"statement", h.statement}});
  j["valid"] = {{"shear_rate_1_per_s", {number(fit.valid.shear_rate[0]), number(fit.valid.shear_rate[1])}},
                {"hematocrit", {number(fit.valid.hematocrit[0]), number(fit.valid.hematocrit[1])}},
                {"dt_min_s", number(fit.valid.dt_min)}};
  j["calibrations"] = Json::array();
  for (std::size_t k = 0; k < laws.size(); ++k) {
    const Conditions& c = laws[k].conditions;
    j["calibrations"].push_back({{"shear_rate_1_per_s", number(c.shear_rate)},
                                 {"hematocrit", number(c.hematocrit)},
                                 {"gap_m", number(c.gap)},
                                 {"kappa_damping", number(c.kappa_damping)},
                                 {"t_c_s", number(c.t_c)},
                                 {"Ca", number(c.Ca)},
                                 {"Re", number(c.Re)},
                                 {"cell_free_layer_m", number(laws[k].cell_free_layer)},
                                 {"D_m2_per_s", number(laws[k].core.D)},
                                 {"D_sigma", number(laws[k].core.D_sigma)},
                                 {"D_scaled", number(fit.scaled[k][0])},
                                 {"D_scaled_sigma", number(fit.scaled[k][1])},
                                 {"gate_passed", laws[k].gate.passed}});
  }
  j["warnings"] = fit.warnings;
  return j.dump(2);
}

}  // namespace hemowalk::calibration
