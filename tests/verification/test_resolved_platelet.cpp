// The rigid platelet as the fluid feels it, in seconds: Jeffery period and Stokes drag.
#include <gtest/gtest.h>

#include "core/check.hpp"
#include "support/single_body.hpp"

namespace hemowalk::resolved {
namespace {

test::BodyCase platelet(double dx = 0.5, int subdivision = 4) {
  test::BodyCase c;
  c.shape = test::platelet_shape();
  c.dx = dx, c.subdivision = subdivision;
  return c;
}

// Target of the shipped coupling: 5 %. The period varies by 3.5 % with the place on the lattice: two places.
TEST(Platelet, TurnsWithJefferysPeriod) {
  auto c = platelet();
  double period = test::jeffery_period(c) / 2;
  c.offset = {0.3, 0.5, 0.15};
  period += test::jeffery_period(c) / 2;
  EXPECT_NEAR(period / test::exact_jeffery_period(1.8 / 0.55), 1, 0.05);
}

// With the depth of a flat sheet for the faces it would be 8 % short.
TEST(Platelet, TurnsWithJefferysPeriodOnAFinerLattice) {
  EXPECT_NEAR(test::jeffery_period(platelet(1.0 / 3, 6)) / test::exact_jeffery_period(1.8 / 0.55), 1, 0.05);
}

TEST(Platelet, HasOberbecksDrag) {
  for (const auto& c : {platelet(), platelet(0.4, 5)})
    for (const int axis : {0, 1})
      EXPECT_NEAR(test::stokes_radius(c, axis) / test::exact_stokes_radius({1.8, 0.55, 1.8}, axis), 1, 0.05)
          << c.dx << " " << axis;
}

TEST(Platelet, TooThinForTheRetractionIsRefused) {
  auto c = platelet();
  c.coupling.retraction = 0.6;  // 2.15 times that is more than the half thickness of 1.1 dx
  EXPECT_THROW(Simulation<double>(test::scene_of(c), {test::body_of(c)}), InputError);
}

}  // namespace
}  // namespace hemowalk::resolved
