// What `hemowalk bench` times is what the scene asks for. Without a GPU the device's part is emulated.

#include <gtest/gtest.h>

#include "core/check.hpp"
#include "resolved/bench.hpp"
#include "support/blood_scene.hpp"
#include "support/places.hpp"

namespace hemowalk::resolved {
namespace {

data::Scene scene(const data::Places& place) {
  data::Scene s = test::blood_scene({12, 14, 12}, 0.1);
  s.acceleration = 16;
  s.place = place;
  return s;
}

constexpr data::Places hybrid{Place::host, Place::host, Place::device},
    whole{Place::device, Place::device, Place::device};

BenchReport emulated(const data::Places& place, int steps) {
  BenchOptions options;
  options.steps = steps, options.warm_up = 2;
  options.device = Place::host;
  return bench(scene(place), options);
}

void expect_shares(const BenchReport& report) {
  const Timings& t = report.parts;
  for (const double part : {t.fluid, t.interpolation, t.spreading, t.solid, t.contact}) EXPECT_GT(part, 0);
  EXPECT_LT(report.momentum_residual, 1e-5);
}

TEST(DeviceBench, SharesOfTheHybrid) {
  const BenchReport report = emulated(hybrid, 6);
  expect_shares(report);
  EXPECT_GT(report.least.fluid, 0) << "the fluid is on the host, whose ceilings were measured";
}

TEST(DeviceBench, SharesOfTheWholeStep) {
  const BenchReport report = emulated(whole, 25);
  expect_shares(report);
  EXPECT_EQ(report.parts.steps, 20) << "in rounds of ten";
  EXPECT_EQ(report.least.fluid, 0) << "the host's ceilings say nothing about a device";
}

TEST(DeviceBench, AsksForTheDevice) {
  if (device_present()) GTEST_SKIP() << "there is a device";
  for (const auto& place : {hybrid, whole}) {
    BenchOptions options;
    options.steps = 1;
    EXPECT_THROW((void)bench(scene(place), options), InputError);
  }
}

}  // namespace
}  // namespace hemowalk::resolved
