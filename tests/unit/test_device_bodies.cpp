// Rigid bodies on the device against the host's, whatever the order of threads.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "resolved/rigid/device_bodies.hpp"
#include "support/cells.hpp"
#include "support/places.hpp"

namespace hemowalk::rigid {
namespace {

using namespace hemowalk::test;
using support::Numbers;

class DeviceBodiesTest : public OnPlace {};
HEMOWALK_ON_BOTH_PLACES(DeviceBodiesTest);

BodyType platelet_type() {
  BodyType type;
  type.rest = mesh::platelet(1, 4);
  type.mass.assign(type.rest.vertex_count(), 20);
  Numbers numbers(3);
  for (int k = 0; k < type.rest.vertex_count(); ++k) type.metric.push_back(100 + 20 * numbers());
  type.h = 0.25;
  return type;
}

template <class Real>
struct Pair {
  Pair(Place place, int bodies) : queue(place), host(platelet_type()) {
    for (int c = 0; c < bodies; ++c) {
      host.add(50 + c, {5.0 * c, 300.0, 1.0}, mesh::rotation({1.0, 0.2 * c, 0.4}, 0.5 * c));
      host.set_motion(c, {0.01, 0, 0.1}, {0.3, -0.2 * c, 0.1});
    }
    device = std::make_unique<DeviceBodies<Real>>(queue, host);
  }

  /// v_pred: fast spin, so that the finite turn matters, with noise.
  void step(std::uint64_t seed) {
    Numbers numbers(seed);
    const auto& f = device->fields();
    Array<Real> predicted(static_cast<std::size_t>(host.count()) * 3 * f.pitch);
    const auto at = host.layout();
    for (int c = 0; c < host.count(); ++c)
      for (int k = 0; k < host.vertices(); ++k) {
        const auto v = mesh::cross({1, 0.5, -0.3 * c}, mesh::subtract(host.position(c, k), host.anchor(c)));
        for (int d = 0; d < 3; ++d)
          host.predicted()[at.at(c, k, d)] = predicted[f.at(c, d, k)] =
              static_cast<Real>(v[d] + 0.2 * numbers());
      }
    queue.copy(f.predicted, predicted.data(), predicted.size());
    host.step();
    device->step();
    queue.wait();
  }

  Queue queue;
  RigidBodies<Real> host;
  std::unique_ptr<DeviceBodies<Real>> device;
};

// Both compute in double and differ in the order of 66 terms: 1e-13 per step of numbers of order 1, for 10
// steps; the fields are then rounded to Real.
template <class Real>
void expect_as_on_host(Place place, double tolerance) {
  Pair<Real> pair(place, 9);
  for (int i = 0; i < 10; ++i) pair.step(20 + i);
  RigidBodies<Real> copy(platelet_type());
  for (int c = 0; c < 9; ++c) copy.add(0, {0, 0, 0}, mesh::identity_rotation);
  pair.device->download(copy);
  EXPECT_EQ(pair.device->report().bad_cell, -1);
  const auto at = copy.layout();
  for (int c = 0; c < 9; ++c) {
    EXPECT_GT(mesh::norm(pair.host.angular_velocity(c)), 0.5);
    for (int d = 0; d < 3; ++d) {
      EXPECT_NEAR(copy.anchor(c)[d], pair.host.anchor(c)[d], 1e-12 * 300);
      EXPECT_NEAR(copy.angular_velocity(c)[d], pair.host.angular_velocity(c)[d], tolerance);
      for (int k = 0; k < copy.vertices(); ++k) {
        EXPECT_NEAR(copy.velocities()[at.at(c, k, d)], pair.host.velocities()[at.at(c, k, d)], 3 * tolerance);
        EXPECT_NEAR(copy.offsets()[at.at(c, k, d)], pair.host.offsets()[at.at(c, k, d)], 3 * tolerance);
        EXPECT_NEAR(copy.normals()[at.at(c, k, d)], pair.host.normals()[at.at(c, k, d)], tolerance);
      }
    }
  }
}

TEST_P(DeviceBodiesTest, StepLikeTheHost) { expect_as_on_host<double>(GetParam(), 1e-12); }
TEST_P(DeviceBodiesTest, StepLikeTheHostInSinglePrecision) {
  expect_as_on_host<float>(GetParam(), 2 * std::numeric_limits<float>::epsilon());
}

// What follows from the orientation is made anew when a state comes up (by the host) and in every step (by
// the kernel): the same bits, or a run that was saved would not go on as the one that was not.
TEST_P(DeviceBodiesTest, AStateComesBackWithItsPoints) {
  Pair<double> pair(GetParam(), 9);
  for (int i = 0; i < 3; ++i) pair.step(20 + i);
  RigidBodies<double> copy(platelet_type());
  for (int c = 0; c < 9; ++c) copy.add(0, {0, 0, 0}, mesh::identity_rotation);
  pair.device->download(copy);
  const auto& f = pair.device->fields();
  const std::size_t n = static_cast<std::size_t>(copy.count()) * 3 * f.pitch;
  Array<double> offset(n), held(n), normal(n);
  pair.queue.copy(offset.data(), f.offset, n), pair.queue.copy(held.data(), f.held, n);
  pair.queue.copy(normal.data(), f.normal, n);
  pair.queue.wait();
  const auto at = copy.layout();
  for (int c = 0; c < copy.count(); ++c)
    for (int k = 0; k < copy.vertices(); ++k)
      for (int d = 0; d < 3; ++d) {
        EXPECT_EQ(copy.offsets()[at.at(c, k, d)], offset[f.at(c, d, k)]);
        EXPECT_EQ(copy.held()[at.at(c, k, d)], held[f.at(c, d, k)]);
        EXPECT_EQ(copy.normals()[at.at(c, k, d)], normal[f.at(c, d, k)]);
      }
}

// Two compilers agree on them because each product that meets a sum is a fused one, in this order.
TEST(Rotation, RoundsWhereItSays) {
  Numbers numbers(5);
  for (int i = 0; i < 100; ++i) {
    const mesh::Quaternion q = mesh::normalized({numbers(), numbers(), numbers(), numbers()});
    const Vec3 v{numbers(), numbers(), numbers()};
    const auto [w, x, y, z] = q;
    const mesh::Matrix3 m = mesh::matrix(q);
    EXPECT_EQ(m[0], std::fma(-2.0, std::fma(y, y, z * z), 1.0));
    EXPECT_EQ(m[5], 2 * std::fma(y, z, -w * x));
    EXPECT_EQ(m[6], 2 * std::fma(x, z, -w * y));
    EXPECT_EQ(mesh::transform(m, v)[1], std::fma(m[3], v[0], std::fma(m[4], v[1], m[5] * v[2])));
  }
}

TEST_P(DeviceBodiesTest, OrderOfThreadsChangesNoBit) {
  std::vector<std::byte> first;
  for (const HostThreads order : {HostThreads::forward, HostThreads::backward, HostThreads::scattered}) {
    ThreadOrder now(order);
    Pair<float> pair(GetParam(), 3);
    for (int i = 0; i < 3; ++i) pair.step(20 + i);
    RigidBodies<float> copy(platelet_type());
    for (int c = 0; c < 3; ++c) copy.add(0, {0, 0, 0}, mesh::identity_rotation);
    pair.device->download(copy);
    std::vector<std::byte> state(3 * copy.state_bytes());
    for (int c = 0; c < 3; ++c) copy.save(c, state.data() + c * copy.state_bytes());
    if (first.empty()) first = state;
    EXPECT_TRUE(first == state);
  }
}

}  // namespace
}  // namespace hemowalk::rigid
