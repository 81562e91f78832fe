// "Particle in kernel" by hand: bodies of one or two vertices.
#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "core/check.hpp"
#include "resolved/contact/kernel_contact.hpp"

namespace hemowalk::contact {
namespace {

struct Vertex {
  std::uint16_t body;
  std::array<double, 3> x, normal;
};

struct Outcome {
  std::vector<Node4<double>> force;
  Summary summary;
};

/// Vertices in the order of their bodies.
Outcome press(const KernelLaw& law, const Domain& domain, const std::vector<Vertex>& vertices) {
  std::vector<Node4<double>> x, n, force(vertices.size(), {9, 9, 9, 9});
  std::vector<Body> bodies;
  std::vector<int> count;
  for (const Vertex& v : vertices) {
    if (v.body == bodies.size()) {
      bodies.push_back({static_cast<std::uint32_t>(x.size()), 1, v.body, true});
      count.push_back(0);
    }
    ++count[v.body];
    x.push_back({v.x[0] - 3, v.x[1], v.x[2] + 7, 0});
    n.push_back({v.normal[0], v.normal[1], v.normal[2], 0});
  }
  const std::vector<Origin> origin(bodies.size(), Origin{3, 0, -7});
  KernelContact<double> contact(law, domain, count);
  contact.set_bodies(bodies);
  const Summary s = contact.compute({origin.data(), origin.size()}, {x.data(), x.size()},
                                    {n.data(), n.size()}, {force.data(), force.size()});
  return {force, s};
}

void expect(const Node4<double>& f, double x, double y, double z, double flag) {
  EXPECT_NEAR(f.x, x, 1e-12);
  EXPECT_NEAR(f.y, y, 1e-12);
  EXPECT_NEAR(f.z, z, 1e-12);
  EXPECT_EQ(f.w, flag);
}

constexpr KernelLaw law{2, 2, 3};
const Domain box{{12, 0, 12}, {Walls::Geometry::slab, 0, 20, 0, 0, 0}};

// f = K (x_j + 2 n_j - x): for the first 3 ((0.5, 1, 0) + 2 (0, -1, 0)), for the second 3 ((-0.5, -1, 0) + 2
// (1, 0, 0)).
TEST(KernelContact, PullsToThePointOutsideTheNeighbourAndIsNoPairForce) {
  const auto [f, s] = press(law, box, {{0, {5, 9, 5}, {1, 0, 0}}, {1, {5.5, 10, 5}, {0, -1, 0}}});
  expect(f[0], 1.5, -3, 0, 1);
  expect(f[1], 4.5, -3, 0, 1);
  EXPECT_EQ(s.contacts, 2);
  EXPECT_DOUBLE_EQ(s.minimum_gap, 0.5);  // (x_1 - x_0).n_0
}

TEST(KernelContact, NeedsAForeignParticleInTheKernel) {
  // Two vertices of one body, and another body just outside the radius.
  const auto [f, s] = press(
      law, box, {{0, {5, 9, 5}, {0, 1, 0}}, {0, {5.1, 9, 5}, {0, 1, 0}}, {1, {5, 11.01, 5}, {0, -1, 0}}});
  for (int k = 0; k < 3; ++k) expect(f[k], 0, 0, 0, 0);
  EXPECT_EQ(s.contacts, 0);
}

// On the outer side of the point there is no spring, but no fluid force either.
TEST(KernelContact, LeavesAloneWhatIsFarEnoughOutside) {
  const auto [f, s] = press({2, 1, 3}, box, {{0, {5, 9, 5}, {0, 1, 0}}, {1, {5, 10.5, 5}, {0, -1, 0}}});
  expect(f[0], 0, 0, 0, 1);
  expect(f[1], 0, 0, 0, 1);
  EXPECT_EQ(s.contacts, 0);
}

TEST(KernelContact, TakesTheNearestAndSeesImages) {
  // The neighbour at x = 11.9 stands at -0.1: 0.3 away; the other one is 1 away.
  const auto [f, s] = press(
      law, box,
      {{0, {0.2, 9, 11.8}, {0, 1, 0}}, {1, {11.9, 9, 11.8}, {0, 0, 1}}, {2, {0.2, 10, 11.8}, {0, -1, 0}}});
  expect(f[0], 3 * (-0.3), 0, 3 * 2, 1);
}

TEST(KernelContact, WallsPushAndAreBooked) {
  const auto [f, s] = press(law, box, {{0, {5, 0.7, 5}, {0, -1, 0}}, {1, {5, 20.1, 9}, {0, 1, 0}}});
  expect(f[0], 0, 3 * 1.3, 0, 1);
  expect(f[1], 0, -3 * 2.1, 0, 1);  // beyond the wall: pulled back
  EXPECT_DOUBLE_EQ(s.wall_force[0][1], -f[0].y);
  EXPECT_DOUBLE_EQ(s.wall_force[1][1], -f[1].y);
  EXPECT_EQ(s.wall_contacts, 2);
  EXPECT_NEAR(s.minimum_wall_gap, -0.1, 1e-12);
}

TEST(KernelContact, RefusesPositionsThatAreNotFinite) {
  EXPECT_THROW(press(law, box, {{0, {5, std::nan(""), 5}, {1, 0, 0}}}), PhysicsError);
  EXPECT_THROW(press({2, 0, 3}, box, {}), InputError);
}

}  // namespace
}  // namespace hemowalk::contact
