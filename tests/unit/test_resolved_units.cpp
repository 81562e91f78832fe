// The crossing between SI and the lattice: dimensionless groups survive it, and acceleration keeps Ca.
#include <gtest/gtest.h>

#include <cmath>

#include "resolved/build.hpp"
#include "resolved/cross_section.hpp"
#include "resolved/mesh/shapes.hpp"
#include "resolved/units.hpp"

namespace hemowalk::resolved {
namespace {

data::Scene scene_at(double s) {
  data::Scene scene;
  scene.acceleration = s;
  return scene;
}

TEST(Units, TimeStepOfThePaper) {
  const LatticeUnits units(scene_at(1));
  EXPECT_NEAR(units.dt, 0.125e-6, 1e-18);
  EXPECT_NEAR(units.steps(1.0), 8e6, 1e-3);
}

TEST(Units, CapillaryNumberDoesNotDependOnAcceleration) {
  for (const double s : {1.0, 16.0, 50.0}) {
    const LatticeUnits u(scene_at(s));
    const double nu = (2 - 0.5) / 3, Ca = nu * u.rate(100) * u.length(3.91e-6) / u.modulus(1.25e-6);
    EXPECT_NEAR(Ca, 1025e-6 * 100 * 3.91e-6 / 1.25e-6, 1e-12);
    const double bending_number = nu * u.rate(100) * std::pow(u.length(3.91e-6), 3) / u.bending(1e-18);
    EXPECT_NEAR(bending_number, 1025e-6 * 100 * std::pow(3.91e-6, 3) / 1e-18, 1e-9);
  }
}

TEST(Units, OutputIsPhysicalWhateverTheAcceleration) {
  for (const double s : {1.0, 30.0}) {
    const LatticeUnits u(scene_at(s));
    EXPECT_NEAR(u.to_velocity(u.velocity(5e-3)), 5e-3, 1e-15);
    EXPECT_NEAR(u.to_rate(u.rate(100)), 100, 1e-10);
    EXPECT_NEAR(u.to_time(u.steps(0.3)), 0.3, 1e-12);
    const double nu = (2 - 0.5) / 3;
    EXPECT_NEAR(u.to_stress(nu * u.rate(100)), 1025e-6 * 100, 1e-12);  // mu gamma
    EXPECT_NEAR(u.to_force(u.force(25e-12)), 25e-12, 1e-24);
  }
}

TEST(Units, ContactStiffnessPerAreaMatchesStiffnessPerVertex) {
  const LatticeUnits u(scene_at(1));
  data::Scene scene = scene_at(1);
  const double range = u.length(scene.contact.range);
  const double per_vertex =
      make_contact(scene, u).stiffness * range * u.area(reference_vertex_area);  // at zero gap
  EXPECT_NEAR(u.to_force(per_vertex), scene.contact.stiffness * scene.contact.range, 1e-18);
}

TEST(CrossSection, IntegratesToTheVolumeAndGivesTheCircle) {
  const double R = 7.3;
  auto sphere = mesh::sphere(R, 24);
  for (auto& v : sphere.vertices) v[1] += 10.2;
  std::vector<double> area(20, 0.0);
  add_cross_sections([&](int k) { return sphere.vertices[k]; }, sphere.triangles, 1.0, area);
  const double edge = mesh::mean_edge(sphere),
               chord = edge * edge / (2 * R);  // depth of a facet below the sphere
  for (int j = 4; j < 17; ++j) {
    const double y = j + 0.5 - 10.2, exact = M_PI * (R * R - y * y);
    EXPECT_NEAR(area[j], exact, 2 * M_PI * R * chord) << j;
  }
  EXPECT_EQ(area[0], 0);
  // Red cell: the section is not convex, its sum over planes of a shifted grid is the volume.
  const auto cell = mesh::red_cell(40.0, 16);
  std::vector<double> fine(200, 0.0);
  add_cross_sections(
      [&](int k) {
        return mesh::Vec3{cell.vertices[k][0], cell.vertices[k][1] + 100.0, cell.vertices[k][2]};
      },
      cell.triangles, 1.0, fine);
  double sum = 0;
  for (const double a : fine) sum += a;
  EXPECT_NEAR(sum / mesh::volume(cell), 1, 1e-3);  // midpoint rule over 100 planes: h^2/24 max|A''| ~ 1e-4
}

}  // namespace
}  // namespace hemowalk::resolved
