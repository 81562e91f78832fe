/// Literature, plans, the shear exponent inside one run.

#include <gtest/gtest.h>

#include <cmath>

#include "calibration/calibration.hpp"
#include "calibration/synthetic.hpp"
#include "calibration/verdict.hpp"
#include "core/check.hpp"

namespace {

using namespace hemowalk;
using namespace hemowalk::calibration;

const Verdict& find(const std::vector<Verdict>& all, const std::string& source) {
  for (const auto& v : all)
    if (v.source == source) return v;
  throw std::runtime_error("no verdict on " + source);
}
bool mentions(const std::string& text, const std::string& word) {
  return text.find(word) != std::string::npos;
}

TEST(Literature, FormulasByHand) {
  const Formula zydney_colton{0.15, 0.8, 1, {}}, leighton_acrivos{0.5, 0, 2, {}};
  // 0.15 * (2.75 um)^2 * 100/s * 0.35 * 0.65^0.8
  EXPECT_NEAR(zydney_colton(2.75e-6, 100, 0.35), 0.15 * 7.5625e-12 * 100 * 0.35 * 0.708483, 1e-16);
  EXPECT_NEAR(zydney_colton(2.75e-6, 100, 0.35), 2.81e-11, 0.005e-11);
  EXPECT_NEAR(zydney_colton(4.2e-6, 100, 0.35), 6.56e-11, 0.005e-11);
  EXPECT_NEAR(leighton_acrivos(4e-6, 50, 0.1), 0.5 * 16e-12 * 50 * 0.01, 1e-24);
}

TEST(Literature, EveryBuiltInSourceIsCompleteAndItsStandingStated) {
  const auto sources = read_literature(literature_text);
  EXPECT_GE(sources.size(), 8u);
  for (const auto& s : sources) {
    EXPECT_FALSE(s.checked.empty()) << s.id;
    EXPECT_FALSE(s.citation.empty()) << s.id;
    EXPECT_TRUE(s.D.has_value() != s.formula.has_value()) << s.id;
    EXPECT_LE(s.low.value_or(0), s.high.value_or(1)) << s.id;
  }
}

TEST(Literature, SaysWithWhichSourceUnderWhichConditionsByHowMuch) {
  Ours o;
  o.D = 1.25e-10;
  o.sigma = 0.05e-10;
  o.shear_rate = 100;
  o.hematocrit = 0.35;
  const auto all = compare_with_literature(o, read_literature(literature_text));
  const Verdict& t = find(all, "turitto1972");
  EXPECT_NEAR(t.z, (1.25 - 0.15) / std::hypot(0.05, 0.1), 1e-9);
  EXPECT_FALSE(t.matched_conditions);
  EXPECT_TRUE(mentions(t.statement, "radial instead of wall-normal"));
  EXPECT_TRUE(mentions(t.statement, "abstract only"));
  const Verdict& z = find(all, "zydney_colton1988");
  EXPECT_TRUE(z.matched_conditions);
  EXPECT_NEAR(z.D_lo, 2.81e-11, 0.01e-11);
  EXPECT_NEAR(z.D_hi, 6.56e-11, 0.01e-11);
  EXPECT_TRUE(mentions(z.statement, "from memory"));
  EXPECT_TRUE(std::isnan(find(all, "kotsalos2019").z));
  EXPECT_TRUE(mentions(find(all, "kotsalos2019").statement, "no error"));
  EXPECT_TRUE(mentions(find(all, "impact_r_activated").statement, "activated"));
  for (const auto& v : all) EXPECT_FALSE(mentions(v.statement, "validated"));
  o.shear_rate = 500;
  EXPECT_FALSE(find(compare_with_literature(o, read_literature(literature_text)), "published_tracks_plateau")
                   .matched_conditions);
}

TEST(Literature, RedCellsMeetFormulasOnly) {
  Ours o;
  o.particle = "rbc";
  o.D = 5e-11;
  o.sigma = 1e-11;
  o.shear_rate = 100;
  o.hematocrit = 0.35;
  const auto all = compare_with_literature(o, read_literature(literature_text));
  ASSERT_EQ(all.size(), 2u);
  EXPECT_TRUE(find(all, "zydney_colton1988").matched_conditions);
  EXPECT_NEAR(find(all, "leighton_acrivos1987").D_lo, 0.5 * 7.5625e-12 * 100 * 0.1225, 1e-16);
}

TEST(Literature, BrokenFileIsRefused) {
  EXPECT_THROW(read_literature("format: something/1\n"), InputError);
  EXPECT_THROW(read_literature("format: hemowalk.literature/1\nsources: [{id: x}]\n"), InputError);
}

TEST(Plan, ErrorsCostTheirInverseSquare) {
  const Plan ten = plan_for(0.1, {}), five = plan_for(0.05, {});
  EXPECT_NEAR(five.platelet_seconds / ten.platelet_seconds, 4, 1e-12);
  EXPECT_NEAR(ten.platelet_seconds, 8.4, 0.2);  // the method note's figure for 100/s
  EXPECT_EQ(ten.platelets_single_origin, 241);  // (1.55/0.1)^2
  EXPECT_EQ(ten.runs, 3);
  EXPECT_GT(plan_for(0.01, {}).runs, 3);
  EXPECT_THROW(plan_for(0, {}), InputError);
}

TEST(Plan, ScalesWhatWasMeasured) {
  data::TransportLaw law;
  law.core.D = 1e-10;
  law.core.D_sigma = 0.05e-10;
  PlanInput in;
  in.measured = &law;
  in.platelet_seconds = 60;
  EXPECT_NEAR(plan_for(0.1, in).platelet_seconds, 15, 1e-9);
}

// D proportional to the local shear: both vary over the core, the exponent is found inside one run.
TEST(ShearExponentInOneRun, FollowsUnevenShear) {
  Synthetic s;
  s.platelets = 300;
  s.D_contrast = 0.6;
  data::Trajectories t = generate(s);
  auto& p = t.kinds["platelet"].position;
  for (std::size_t k = 1; k < t.time.size(); ++k)  // local shear proportional to D(y)^2: n = 1/2
    for (std::size_t n = 0; n < 300; ++n) {
      const double y = p[(k * 300 + n) * 3 + 1], w = 2 * M_PI / s.gap, c = s.D_contrast;
      // integral of (1 + c cos wy)^2
      const double u =
          100 * (y * (1 + c * c / 2) + 2 * c * std::sin(w * y) / w + c * c * std::sin(2 * w * y) / (4 * w));
      p[(k * 300 + n) * 3 + 2] = p[((k - 1) * 300 + n) * 3 + 2] + u * s.sample;
    }
  Options o;
  o.bootstrap = 200;
  const Calibration c = calibrate({t}, o);
  EXPECT_LT(c.law.scaling.sigma, 0.15);
  EXPECT_NEAR(c.law.scaling.shear_exponent, 0.5, 3.5 * c.law.scaling.sigma);
  const Calibration even = calibrate({generate(s)}, o);
  EXPECT_EQ(even.law.scaling.shear_exponent, 1);
  EXPECT_EQ(even.law.scaling.sigma, 0.3);
}

}  // namespace
