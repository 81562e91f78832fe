// The rigid platelet as the fluid feels it, in seconds: Jeffery period and Stokes drag at dx 0.5 um.
#include <gtest/gtest.h>

#include "core/check.hpp"
#include "support/single_body.hpp"

namespace hemowalk::resolved {
namespace {

test::BodyCase platelet() {
  test::BodyCase c;
  c.shape = test::platelet_shape();
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

TEST(Platelet, HasOberbecksDrag) {
  for (const int axis : {0, 1})
    EXPECT_NEAR(test::stokes_radius(platelet(), axis) / test::exact_stokes_radius({1.8, 0.55, 1.8}, axis), 1,
                0.05)
        << axis;
}

TEST(Platelet, TooThinForTheRetractionIsRefused) {
  auto c = platelet();
  c.coupling.retraction = 0.75;  // 1.5 times that is more than the half thickness of 1.1 dx
  EXPECT_THROW(Simulation<double>(test::scene_of(c), {test::body_of(c)}), InputError);
}

}  // namespace
}  // namespace hemowalk::resolved
