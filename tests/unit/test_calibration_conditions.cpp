/// The law over conditions: trends, hypotheses, the transport law at one condition.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "calibration/calibration.hpp"
#include "core/check.hpp"
#include "core/random.hpp"

namespace {

using namespace hemowalk;
using namespace hemowalk::calibration;
using Conditions = data::TransportLaw::Conditions;

const double unknown = std::nan("");
const Conditions anywhere{unknown, unknown, unknown, unknown, unknown, unknown, unknown};

bool mentions(const std::string& text, const std::string& word) {
  return text.find(word) != std::string::npos;
}

data::TransportLaw law_at(double shear, double hematocrit, double kappa, double D, double sigma) {
  data::TransportLaw l;
  l.conditions.shear_rate = shear;
  l.conditions.hematocrit = hematocrit;
  l.conditions.kappa_damping = kappa;
  l.conditions.t_c = l.conditions.Ca = std::nan("");
  l.conditions.gap = 50e-6;
  l.core.D = D;
  l.core.D_sigma = sigma;
  l.valid.shear_rate = {shear / 2, shear * 2};
  l.valid.hematocrit = {hematocrit - 0.05, hematocrit + 0.05};
  return l;
}

TEST(Trends, ShearExponentIsRecovered) {
  std::vector<data::TransportLaw> laws;
  RandomSequence random(3, Stream::test);
  for (double g : {50.0, 100.0, 200.0, 400.0})
    for (double h : {0.3, 0.4}) {
      const double D = 1e-10 * std::pow(g / 100, 0.7);
      laws.push_back(law_at(g, h, 0.9, D * (1 + 0.05 * random.normal()), 0.05 * D));
    }
  const ConditionFit f = fit_conditions(laws);
  ASSERT_EQ(f.trends.size(), 2u);
  EXPECT_EQ(f.trends[0].name, "ln shear rate");
  EXPECT_NEAR(f.trends[0].coefficient, 0.7, 3.5 * f.trends[0].sigma);
  EXPECT_LT(f.trends[0].sigma, 0.05);
  EXPECT_TRUE(f.trends[0].claimed);
  EXPECT_FALSE(f.trends[1].claimed) << f.trends[1].statement;
  EXPECT_TRUE(mentions(f.trends[1].statement, "not distinguishable"));
  EXPECT_NEAR(f.valid.shear_rate[0], 25, 1e-12);
  EXPECT_NEAR(f.valid.shear_rate[1], 800, 1e-12);
}

// The published trend with damping: 5 % between neighbours, 16 % errors.
TEST(Trends, AWeakTrendIsNotClaimed) {
  std::vector<data::TransportLaw> laws;
  for (double kappa : {0.5, 0.7, 0.8, 0.9})
    laws.push_back(law_at(100, 0.35, kappa, 1e-10 * (1.2 - 0.2 * kappa), 0.16e-10));
  const ConditionFit f = fit_conditions(laws);
  ASSERT_EQ(f.trends.size(), 1u);
  EXPECT_FALSE(f.trends[0].claimed);
  for (auto& l : laws) l.core.D_sigma = 0.001e-10;  // the same slope with small errors is one
  EXPECT_TRUE(fit_conditions(laws).trends[0].claimed);
}

TEST(Trends, WhatVariesTogetherCannotBeToldApart) {
  std::vector<data::TransportLaw> laws;
  for (double x : {1.0, 2.0, 3.0, 4.0}) laws.push_back(law_at(100 * x, 0.3, 0.9, 1e-10 * x, 1e-12));
  for (auto& l : laws) l.conditions.Ca = l.conditions.shear_rate / 300;
  const ConditionFit f = fit_conditions(laws);
  ASSERT_EQ(f.trends.size(), 1u);
  ASSERT_EQ(f.left_out.size(), 1u);
  EXPECT_TRUE(mentions(f.left_out[0], "varies together"));
  EXPECT_NEAR(f.scaled[1][0], 2e-10 / (200 * 16e-12), 1e-9);
}

TEST(Trends, OneCalibrationIsNoTrend) {
  EXPECT_THROW(fit_conditions({law_at(100, 0.3, 0.9, 1e-10, 1e-12)}), InputError);
}

TEST(Trends, ASumOfTwoCannotBeToldApartEither) {
  std::vector<data::TransportLaw> laws;
  for (double a : {0.0, 0.5, 1.0})
    for (double b : {0.0, 0.7}) {
      laws.push_back(law_at(100 * std::exp(a), 0.3, 0.9, 1e-10, 1e-12));
      laws.back().conditions.t_c = 1e-3 * std::exp(b);
      laws.back().conditions.Ca = 0.1 * std::exp(a + b);
    }
  const ConditionFit f = fit_conditions(laws);
  ASSERT_EQ(f.trends.size(), 2u);
  ASSERT_EQ(f.left_out.size(), 1u);
  EXPECT_TRUE(mentions(f.left_out[0], "ln capillary number"));
}

// The true hematocrit of two packings differs by a fraction of a cell: that is no second condition.
TEST(Trends, AWobbleIsNoCondition) {
  std::vector<data::TransportLaw> laws;
  for (double kappa : {0.5, 0.9}) laws.push_back(law_at(100, 0.349 + 0.002 * kappa, kappa, 1e-10, 1e-11));
  const ConditionFit f = fit_conditions(laws);
  ASSERT_EQ(f.trends.size(), 1u);
  EXPECT_EQ(f.trends[0].name, "ln kappa/(1-kappa)");
}

std::vector<data::TransportLaw> over_kappa(double slope, double sigma) {
  std::vector<data::TransportLaw> laws;
  for (double kappa : {0.5, 0.7, 0.8, 0.9})
    laws.push_back(law_at(100, 0.35, kappa, 1e-10 * std::pow(kappa / (1 - kappa), slope), sigma));
  return laws;
}
const Hypothesis& about(const ConditionFit& f, const std::string& name) {
  for (const auto& h : f.hypotheses)
    if (h.about == name) return h;
  throw std::runtime_error("no hypothesis about " + name);
}

TEST(Hypotheses, SofterCellsFasterPlateletsHasASign) {
  const std::string kappa = "ln kappa/(1-kappa)";
  EXPECT_EQ(about(fit_conditions(over_kappa(-0.2, 1e-12)), kappa).outcome, "supported");
  EXPECT_EQ(about(fit_conditions(over_kappa(+0.2, 1e-12)), kappa).outcome, "contradicted");
  // ln kappa/(1-kappa) = 0, .85, 1.39, 2.2: errors of 25 % on D leave 0.15 on the slope.
  EXPECT_EQ(about(fit_conditions(over_kappa(-0.2, 0.25e-10)), kappa).outcome, "not distinguishable");
  EXPECT_EQ(about(fit_conditions(over_kappa(-0.2, 1e-12)), "ln capillary number").outcome, "not tested");
}

TEST(LawAtConditions, GoesBetweenTheCalibrations) {
  std::vector<data::TransportLaw> laws;
  for (double g : {50.0, 100.0, 200.0, 400.0})
    laws.push_back(law_at(g, 0.35, 0.9, 1e-10 * g / 100, 2e-12 * g / 100));
  auto at = anywhere;
  at.shear_rate = 150;
  const auto fit = fit_conditions(laws);
  EXPECT_NEAR(fit.shear_exponent, 1, 1e-9);
  const auto law = law_at(fit, laws, at);
  EXPECT_NEAR(law.core.D, 1.5e-10, 1e-18);
  // Four values with 2 % each; 150 lies .06 from the mean of ln 50 .. ln 400, whose squares sum to 2.4.
  const double d = std::log(150) - std::log(std::sqrt(50.0 * 400));
  EXPECT_NEAR(law.core.D_sigma / law.core.D,
              0.02 * std::sqrt(1 / 4.0 + d * d / (5 * std::log(2) * std::log(2))), 1e-6);
  EXPECT_EQ(law.conditions.kappa_damping, 0.9);
  EXPECT_TRUE(std::isnan(law.conditions.t_c));
}

TEST(LawAtConditions, RefusesWhatWasNotCalibrated) {
  const auto laws = over_kappa(-0.1, 1e-11);
  const auto fit = fit_conditions(laws);
  auto at = anywhere;
  at.kappa_damping = 0.95;
  EXPECT_THROW(law_at(fit, laws, at), Refused);
  at = anywhere;
  at.shear_rate = 250;  // each vouches for 50 to 200
  EXPECT_THROW(law_at(fit, laws, at), Refused);
  at = anywhere;
  at.t_c = 1e-3;  // nobody measured it
  EXPECT_THROW(law_at(fit, laws, at), Refused);
  at = anywhere;
  at.kappa_damping = 0.6;
  EXPECT_NEAR(law_at(fit, laws, at).core.D, 1e-10 * std::pow(1.5, -0.1), 1e-16);
}

// Laws written by hand may leave out the gap or the shear rate.
TEST(LawAtConditions, UnknownConditionsAreNoGuess) {
  auto laws = over_kappa(-0.1, 1e-11);
  for (auto& l : laws) {
    l.conditions.gap = unknown;
    l.profile.y = {0, 25e-6, 50e-6};
    l.profile.D = {1e-10, 1e-10, 1e-10};
    l.profile.v = {0, 0, 0};
    l.core.y_range = {10e-6, 40e-6};
  }
  EXPECT_EQ(law_at(fit_conditions(laws), laws, anywhere).profile.y.back(), 50e-6);
  for (auto& l : laws) l.conditions.shear_rate = unknown;
  auto at = anywhere;
  at.shear_rate = 150;
  EXPECT_THROW(law_at(fit_conditions(laws), laws, at), Refused);
}

TEST(LawAtConditions, ProfileKeepsItsDistanceToTheWalls) {
  std::vector<data::TransportLaw> laws{law_at(100, 0.35, 0.9, 1e-10, 1e-12),
                                       law_at(100, 0.35, 0.9, 2e-10, 2e-12)};
  laws[1].conditions.gap = 200e-6;
  for (auto& l : laws) {
    l.core.y_range = {10e-6, l.conditions.gap - 10e-6};
    for (int k = 0; k <= 64; ++k) {
      const double y = l.conditions.gap * k / 64, d = std::min(y, l.conditions.gap - y);
      l.profile.y.push_back(y);
      l.profile.D.push_back(l.core.D * std::min(1.0, d / 10e-6));
      l.profile.v.push_back(d < 10e-6 ? (y < l.conditions.gap / 2 ? 1e-6 : -1e-6) : 0);
    }
    l.profile.D_draws = {l.profile.D, l.profile.D};
    l.profile.v_draws = {l.profile.v, l.profile.v};
  }
  auto at = anywhere;
  at.gap = 100e-6;  // half way in ln gap
  const auto fit = fit_conditions(laws);
  const auto law = law_at(fit, laws, at);
  const double D = std::sqrt(2.0) * 1e-10;
  EXPECT_NEAR(law.core.D, D, 1e-16);
  EXPECT_NEAR(law.profile.y.back(), 100e-6, 1e-15);
  EXPECT_NEAR(law.core.y_range[1], 90e-6, 1e-12);
  for (std::size_t k = 0; k < law.profile.y.size(); ++k) {
    const double d = std::min(law.profile.y[k], 100e-6 - law.profile.y[k]);
    // Linear tables of 0.8 (50 um) and 3.1 um (200 um) knots: the kink at 10 um is rounded by half a knot.
    if (std::abs(d - 10e-6) > 3.2e-6) {
      EXPECT_NEAR(law.profile.D[k], D * std::min(1.0, d / 10e-6), 0.002 * D) << k;
    }
    if (d > 14e-6) {
      EXPECT_EQ(law.profile.v[k], 0) << k;
    }
  }
  EXPECT_GT(law.profile.v[2], 0);
  EXPECT_LT(law.profile.v[62], 0);
  ASSERT_EQ(law.profile.D_draws.size(), 2u);
  EXPECT_NE(law.profile.D_draws[0][32], law.profile.D_draws[1][32]);  // the regression's own error
}

TEST(ConditionsFile, HoldsEveryDigitAndItsRanges) {
  const auto laws = over_kappa(-0.1, 1.0 / 3 * 1e-11);
  const auto fit = fit_conditions(laws);
  const auto j = nlohmann::json::parse(conditions_json(fit, laws));
  EXPECT_EQ(j["format"], "hemowalk.law_over_conditions/1");
  EXPECT_EQ(j["terms"][0]["coefficient"].get<double>(), fit.trends[0].coefficient);
  EXPECT_EQ(j["covariance"][1][1].get<double>(), fit.covariance[1][1]);
  EXPECT_EQ(j["terms"][0]["valid"][1].get<double>(), std::log(0.9 / (1 - 0.9)));
  EXPECT_EQ(j["valid"]["shear_rate_1_per_s"][1].get<double>(), 200);
  EXPECT_EQ(j["calibrations"][3]["D_sigma"].get<double>(), 1.0 / 3 * 1e-11);
  EXPECT_TRUE(j["calibrations"][0]["t_c_s"].is_null());
  EXPECT_EQ(j["hypotheses"].size(), 3u);
}

TEST(ConditionsFile, SaysWhenTheGateFailed) {
  auto laws = over_kappa(-0.1, 1e-11);
  laws[1].gate.passed = false;
  const auto fit = fit_conditions(laws);
  ASSERT_EQ(fit.warnings.size(), 1u);
  EXPECT_TRUE(mentions(fit.warnings[0], "1 of 4"));
  EXPECT_FALSE(law_at(fit, laws, anywhere).gate.passed);
}

}  // namespace
