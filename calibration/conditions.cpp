/// \file The law over conditions: weighted regression of ln D, and the hypotheses it tests.

#include "calibration/conditions.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.hpp"
#include "core/text.hpp"

namespace hemowalk::calibration {
namespace {

constexpr double claim = 2;      // standard errors
constexpr double varies = 0.02;  // least spread of a regressor: 2 % of a scale, or 0.02 in hematocrit
// Least part of a regressor that the others do not explain; below it errors grow more than tenfold.
constexpr double independent = 0.1;

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

Vector column(const std::vector<data::TransportLaw>& laws, const Regressor& r) {
  Vector x(static_cast<Eigen::Index>(laws.size()));
  for (std::size_t k = 0; k < laws.size(); ++k)
    x(static_cast<Eigen::Index>(k)) = r.forward(laws[k].conditions.*r.member);
  return x;
}

/// Share of \p x (centred) that the columns of \p others do not explain.
double unexplained(const Vector& x, const Matrix& others) {
  if (others.cols() == 0) return 1;
  const Vector rest = x - others * others.colPivHouseholderQr().solve(x);
  return rest.norm() / x.norm();
}

/// Known in all calibrations, not the same in all, and not made up of regressors that are in already.
std::vector<const Regressor*> usable(const std::vector<data::TransportLaw>& laws,
                                     std::vector<std::string>& left_out) {
  std::vector<const Regressor*> in;
  Matrix columns(static_cast<Eigen::Index>(laws.size()), 0);
  for (const Regressor& r : regressors()) {
    Vector x = column(laws, r);
    const auto known = static_cast<std::size_t>(x.array().isFinite().count());
    if (known < laws.size()) {
      if (known > 0) left_out.push_back(r.name + " (not known in all calibrations)");
      continue;
    }
    if (x.maxCoeff() - x.minCoeff() < varies) continue;
    x.array() -= x.mean();
    const bool copy = unexplained(x, columns) < independent;
    if (copy || in.size() + 2 > laws.size()) {
      left_out.push_back(r.name + (copy ? " (varies together with another)" : " (too few calibrations)"));
      continue;
    }
    in.push_back(&r);
    columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
    columns.rightCols(1) = x;
  }
  return in;
}

Trend trend_of(const Regressor& r, double coefficient, double sigma, const Vector& x) {
  Trend t;
  t.name = r.name;
  t.coefficient = coefficient;
  t.sigma = sigma;
  t.centre = x.mean();
  t.range = {x.minCoeff(), x.maxCoeff()};
  t.claimed = std::abs(coefficient) > claim * sigma;
  t.statement = t.claimed ? formatted("ln D changes by %.2g +- %.2g per unit of %s (%.1f standard errors)",
                                      coefficient, sigma, r.name.c_str(), std::abs(coefficient) / sigma)
                          : formatted("effect of %s not distinguishable from none: %.2g +- %.2g",
                                      r.name.c_str(), coefficient, sigma);
  return t;
}

void test(Hypothesis& h, const std::vector<Trend>& trends) {
  const auto found =
      std::find_if(trends.begin(), trends.end(), [&](const Trend& t) { return t.name == h.about; });
  if (found == trends.end()) {
    h.outcome = "not tested";
    h.statement = h.claim + ": not tested, " + h.about + " does not vary on its own";
    return;
  }
  h.outcome = !found->claimed                            ? "not distinguishable"
              : (found->coefficient > 0) == (h.sign > 0) ? "supported"
                                                         : "contradicted";
  h.statement =
      h.claim +
      formatted(": %s, slope %.2g +- %.2g against ", h.outcome.c_str(), found->coefficient, found->sigma) +
      h.about + formatted(" (predicted %s)", h.sign > 0 ? "positive" : "negative");
}

void set_shear_exponent(ConditionFit& out, const std::vector<data::TransportLaw>& laws) {
  for (const Trend& t : out.trends)
    if (t.name == "ln shear rate") {
      out.shear_exponent = t.coefficient;
      out.shear_exponent_sigma = t.sigma;
      return;
    }
  double weight = 0, sum = 0;
  for (const auto& l : laws)
    if (l.scaling.sigma > 0) {
      weight += 1 / (l.scaling.sigma * l.scaling.sigma);
      sum += l.scaling.shear_exponent / (l.scaling.sigma * l.scaling.sigma);
    }
  if (!(weight > 0)) {
    out.shear_exponent_sigma = std::numeric_limits<double>::quiet_NaN();
    return;
  }
  out.shear_exponent = sum / weight;
  // An assumed exponent (1 +- 0.3) is one assumption, however many runs repeat it: no 1/sqrt(n).
  double least = std::numeric_limits<double>::max();
  for (const auto& l : laws)
    if (l.scaling.sigma > 0) least = std::min(least, l.scaling.sigma);
  out.shear_exponent_sigma = least;
}

void set_validity(ConditionFit& out, const std::vector<data::TransportLaw>& laws) {
  out.valid.shear_rate = out.valid.hematocrit = {1e300, -1e300};
  int failed = 0;
  for (const auto& law : laws) {
    const auto widen = [](std::array<double, 2>& r, const std::array<double, 2>& by) {
      r = {std::min(r[0], by[0]), std::max(r[1], by[1])};
    };
    widen(out.valid.shear_rate, law.valid.shear_rate);
    widen(out.valid.hematocrit, law.valid.hematocrit);
    out.valid.dt_min = std::max(out.valid.dt_min, law.valid.dt_min);
    failed += !law.gate.passed;
  }
  if (failed)
    out.warnings.push_back(formatted(
        "%d of %zu calibrations fail the artefact gate: a trend may be an artefact's", failed, laws.size()));
}

}  // namespace

const std::vector<Regressor>& regressors() {
  using C = data::TransportLaw::Conditions;
  constexpr auto log = +[](double x) { return std::log(x); };
  constexpr auto exp = +[](double x) { return std::exp(x); };
  constexpr auto same = +[](double x) { return x; };
  static const std::vector<Regressor> all = {
      {"ln shear rate", &C::shear_rate, log, exp},
      {"hematocrit", &C::hematocrit, same, same},
      {"ln kappa/(1-kappa)", &C::kappa_damping, +[](double k) { return std::log(k / (1 - k)); },
       +[](double x) { return 1 / (1 + std::exp(-x)); }},
      {"ln shape-recovery time", &C::t_c, log, exp},
      {"ln capillary number", &C::Ca, log, exp},
      {"ln gap", &C::gap, log, exp},
  };
  return all;
}

std::vector<Hypothesis> stated_hypotheses() {
  return {{"softer cells, faster platelets: less damping, larger D", "ln kappa/(1-kappa)", -1, "", ""},
          {"softer cells, faster platelets: quicker recovery of shape, larger D", "ln shape-recovery time",
           -1, "", ""},
          {"softer cells, faster platelets: larger capillary number, larger D", "ln capillary number", 1, "",
           ""}};
}

ConditionFit fit_conditions(const std::vector<data::TransportLaw>& laws) {
  require(laws.size() >= 2,
          "one calibration only (a trend needs at least two conditions) add runs at other conditions");
  ConditionFit out;
  const std::vector<const Regressor*> in = usable(laws, out.left_out);
  const auto n = static_cast<Eigen::Index>(laws.size()), k = static_cast<Eigen::Index>(in.size()) + 1;
  Matrix X(n, k);
  Vector y(n), w(n);
  X.col(0).setOnes();
  for (Eigen::Index j = 1; j < k; ++j) X.col(j) = column(laws, *in[static_cast<std::size_t>(j - 1)]);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& law = laws[static_cast<std::size_t>(i)];
    require(
        law.core.D > 0 && law.core.D_sigma > 0,
        "calibration " + std::to_string(i + 1) + " has no D with an error (nothing to regress) leave it out");
    y(i) = std::log(law.core.D);
    w(i) = law.core.D / law.core.D_sigma;
    const double unit = law.conditions.shear_rate * red_cell_radius * red_cell_radius;
    out.scaled.push_back({law.core.D / unit, law.core.D_sigma / unit});
  }
  const Matrix raw = X;
  const Eigen::RowVectorXd centre = X.rightCols(k - 1).colwise().mean();
  X.rightCols(k - 1).rowwise() -= centre;
  const Matrix A = w.asDiagonal() * X;
  const Vector b = w.asDiagonal() * y;
  Matrix covariance = (A.transpose() * A).inverse();
  const Vector beta = covariance * A.transpose() * b;
  out.degrees_of_freedom = static_cast<int>(n - k);
  out.chi_squared = (b - A * beta).squaredNorm();
  // Scatter beyond the stated errors (other packings, a crooked trend) widens them; luck never narrows them.
  if (out.degrees_of_freedom > 0) {
    const double excess = out.chi_squared - out.degrees_of_freedom;
    const Matrix WX = w.array().square().matrix().asDiagonal() * X;
    const double weight =
        w.squaredNorm() - (covariance * (WX.transpose() * WX)).trace();  // method of moments
    if (excess > 0 && weight > 0) out.scatter = std::sqrt(excess / weight);
    covariance *= std::max(1.0, out.chi_squared / static_cast<double>(out.degrees_of_freedom));
  }
  out.D_centre = std::exp(beta(0));
  for (Eigen::Index j = 1; j < k; ++j)
    out.trends.push_back(
        trend_of(*in[static_cast<std::size_t>(j - 1)], beta(j), std::sqrt(covariance(j, j)), raw.col(j)));
  for (Eigen::Index i = 0; i < k; ++i) {
    out.covariance.emplace_back();
    for (Eigen::Index j = 0; j < k; ++j) out.covariance.back().push_back(covariance(i, j));
  }
  out.hypotheses = stated_hypotheses();
  for (Hypothesis& h : out.hypotheses) test(h, out.trends);
  set_shear_exponent(out, laws);
  set_validity(out, laws);
  return out;
}

Predicted predict(const ConditionFit& fit, const data::TransportLaw::Conditions& at) {
  std::vector<double> x{1};
  Predicted p;
  p.log_D = std::log(fit.D_centre);
  for (const Trend& t : fit.trends) {
    const auto r = std::find_if(regressors().begin(), regressors().end(),
                                [&](const Regressor& q) { return q.name == t.name; });
    x.push_back(r->forward(at.*r->member) - t.centre);
    p.log_D += t.coefficient * x.back();
  }
  double variance = fit.scatter * fit.scatter;
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t j = 0; j < x.size(); ++j) variance += x[i] * fit.covariance[i][j] * x[j];
  p.sigma = std::sqrt(variance);
  return p;
}

}  // namespace hemowalk::calibration
