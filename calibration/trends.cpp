#include "calibration/trends.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "calibration/gate.hpp"
#include "core/check.hpp"
#include "core/statistics.hpp"

namespace hemowalk::calibration {
namespace {

constexpr double red_cell_radius = 4e-6;  // m, the r of D/(gamma r^2)
constexpr double claim = 2;               // standard errors
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

template <class... Args>
std::string text(const char* format, Args... args) {
  char buffer[320];
  std::snprintf(buffer, sizeof buffer, format, args...);
  return buffer;
}

/// Local shear of the cells' mean velocity at bin centres inside the layer, by centred differences over two
/// bins.
struct LocalShear {
  std::vector<double> y, rate;
};
LocalShear local_shear(const Ensemble& e, const Layer& core) {
  const CellVelocity v = cell_velocity(e, 12);
  LocalShear s;
  for (std::size_t k = 1; k + 1 < v.y.size(); ++k) {
    const double rate = (v.along[k + 1] - v.along[k - 1]) / (v.y[k + 1] - v.y[k - 1]);
    if (!core.contains(v.y[k]) || !std::isfinite(rate) || rate <= 0) continue;
    s.y.push_back(v.y[k]);
    s.rate.push_back(rate);
  }
  return s;
}

double log_slope(const LocalShear& s, const LocalLaw& law) {
  std::vector<double> x, y;
  for (std::size_t k = 0; k < s.y.size(); ++k) {
    x.push_back(std::log(s.rate[k]));
    y.push_back(std::log(law.D(s.y[k])));
  }
  return fit_line(x, y).slope;
}

/// A quantity that may explain D, as it enters the regression.
struct Regressor {
  std::string name;
  std::function<double(const data::TransportLaw::Conditions&)> value;
};
const std::vector<Regressor>& regressors() {
  using C = data::TransportLaw::Conditions;
  static const std::vector<Regressor> all = {
      {"ln shear rate", [](const C& c) { return std::log(c.shear_rate); }},
      {"hematocrit", [](const C& c) { return c.hematocrit; }},
      // The drag per membrane area is proportional to kappa/(1 - kappa): the material's own number (method
      // note, 3).
      {"ln kappa/(1-kappa)", [](const C& c) { return std::log(c.kappa_damping / (1 - c.kappa_damping)); }},
      {"ln shape-recovery time", [](const C& c) { return std::log(c.t_c); }},
      {"ln capillary number", [](const C& c) { return std::log(c.Ca); }},
      {"ln gap", [](const C& c) { return std::log(c.gap); }},
  };
  return all;
}

/// Known in all calibrations, not the same in all, and not a copy of a regressor that is in already.
std::vector<Regressor> usable(const std::vector<data::TransportLaw>& laws,
                              std::vector<std::string>& left_out) {
  std::vector<Regressor> in;
  std::vector<Eigen::VectorXd> columns;
  for (const Regressor& r : regressors()) {
    Eigen::VectorXd x(static_cast<Eigen::Index>(laws.size()));
    for (std::size_t k = 0; k < laws.size(); ++k)
      x(static_cast<Eigen::Index>(k)) = r.value(laws[k].conditions);
    if (!x.allFinite()) continue;
    x.array() -= x.mean();
    if (x.norm() < 1e-3) continue;
    bool copy = false;
    for (const auto& c : columns) copy = copy || std::abs(c.dot(x)) > 0.999 * c.norm() * x.norm();
    if (copy || in.size() + 2 > laws.size()) {
      left_out.push_back(r.name + (copy ? " (varies together with another)" : " (too few calibrations)"));
      continue;
    }
    in.push_back(r);
    columns.push_back(x);
  }
  return in;
}

}  // namespace

ShearExponent shear_exponent(const Ensemble& e, const Layer& core, const LocalFit& fit) {
  ShearExponent out;
  if (!(e.shear_rate > 0)) return out;
  const LocalShear s = local_shear(e, core);
  if (s.y.size() < 4) {
    out.note = "too few heights with a known local shear";
    return out;
  }
  out.low = *std::min_element(s.rate.begin(), s.rate.end());
  out.high = *std::max_element(s.rate.begin(), s.rate.end());
  if (out.high < 1.3 * out.low) {
    out.note =
        text("local shear %.0f .. %.0f 1/s is too even to tell; n = 1 +- 0.3 assumed", out.low, out.high);
    return out;
  }
  std::vector<double> draws;
  for (const LocalLaw& d : fit.draws) draws.push_back(log_slope(s, d));
  if (draws.size() < 2) return out;
  const double n = log_slope(s, fit.law), sigma = standard_deviation(draws);
  if (sigma > 0.3) {
    out.note = text("n = %.2f +- %.2f says less than n = 1 +- 0.3, which is assumed", n, sigma);
    return out;
  }
  out.n = n;
  out.sigma = sigma;
  out.measured = true;
  out.note = text("D ~ shear^(%.2f +- %.2f) over local shear %.0f .. %.0f 1/s inside the run", n, sigma,
                  out.low, out.high);
  return out;
}

ConditionFit fit_conditions(const std::vector<data::TransportLaw>& laws) {
  require(laws.size() >= 2,
          "one calibration only (a trend needs at least two conditions) add runs at other conditions");
  ConditionFit out;
  const std::vector<Regressor> in = usable(laws, out.left_out);
  const auto n = static_cast<Eigen::Index>(laws.size()), k = static_cast<Eigen::Index>(in.size()) + 1;
  Eigen::MatrixXd X(n, k);
  Eigen::VectorXd y(n), w(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& law = laws[static_cast<std::size_t>(i)];
    require(
        law.core.D > 0 && law.core.D_sigma > 0,
        "calibration " + std::to_string(i + 1) + " has no D with an error (nothing to regress) leave it out");
    y(i) = std::log(law.core.D);
    w(i) = law.core.D_sigma > 0 ? law.core.D / law.core.D_sigma : 0;
    X(i, 0) = 1;
    for (Eigen::Index j = 1; j < k; ++j) X(i, j) = in[static_cast<std::size_t>(j - 1)].value(law.conditions);
    out.scaled.push_back(
        {law.core.D / (law.conditions.shear_rate * red_cell_radius * red_cell_radius),
         law.core.D_sigma / (law.conditions.shear_rate * red_cell_radius * red_cell_radius)});
  }
  const Eigen::RowVectorXd centre = X.rightCols(k - 1).colwise().mean();
  X.rightCols(k - 1).rowwise() -= centre;
  const Eigen::MatrixXd A = w.asDiagonal() * X;
  const Eigen::VectorXd b = w.asDiagonal() * y;
  Eigen::MatrixXd covariance = (A.transpose() * A).inverse();
  const Eigen::VectorXd beta = covariance * A.transpose() * b;
  out.degrees_of_freedom = static_cast<int>(n - k);
  out.chi_squared = (b - A * beta).squaredNorm();
  // Scatter beyond the stated errors (other packings, a crooked trend) widens them; luck never narrows them.
  if (out.degrees_of_freedom > 0)
    covariance *= std::max(1.0, out.chi_squared / static_cast<double>(out.degrees_of_freedom));
  out.D_centre = std::exp(beta(0));
  for (Eigen::Index j = 1; j < k; ++j) {
    Trend t;
    t.name = in[static_cast<std::size_t>(j - 1)].name;
    t.coefficient = beta(j);
    t.sigma = std::sqrt(covariance(j, j));
    t.claimed = std::abs(t.coefficient) > claim * t.sigma;
    t.statement = t.claimed ? text("ln D changes by %.2g +- %.2g per unit of %s (%.1f standard errors)",
                                   t.coefficient, t.sigma, t.name.c_str(), std::abs(t.coefficient) / t.sigma)
                            : text("effect of %s not distinguishable from none: %.2g +- %.2g", t.name.c_str(),
                                   t.coefficient, t.sigma);
    out.trends.push_back(t);
  }
  out.valid.shear_rate = {1e300, -1e300};
  out.valid.hematocrit = {1e300, -1e300};
  for (const auto& law : laws) {
    const auto widen = [](std::array<double, 2>& r, double low, double high) {
      r = {std::min(r[0], low), std::max(r[1], high)};
    };
    widen(out.valid.shear_rate, law.valid.shear_rate[0], law.valid.shear_rate[1]);
    widen(out.valid.hematocrit, law.valid.hematocrit[0], law.valid.hematocrit[1]);
    out.valid.dt_min = std::max(out.valid.dt_min, law.valid.dt_min);
  }
  return out;
}

Plan plan_for(double relative_error, const PlanInput& in) {
  require(relative_error > 0 && relative_error < 1,
          "the error asked for must lie between 0 and 1 (relative) give 0.1 for 10 %");
  require(in.shear_rate > 0 || in.lag > 0,
          "neither shear rate nor lag given (one sets the other) give the shear rate");
  Plan p;
  p.relative_error = relative_error;
  const double lag = in.lag > 0 ? in.lag : 2 / in.shear_rate;
  if (in.measured && in.measured->core.D_sigma > 0 && in.platelet_seconds > 0) {
    const double now = in.measured->core.D_sigma / in.measured->core.D;
    p.platelet_seconds = in.platelet_seconds * (now / relative_error) * (now / relative_error);
    p.note = text("scaled from %.3g platelet-seconds that gave %.1f %%", in.platelet_seconds, 100 * now);
  } else {
    // Brownian, overlapping displacements: variance of the MSD (4/3) lag/time. Heavy tails and uneven layers
    // cost another factor 1.9 in the published run.
    p.platelet_seconds = 1.9 * (4.0 / 3) * lag / (relative_error * relative_error) / in.share_in_layer;
    p.note = "from theory: (4/3) lag/error^2 per share of platelets in the layer, times 1.9 for heavy tails";
  }
  const double window = std::max(in.run_time - in.t0, 0.0);
  p.runs = window > 0 && in.platelets > 0
               ? std::max(3, static_cast<int>(std::ceil(p.platelet_seconds / (window * in.platelets))))
               : 3;
  p.platelets_single_origin = static_cast<int>(std::ceil(1.55 * 1.55 / (relative_error * relative_error)));
  return p;
}

}  // namespace hemowalk::calibration
