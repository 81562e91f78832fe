// The platelet as the fluid feels it, in seconds: Jeffery period and Stokes drag.
#include <gtest/gtest.h>

#include <random>

#include "core/check.hpp"
#include "resolved/build.hpp"
#include "resolved/mesh/vector.hpp"
#include "resolved/retraction.hpp"
#include "support/single_body.hpp"

namespace hemowalk::resolved {
namespace {

test::BodyCase platelet(double dx = 0.5, int subdivision = 4) {
  test::BodyCase c;
  c.shape = test::platelet_shape();
  c.dx = dx, c.subdivision = subdivision;
  return c;
}

test::BodyCase deformable() {
  auto c = platelet();
  c.material = {};
  c.material.bending.modulus = 100e-18;  // J
  return c;
}

/// Over the exact one. It varies by 3.5 % with the place on the lattice: mean of two.
double relative_period(test::BodyCase c) {
  double period = test::jeffery_period(c) / 2;
  c.offset = {0.3, 0.5, 0.15};
  period += test::jeffery_period(c) / 2;
  return period / test::exact_jeffery_period(1.8 / 0.55);
}

// Target of the shipped coupling: 5 %.
TEST(Platelet, TurnsWithJefferysPeriod) { EXPECT_NEAR(relative_period(platelet()), 1, 0.05); }

// With the depth of a flat sheet for the faces it would be 8 % short.
TEST(Platelet, TurnsWithJefferysPeriodOnAFinerLattice) {
  EXPECT_NEAR(test::jeffery_period(platelet(1.0 / 3, 6)) / test::exact_jeffery_period(1.8 / 0.55), 1, 0.05);
}

TEST(Platelet, HasOberbecksDrag) {
  for (const auto& c : {platelet(), platelet(0.4, 5), deformable()})
    for (const int axis : {0, 1})
      EXPECT_NEAR(test::stokes_radius(c, axis) / test::exact_stokes_radius({1.8, 0.55, 1.8}, axis), 1, 0.05)
          << c.dx << " " << axis;
}

// Drawn back along its normals, which cross at the rim, it was 8 % short and had a tenth too much drag. The
// period sees the couples, drag does not.
TEST(Platelet, TurnsWithJefferysPeriodAlsoWhereItIsDeformable) {
  EXPECT_NEAR(relative_period(deformable()), 1, 0.05);
}

// What the map of the vertices takes from velocities and adds to forces: at rest it is the rigid platelet's
// surface; a rigid motion is carried along; the force's power at the coupling points is that on the vertices,
// and so are its sum and its torque.
TEST(Platelet, CouplingSurfaceIsAFairMapOfTheVertices) {
  const auto c = deformable();
  const data::Scene scene = test::scene_of(c);
  const auto rest = make_mesh(scene.cells.kinds[0], scene.fluid.dx);
  const auto surface = mirror_surface(scene.cells.kinds[0], rest, scene.coupling);
  const auto held = coupling_points(scene.cells.kinds[0], rest, scene.coupling);
  const int n = rest.vertex_count();
  ASSERT_EQ(static_cast<int>(surface.mirror.size()), n);
  using Pair = std::array<std::vector<mesh::Vec3>, 2>;  // two cells side by side
  const auto lost = [&](const Pair& f) {
    std::vector<double> in(6 * n), out(6 * n);
    for (int k = 0; k < n; ++k)
      for (int d = 0; d < 3; ++d)
        for (int l = 0; l < 2; ++l) in[(3 * k + d) * 2 + l] = f[l][k][d];
    draw_in<2>(
        surface, [&](int k) { return all_lanes<2>(in.data(), k); }, out.data());
    Pair r = f;
    for (int k = 0; k < n; ++k)
      for (int d = 0; d < 3; ++d)
        for (int l = 0; l < 2; ++l) r[l][k][d] = out[(3 * k + d) * 2 + l];
    return r;
  };
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const auto any = [&] { return mesh::Vec3{normal(random), normal(random), normal(random)}; };
  const mesh::Vec3 speed = any(), spin = any();
  Pair x{rest.vertices, rest.vertices}, J = x, rigid = x;
  for (int k = 0; k < n; ++k) {
    const mesh::Vec3 kick = any();
    for (int d = 0; d < 3; ++d) x[1][k][d] += 0.1 * kick[d];
    J[0][k] = any(), J[1][k] = any();
    for (int l : {0, 1}) rigid[l][k] = mesh::add(speed, mesh::cross(spin, x[l][k]));
  }
  const Pair back = lost(x), taken = lost(J), left_behind = lost(rigid);
  for (int l : {0, 1}) {
    mesh::Vec3 sum{}, torque{}, at_points{};
    double power = 0, on_vertices = 0;
    for (int k = 0; k < n; ++k) {
      const mesh::Vec3 site = mesh::subtract(x[l][k], back[l][k]),
                       force = mesh::subtract(J[l][k], taken[l][k]),
                       velocity = mesh::subtract(rigid[l][k], left_behind[l][k]),
                       carried = mesh::add(speed, mesh::cross(spin, site));
      for (int d = 0; d < 3; ++d) {
        if (l == 0) {
          EXPECT_NEAR(site[d], held[k][d], 1e-9);
        }
        EXPECT_NEAR(velocity[d], carried[d], 1e-12);
        sum[d] += taken[l][k][d];
      }
      mesh::accumulate(torque, 1, mesh::cross(x[l][k], force));
      mesh::accumulate(at_points, 1, mesh::cross(site, J[l][k]));
      power += mesh::dot(J[l][k], velocity), on_vertices += mesh::dot(force, rigid[l][k]);
    }
    for (int d = 0; d < 3; ++d) {
      EXPECT_NEAR(sum[d], 0, 1e-12);
      EXPECT_NEAR(torque[d], at_points[d], 1e-11);
    }
    EXPECT_NEAR(power, on_vertices, 1e-11);
  }
}

TEST(Platelet, TooThinForTheRetractionIsRefused) {
  auto c = platelet();
  c.coupling.retraction = 0.6;  // 2.15 times that is more than the half thickness of 1.1 dx
  EXPECT_THROW(Simulation<double>(test::scene_of(c), {test::body_of(c)}), InputError);
}

}  // namespace
}  // namespace hemowalk::resolved
