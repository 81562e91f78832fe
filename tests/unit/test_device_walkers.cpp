// Walkers on the device against the host's: the same random numbers, so the same walk.

#include <gtest/gtest.h>

#include <cmath>

#include "coarse/device_walkers.hpp"
#include "coarse/walkers.hpp"
#include "support/places.hpp"

namespace hemowalk::coarse {
namespace {

using namespace hemowalk::test;

class DeviceWalkersTest : public OnPlace {};
HEMOWALK_ON_BOTH_PLACES(DeviceWalkersTest);

Case slab(Face bottom, Face top) {
  Case c;
  c.height = 50e-6;
  c.walkers = 5000;
  c.dt = 0.01;
  c.bottom = bottom, c.top = top;
  c.seed = 3;
  return c;
}
SlabLaw layered(double height, bool drift) {
  return make_slab_law(
      height, 64, [&](double y) { return 2e-11 + 8e-11 * std::sin(3.14159 * y / height); },
      [&](double y) { return drift ? 1e-7 * (y / height - 0.5) : 0.0; });
}
WalkSettings settings_of(StepLaw law) {
  WalkSettings s;
  s.step_law = law;
  s.memory = 0.02;
  s.tail_exponent = 3.5, s.tail_fraction = 0.05;
  s.cell_free_layer = 2e-6;
  return s;
}
constexpr StepLaw laws[] = {StepLaw::gaussian, StepLaw::persistent, StepLaw::heavy_tail};

// Between reflecting walls both keep every walker in its place. A step of 3e7 units (2^30 = the slab) is a
// product of single precision numbers: some 4 roundings of 2 units, in another order; 200 steps, and D(y)
// feels the difference by its gradient (factor below 2).
TEST_P(DeviceWalkersTest, FollowTheHostStepByStep) {
  for (const StepLaw law : laws)
    for (const bool drift : {false, true}) {
      const Case c = slab({Face::Type::reflect}, {Face::Type::reflect});
      const SlabLaw y_law = layered(c.height, drift);
      Walkers host(c, y_law, settings_of(law));
      Queue queue(GetParam());
      DeviceWalkers device(queue, make_walk(c, y_law, settings_of(law)), c.walkers);
      host.advance_to(200);
      device.advance_to(70);
      device.advance_to(200);
      const auto expected = host.heights();
      const auto found = device.positions();
      ASSERT_EQ(expected.size(), found.size());
      double moved = 0;
      const DeviceWalkers start(queue, make_walk(c, y_law, settings_of(law)), c.walkers);
      const auto first = start.positions();
      for (std::size_t i = 0; i < found.size(); ++i) {
        ASSERT_NEAR(found[i], expected[i] / c.height * top_position, 200 * 4 * 2 * 2) << "walker " << i;
        moved += std::abs(double(found[i]) - first[i]) / found.size();
      }
      EXPECT_GT(moved, 1e8);
    }
}

// Walkers whose fate hangs on a rounding: of 5000, below one in a thousand.
TEST_P(DeviceWalkersTest, FacesTakeAsManyAsOnTheHost) {
  const Face faces[] = {{Face::Type::absorb}, {Face::Type::robin, 2e-6}, {Face::Type::trap, 0.5, 2e-6}};
  for (const Face& face : faces)
    for (const StepLaw law : laws) {
      const Case c = slab(face, {Face::Type::reflect});
      const SlabLaw y_law = layered(c.height, false);
      Walkers host(c, y_law, settings_of(law));
      Queue queue(GetParam());
      DeviceWalkers device(queue, make_walk(c, y_law, settings_of(law)), c.walkers);
      host.advance_to(600);  // more than a leg
      device.advance_to(600);
      const auto expected = host.count(10);
      const auto found = device.count(10);
      EXPECT_GT(expected.absorbed[0] + expected.trapped[0], 50);
      for (int side = 0; side < 2; ++side) {
        EXPECT_NEAR(found.absorbed[side], expected.absorbed[side], 5);
        EXPECT_NEAR(found.trapped[side], expected.trapped[side], 5);
      }
      std::int64_t sum = found.absorbed[0] + found.absorbed[1] + found.trapped[0] + found.trapped[1];
      for (int b = 0; b < 10; ++b) {
        EXPECT_NEAR(found.histogram[b], expected.histogram[b], 5);
        sum += found.histogram[b];
      }
      EXPECT_EQ(sum, c.walkers);
      EXPECT_NEAR(device.steps_walked(), host.steps_walked(), 5 * (600 - 512)) << "who is taken stops at 512";
    }
}

TEST_P(DeviceWalkersTest, PeriodicFacesAndConstantLaw) {
  const Case c = slab({Face::Type::periodic}, {Face::Type::periodic});
  const SlabLaw law = make_slab_law(
      c.height, 1, [](double) { return 1e-10; }, [](double) { return 0.0; });
  Walkers host(c, law);
  Queue queue(GetParam());
  DeviceWalkers device(queue, make_walk(c, law, {}), c.walkers);
  host.advance_to(100);
  device.advance_to(100);
  const auto expected = host.heights();
  const auto found = device.positions();
  int apart = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double d = std::abs(found[i] - expected[i] / c.height * top_position);
    apart += std::min(d, top_position - d) > 100 * 8;
  }
  EXPECT_EQ(apart, 0);
}

}  // namespace
}  // namespace hemowalk::coarse
