// What the fluid outside does to a surface, on cases small enough to work out by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "resolved/lbm/fluid.hpp"
#include "resolved/mesh/shapes.hpp"
#include "resolved/surface_traction.hpp"

namespace hemowalk::resolved {
namespace {

bool anywhere(const Node3&) { return true; }

// Nodes sit at i + 1/2. Round (10.2, 10.6, 10.9) the kernel covers 8..11, 9..12 and 9..12.
TEST(ExteriorNode, IsTheFarthestAlongTheNormal) {
  const mesh::Vec3 x{10.2, 10.6, 10.9};
  const double d = 1 / std::sqrt(3.0);
  Node3 node;
  ASSERT_TRUE(exterior_node(x, {d, d, d}, anywhere, node));
  EXPECT_EQ(node, (Node3{11, 12, 12}));
  ASSERT_TRUE(exterior_node(x, {-d, d, -d}, anywhere, node));
  EXPECT_EQ(node, (Node3{8, 12, 9}));
  // Of the 16 that are equally far along an axis the one nearest to x.
  ASSERT_TRUE(exterior_node(x, {1, 0, 0}, anywhere, node));
  EXPECT_EQ(node, (Node3{11, 10, 10}));
  ASSERT_TRUE(exterior_node(x, {0, 0, -1}, anywhere, node));
  EXPECT_EQ(node, (Node3{10, 10, 9}));
}

TEST(ExteriorNode, IsFluid) {
  const mesh::Vec3 x{10.2, 10.6, 10.9};
  Node3 node;
  ASSERT_TRUE(exterior_node(
      x, {0, 1, 0}, [](const Node3& n) { return n[1] < 12; }, node));
  EXPECT_EQ(node, (Node3{10, 11, 10}));
  EXPECT_FALSE(exterior_node(
      x, {0, 1, 0}, [](const Node3&) { return false; }, node));
}

TEST(SurfaceForce, IsTractionTimesArea) {
  // sigma n with n = (0.6, 0.8, 0): (2 - 5) 0.6 + 7 0.8, 7 0.6 + (3 - 5) 0.8, 11 0.6 + 13 0.8
  const auto f = surface_force(2, {0.6, 0.8, 0}, 5, {2, 3, 4, 7, 11, 13});
  EXPECT_DOUBLE_EQ(f[0], 2 * 3.8);
  EXPECT_DOUBLE_EQ(f[1], 2 * 2.6);
  EXPECT_DOUBLE_EQ(f[2], 2 * 17.0);
}

TEST(SurfaceForce, KnowsNoMeanPressure) {
  std::vector<double> pressure{2, 6};
  subtract_mean({1, 3}, pressure);  // mean (2 + 18)/4 = 5
  EXPECT_DOUBLE_EQ(pressure[0], -3);
  EXPECT_DOUBLE_EQ(pressure[1], 1);
}

TEST(OneRings, MedianOfFourIsTheMeanOfTheMiddleTwo) {
  const mesh::TriangleMesh tetrahedron{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                       {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  std::vector<mesh::Vec3> f{{0, 5, -1}, {1, 5, -2}, {10, 5, -3}, {100, 5, 7}}, scratch;
  OneRings(tetrahedron).median(f, scratch);  // every ring is the whole surface
  for (const auto& v : f) EXPECT_EQ(v, (mesh::Vec3{5.5, 5, -1.5}));
}

TEST(OneRings, MedianTakesOutliersAwayAndNothingElse) {
  const auto sphere = mesh::sphere(1, 4);
  std::vector<mesh::Vec3> f(sphere.vertices.size(), {1, 2, 3}), scratch;
  f[5] = {1e6, -1e6, 3};
  OneRings(sphere).median(f, scratch);
  for (const auto& v : f) EXPECT_EQ(v, (mesh::Vec3{1, 2, 3}));
  // A ring holds neighbours along edges only: one vertex of an octahedron sees all but the opposite one.
  const auto octahedron = mesh::sphere(1, 1);
  ASSERT_EQ(octahedron.vertices.size(), 6u);
  std::vector<mesh::Vec3> g(6);
  for (int k = 0; k < 6; ++k) g[k] = {double(k), 0, 0};
  std::vector<double> expected;
  for (int k = 0; k < 6; ++k) {
    std::vector<double> seen;
    for (int j = 0; j < 6; ++j) {
      double distance = 0;
      for (int d = 0; d < 3; ++d) distance += std::abs(octahedron.vertices[k][d] + octahedron.vertices[j][d]);
      if (distance > 1e-9) seen.push_back(j);
    }
    ASSERT_EQ(seen.size(), 5u);
    expected.push_back(seen[2]);
  }
  OneRings(octahedron).median(g, scratch);
  for (int k = 0; k < 6; ++k) EXPECT_EQ(g[k][0], expected[k]) << k;
}

// The stress of a node: mu gamma in a shear flow up to O(gamma^2), (rho - 1)/3 in a fluid at rest; in both
// parities of the step.
TEST(NodeStress, OfShearAndOfPressure) {
  const Block block{6, 8, 5};
  lbm::Parameters p;
  p.tau = 1.3;
  const double rate = 1e-5, mu = (p.tau - 0.5) / 3;
  p.upper_wall_velocity = {0, 0, rate * 8};
  lbm::Fluid<double> shear(block, p);
  shear.initialise([&](double y) { return rate * y; });
  lbm::Fluid<double> rest(block, {});
  rest.initialise([](double, double, double) { return lbm::FlowPoint{1.003, {}}; });
  for (int step = 0; step < 2; ++step) {
    for (const Node3& n : {Node3{0, 0, 0}, Node3{5, 7, 4}, Node3{2, 3, 2}}) {
      const auto s = shear.stress(n[0], n[1], n[2]);
      EXPECT_NEAR(s.viscous[5], mu * rate, rate * rate);
      for (const int other : {0, 1, 3, 4}) EXPECT_NEAR(s.viscous[other], 0, rate * rate);
      EXPECT_NEAR(s.pressure, 0, rate * rate);
      const auto r = rest.stress(n[0], n[1], n[2]);
      EXPECT_NEAR(r.pressure, 0.001, 1e-14);
      for (const double v : r.viscous) EXPECT_NEAR(v, 0, 1e-14);
    }
    shear.collide_and_stream({}), rest.collide_and_stream({});
  }
}

}  // namespace
}  // namespace hemowalk::resolved
