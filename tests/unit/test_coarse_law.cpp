/// \file From a law measured in a gap to D(y), v(y) of a slab.

#include <gtest/gtest.h>

#include <cmath>

#include "coarse/slab_law.hpp"
#include "core/check.hpp"

namespace hemowalk::coarse {
namespace {

/// 50 um gap in coordinates that start at y = 3 um; D falls towards the walls, more at the top; drift off the
/// walls.
data::TransportLaw measured() {
  data::TransportLaw law;
  law.conditions.gap = 50e-6;
  law.conditions.shear_rate = 100;
  law.core = {1e-10, 5e-12, 20e-3, {13e-6, 43e-6}};
  for (int i = 0; i < 25; ++i) {
    const double d = (i + 0.5) * 2e-6, bottom = std::exp(-d / 4e-6), top = std::exp(-(50e-6 - d) / 4e-6);
    law.profile.y.push_back(3e-6 + d);
    law.profile.D.push_back(1e-10 * (1 - 0.5 * bottom - 0.7 * top));
    law.profile.v.push_back(1e-6 * (bottom - top));
  }
  law.scaling.shear_exponent = 0.5;
  law.valid.shear_rate = {50, 200};
  return law;
}

Case slab_case(double height) {
  Case c;
  c.height = height;
  c.law_file = "law.yaml";
  return c;
}

TEST(SlabLaw, TakesTheMeasuredGapAsItIs) {
  const auto law = measured();
  const SlabLaw slab = map_law(law, slab_case(50e-6));
  // Between two nodes of the table a chord misses a bend of slope s by at most s spacing/4.
  const double off = slab.spacing() / 4;
  for (std::size_t i = 0; i < law.profile.y.size(); ++i) {
    EXPECT_NEAR(slab.D_at(law.profile.y[i] - 3e-6), law.profile.D[i], 0.7e-10 / 4e-6 * off);
    EXPECT_NEAR(slab.v_at(law.profile.y[i] - 3e-6), law.profile.v[i], 1e-6 / 4e-6 * off);
  }
  EXPECT_LT(slab.D.back(), slab.D.front());  // the two walls differ, as measured
}

TEST(SlabLaw, PutsMeasuredLayersAtBothWallsOfAThickSlabAndTheCoreBetween) {
  const auto law = measured();
  const double H = 0.82e-3;
  const SlabLaw slab = map_law(law, slab_case(H));
  EXPECT_DOUBLE_EQ(slab.D_at(H / 2), 1e-10);
  EXPECT_DOUBLE_EQ(slab.D_at(30e-6), 1e-10);
  EXPECT_EQ(slab.v_at(H / 2), 0);
  for (const double d : {1e-6, 4e-6, 9e-6}) {
    EXPECT_NEAR(slab.D_at(d) / slab.D_at(H - d), 1, 1e-12);
    EXPECT_NEAR(slab.v_at(d), -slab.v_at(H - d), 1e-15);
    const double e = std::exp(-d / 4e-6);
    EXPECT_NEAR(slab.D_at(d) / (1e-10 * (1 - 0.6 * e)), 1, 0.05) << d;  // mean of both walls, bins of 2 um
    EXPECT_GT(slab.v_at(d), 0);
  }
  EXPECT_EQ(slab.cells() & (slab.cells() - 1), 0u);
}

TEST(SlabLaw, ScalesDAndDriftWithTheShearRateAlike) {
  const auto law = measured();
  Case c = slab_case(0.82e-3);
  const SlabLaw rest = map_law(law, c);
  c.shear_rate = 400;
  const SlabLaw fast = map_law(law, c);
  for (std::size_t i = 0; i < rest.D.size(); ++i) {
    EXPECT_NEAR(fast.D[i], 2 * rest.D[i], 1e-24);
    EXPECT_NEAR(fast.v[i], 2 * rest.v[i], 1e-20);
  }
  c.constant_D = 3e-10;
  EXPECT_EQ(map_law(data::TransportLaw::constant(3e-10), c).D.front(), 3e-10);
}

TEST(SlabLaw, SaysWhatTheLawDoesNotCover) {
  auto law = measured();
  Case c = slab_case(0.82e-3);
  c.shear_rate = 100;
  EXPECT_TRUE(validity_findings(law, c).empty());
  c.shear_rate = 400;
  EXPECT_EQ(validity_findings(law, c).size(), 1u);
  law.valid.dt_min = 50e-3;
  law.gate.passed = false;
  c.height = 30e-6;
  EXPECT_EQ(validity_findings(law, c).size(), 4u);
  c.constant_D = 1e-10;
  EXPECT_TRUE(validity_findings(law, c).empty());
}

TEST(SlabLaw, EnsembleHasTheStatedSpread) {
  const auto law = measured();
  const Case c = slab_case(0.82e-3);
  const auto members = law_ensemble(law, 16);
  ASSERT_EQ(members.size(), 16u);
  double mean = 0, square = 0;
  for (const auto& m : members) mean += map_law(law, c, m).D_at(c.height / 2) / 16;
  for (const auto& m : members) square += std::pow(map_law(law, c, m).D_at(c.height / 2) - mean, 2) / 15;
  EXPECT_NEAR(mean, 1e-10, 1e-15);
  EXPECT_NEAR(std::sqrt(square), 5e-12, 1e-16);

  auto certain = law;
  certain.core.D_sigma = 0;
  EXPECT_TRUE(law_ensemble(certain, 16).empty());
}

TEST(SlabLaw, UsesPosteriorDrawsAndKeepsThemPositive) {
  auto law = measured();
  for (int k = 0; k < 8; ++k) {
    auto row = law.profile.D;
    for (double& D : row) D *= 1 + 0.01 * (k - 3.5);
    row[0] = k == 2 ? -1e-12 : row[0];
    law.profile.D_draws.push_back(row);
    law.profile.v_draws.push_back(law.profile.v);
  }
  const auto members = law_ensemble(law, 8);
  ASSERT_EQ(members.size(), 8u);
  for (std::size_t k = 1; k < 8; ++k) {
    EXPECT_GT(members[k].core_score, members[k - 1].core_score);
    EXPECT_GT(members[k].draw, members[k - 1].draw);  // core values ordered like the draws' own
  }
  for (const auto& m : members)
    for (const double D : map_law(law, slab_case(0.82e-3), m).D) EXPECT_GT(D, 0);
}

TEST(SlabLaw, RefusesABrokenProfile) {
  auto law = measured();
  law.profile.D[4] = 0;  // an estimate may be zero: raised, and said
  for (const double D : map_law(law, slab_case(50e-6)).D) EXPECT_GE(D, 1e-12 * (1 - 1e-12));
  EXPECT_EQ(validity_findings(law, slab_case(50e-6)).size(), 1u);
  law.profile.D[4] = std::nan("");
  EXPECT_THROW(map_law(law, slab_case(0.82e-3)), InputError);
  law = measured();
  std::swap(law.profile.y[3], law.profile.y[4]);
  EXPECT_THROW(map_law(law, slab_case(0.82e-3)), InputError);
  law = measured();
  law.core.D = 0;
  EXPECT_THROW(map_law(law, slab_case(0.82e-3)), InputError);
}

}  // namespace
}  // namespace hemowalk::coarse
