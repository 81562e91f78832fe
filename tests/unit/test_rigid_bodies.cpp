#include <gtest/gtest.h>

#include <cmath>

#include "resolved/mesh/shapes.hpp"
#include "resolved/mesh/vector.hpp"
#include "resolved/rigid/rigid.hpp"
#include "support/cells.hpp"

namespace hemowalk::rigid {
namespace {

using mesh::Vec3;

/// Uneven metric: the centre of the metric is not the centre of the shape.
BodyType uneven_body() {
  auto rest = mesh::ellipsoid({1, 2, 3}, 3);
  std::vector<double> metric;
  support::Numbers numbers(4);
  for (int k = 0; k < rest.vertex_count(); ++k) metric.push_back(2 + numbers());
  return {rest, metric, metric, 0.1};
}

template <class Real>
std::vector<Vec3> velocities(const RigidBodies<Real>& b, int c) {
  std::vector<Vec3> v(b.vertices());
  for (int k = 0; k < b.vertices(); ++k)
    for (int d = 0; d < 3; ++d) v[k][d] = b.velocities()[b.layout().at(c, k, d)];
  return v;
}
template <class Real>
void predict(RigidBodies<Real>& b, int c, const std::vector<Vec3>& v) {
  for (int k = 0; k < b.vertices(); ++k)
    for (int d = 0; d < 3; ++d) b.predicted()[b.layout().at(c, k, d)] = static_cast<Real>(v[k][d]);
}

TEST(RigidBodies, KeepTheMomentaOfAnyVelocityAndMoveByTheirVelocity) {
  const auto type = uneven_body();
  RigidBodies<double> bodies(type);
  bodies.add(1, {5, 6, 7}, mesh::rotation({1, 1, 0}, 0.5));
  support::Numbers numbers(8);
  for (int i = 0; i < 20; ++i) {
    const auto x = bodies.positions(0);
    std::vector<Vec3> w(x.size());
    for (auto& p : w) p = {1 + numbers(), numbers(), numbers()};
    predict(bodies, 0, w);
    bodies.step();
    const auto v = velocities(bodies, 0), moved = bodies.positions(0);
    Vec3 linear{}, angular{};
    for (std::size_t k = 0; k < x.size(); ++k) {
      const auto gap = mesh::subtract(v[k], w[k]);
      mesh::accumulate(linear, type.metric[k], gap);
      mesh::accumulate(angular, type.metric[k], mesh::cross(x[k], gap));
      EXPECT_NEAR(mesh::norm(mesh::subtract(moved[k], mesh::add(x[k], mesh::scale(type.h, v[k])))), 0, 1e-13);
    }
    EXPECT_LT(mesh::norm(linear), 1e-12);
    EXPECT_LT(mesh::norm(angular), 1e-11);
    for (std::size_t k = 1; k < x.size(); ++k)  // rigid
      EXPECT_NEAR(mesh::norm(mesh::subtract(moved[k], moved[0])),
                  mesh::norm(mesh::subtract(type.rest.vertices[k], type.rest.vertices[0])), 1e-13);
  }
}

/// Held at points away from its vertices: momenta and velocities are those of the points, a couple turns it.
TEST(RigidBodies, HeldPointsCarryTheMomentaAndACoupleAddsItself) {
  auto type = uneven_body();
  type.held = type.rest.vertices;
  for (auto& p : type.held) p = {0.5 * p[0], 0.7 * p[1], 0.8 * p[2]};
  RigidBodies<double> bodies(type);
  bodies.add(1, {5, 6, 7}, mesh::rotation({1, 1, 0}, 0.5));
  support::Numbers numbers(9);
  const Vec3 torque{3, -2, 1};
  for (int i = 0; i < 5; ++i) {
    const auto held = [&](int k) {
      Vec3 x = bodies.anchor(0);
      for (int d = 0; d < 3; ++d) x[d] += bodies.held()[bodies.layout().at(0, k, d)];
      return x;
    };
    std::vector<Vec3> x(bodies.vertices()), w(bodies.vertices());
    for (int k = 0; k < bodies.vertices(); ++k) x[k] = held(k), w[k] = {1 + numbers(), numbers(), numbers()};
    const Vec3 anchor = bodies.anchor(0);
    predict(bodies, 0, w);
    if (i == 0) bodies.add_couple(0, torque);
    bodies.step();
    const auto v = velocities(bodies, 0);
    Vec3 linear{}, angular{};
    for (std::size_t k = 0; k < x.size(); ++k) {
      const auto gap = mesh::subtract(v[k], w[k]);
      mesh::accumulate(linear, type.metric[k], gap);
      mesh::accumulate(angular, type.metric[k], mesh::cross(mesh::subtract(x[k], anchor), gap));
      const auto moved = held(static_cast<int>(k));
      EXPECT_NEAR(mesh::norm(mesh::subtract(moved, mesh::add(x[k], mesh::scale(type.h, v[k])))), 0, 1e-13);
    }
    EXPECT_LT(mesh::norm(linear), 1e-12);
    const Vec3 expected = i == 0 ? mesh::scale(type.h, torque) : Vec3{};  // forgotten after its step
    EXPECT_LT(mesh::norm(mesh::subtract(angular, expected)), 1e-11);
  }
}

/// Free flight of an asymmetric top: angular momentum to round-off, energy with an error of second order in
/// h.
TEST(RigidBodies, FreeTopKeepsItsAngularMomentum) {
  double drift[2];
  for (int level = 0; level < 2; ++level) {
    auto type = uneven_body();
    type.h = 0.01 / (1 << level);
    RigidBodies<double> bodies(type);
    bodies.add(1, {0, 0, 0}, mesh::identity_rotation);
    bodies.set_motion(0, {0, 0, 0}, {0.3, 1, 0.2});
    const auto angular_momentum = [&] {
      Vec3 sum{};
      const auto x = bodies.positions(0), v = velocities(bodies, 0);
      for (std::size_t k = 0; k < x.size(); ++k)
        mesh::accumulate(sum, type.metric[k], mesh::cross(x[k], v[k]));
      return sum;
    };
    const auto energy = [&] {
      double sum = 0;
      const auto v = velocities(bodies, 0);
      for (std::size_t k = 0; k < v.size(); ++k) sum += type.metric[k] / 2 * mesh::dot(v[k], v[k]);
      return sum;
    };
    const auto start = angular_momentum();
    const double start_energy = energy();
    const auto first_axis = mesh::rotate(bodies.orientation(0), {0, 1, 0});
    for (int i = 0; i < 1000 << level; ++i) {
      predict(bodies, 0, velocities(bodies, 0));
      bodies.step();
    }
    EXPECT_LT(mesh::norm(mesh::subtract(angular_momentum(), start)), 1e-10 * mesh::norm(start));
    EXPECT_LT(mesh::dot(first_axis, mesh::rotate(bodies.orientation(0), {0, 1, 0})), 0.99)
        << "did not tumble";
    drift[level] = std::abs(energy() - start_energy) / start_energy;
  }
  EXPECT_LT(drift[0], 0.01);
  EXPECT_NEAR(std::log2(drift[0] / drift[1]), 2, 0.3);
}

/// m -> 0: with v_pred = w the body takes the rigid part of the fluid velocity, whatever it did before.
TEST(RigidBodies, MasslessBodyFollowsARotatingFluid) {
  auto type = uneven_body();
  type.mass.assign(type.mass.size(), 0.0);
  RigidBodies<float> bodies(type);
  bodies.add(1, {5, 6, 7}, mesh::identity_rotation);
  bodies.set_motion(0, {9, 9, 9}, {-4, 3, 1});
  const Vec3 spin{0.2, -0.1, 0.4};
  std::vector<Vec3> w;
  for (const auto& p : bodies.positions(0)) w.push_back(mesh::cross(spin, p));
  predict(bodies, 0, w);
  bodies.step();
  // the chord condition turns omega by O(h omega): compare at that order
  EXPECT_LT(mesh::norm(mesh::subtract(bodies.angular_velocity(0), spin)), 0.1 * mesh::norm(spin));
  type.h = 1e-4;
  RigidBodies<float> fine(type);
  fine.add(1, {5, 6, 7}, mesh::identity_rotation);
  predict(fine, 0, w);
  fine.step();
  EXPECT_LT(mesh::norm(mesh::subtract(fine.angular_velocity(0), spin)), 1e-4 * mesh::norm(spin));
}

TEST(RigidBodies, SaveLoadRemoveAndTranslate) {
  const auto type = uneven_body();
  RigidBodies<float> bodies(type);
  for (int c = 0; c < 18; ++c) {
    bodies.add(50 + c, {4.0 * c, 1, 2}, mesh::rotation({1, 0, 1}, c));
    bodies.set_motion(c, {1, 0, 0}, {0, 0.1 * c, 1});
  }
  std::vector<std::byte> state(bodies.state_bytes()), again(state);
  RigidBodies<float> copy(type);
  bodies.save(17, state.data());
  EXPECT_EQ(copy.load(state.data()), 0);
  bodies.remove(3);
  EXPECT_EQ(bodies.count(), 17);
  EXPECT_EQ(bodies.id(3), 67);
  for (int i = 0; i < 5; ++i) {
    predict(bodies, 3, velocities(bodies, 3));
    predict(copy, 0, velocities(copy, 0));
    bodies.step();
    copy.step();
  }
  bodies.save(3, state.data());
  copy.save(0, again.data());
  EXPECT_EQ(state, again);
  const auto before = bodies.position(3, 2);
  bodies.translate(3, {-40, 0, 8});
  EXPECT_NEAR(bodies.position(3, 2)[0] - before[0], -40, 1e-13);
  EXPECT_NEAR(bodies.anchors()[bodies.layout().anchor(3, 2)], bodies.anchor(3)[2], 0);
}

TEST(RigidBodies, NormalsAndAxisTurnWithTheBody) {
  const auto type = uneven_body();
  RigidBodies<double> bodies(type);
  const auto q = mesh::rotation({3, 1, 2}, 2.0);
  bodies.add(1, {0, 0, 0}, q);
  const auto n = mesh::vertex_normals(type.rest);
  for (int k = 0; k < bodies.vertices(); ++k) {
    const auto exact = mesh::rotate(q, n[k]);
    for (int d = 0; d < 3; ++d) EXPECT_NEAR(bodies.normals()[bodies.layout().at(0, k, d)], exact[d], 1e-14);
  }
  EXPECT_NEAR(mesh::dot(bodies.observe(0).axis, mesh::rotate(q, {0, 1, 0})), 1, 1e-12);
}

TEST(RigidBodies, SlowDownAsAWholeUnderACap) {
  const auto type = uneven_body();
  RigidBodies<double> free(type), capped(type);
  support::Numbers numbers(3);
  std::vector<Vec3> w(type.rest.vertices.size());
  for (auto& p : w) p = {1 + numbers(), numbers(), numbers()};
  mesh::StepOptions options;
  options.velocity_cap = 0.25;
  for (auto* bodies : {&free, &capped}) {
    bodies->add(1, {5, 6, 7}, mesh::rotation({1, 1, 0}, 0.5));
    predict(*bodies, 0, w);
    bodies->step(bodies == &capped ? options : mesh::StepOptions{});
  }
  const double ratio = mesh::norm(capped.velocity(0)) / mesh::norm(free.velocity(0));
  EXPECT_LT(ratio, 1);
  EXPECT_NEAR(mesh::norm(capped.angular_velocity(0)) / mesh::norm(free.angular_velocity(0)), ratio, 1e-14);
  // Chords are shorter than arcs by (h omega)^2/24.
  EXPECT_NEAR(support::largest(velocities(capped, 0)), 0.25, 0.25 * 1e-3);
}

}  // namespace
}  // namespace hemowalk::rigid
