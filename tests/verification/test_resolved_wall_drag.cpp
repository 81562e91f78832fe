// A sphere near a wall: its drag over the unbounded one against Faxen (along the wall) and Brenner (towards
// it).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "support/single_body.hpp"

namespace hemowalk::resolved {
namespace {

// Along the wall, height h of the centre over the radius (Faxen 1923).
double faxen(double h) {
  const double k = 1 / h;
  return 1 / (1 - 9 * k / 16 + k * k * k / 8 - 45 * std::pow(k, 4) / 256 - std::pow(k, 5) / 16);
}

// Towards a wall (Brenner 1961).
double brenner(double h) {
  const double a = std::acosh(h);
  double sum = 0;
  for (int n = 1; n < 60; ++n) {
    const double m = n + 0.5;
    const double top = 2 * std::sinh(2 * m * a) + 2 * m * std::sinh(2 * a);
    const double bottom = 4 * std::pow(std::sinh(m * a), 2) - 4 * m * m * std::pow(std::sinh(a), 2);
    sum += n * (n + 1.0) / ((2 * n - 1.0) * (2 * n + 3.0)) * (top / bottom - 1);
  }
  return 4.0 / 3 * std::sinh(a) * sum;
}

TEST(WallDrag, ExactFactors) {
  EXPECT_NEAR(brenner(100), 1 + 9.0 / 800, 3e-4);
  EXPECT_NEAR(faxen(100), 1 + 9.0 / 1600, 1e-4);
  EXPECT_NEAR(brenner(1.5431), 3.0361, 2e-3);  // Happel and Brenner, table 7-4.1: a = 1
}

// A sphere of 3 dx between walls 24 dx apart, 64 dx from its images along them. Between two walls the far one
// adds less than it would alone: half way the factors are 1 + 1.004 a/h along and 1 + 1.4515 a/h across
// (Happel and Brenner, chapter 7) with 9/16 and 9/8 for one wall, so it counts 0.785 and 0.29 times. Images
// pull along and the lattice errs by some hundredths: 6 %.
TEST(WallDrag, OfASphereAlongAndTowardsAWall) {
  const double a = 3, H = 24, L = 64, dx = 0.5;
  test::BodyCase c;
  c.shape = test::sphere_shape(a * dx), c.subdivision = 4, c.box = 14, c.dx = dx;
  c.offset = {0.3, 0.1, 0.2};
  const double radius = test::stokes_radius(c, 2) / dx;
  EXPECT_NEAR(radius, a, 0.1 * a);
  std::printf("h/a  axis  drag over the unbounded  exact\n");
  for (const double gap : {1.5, 2.0})
    for (const int axis : {2, 1}) {
      data::Scene scene = test::scene_of(c);
      scene.domain.size = {1e-6 * L * dx, 1e-6 * H * dx, 1e-6 * L * dx};
      scene.flow.type = data::Flow::Type::rest;
      data::Vec3 pull{};
      pull[axis] = 1e-13;
      scene.cells.loads = {{0, "+z", 1.0, pull}};
      scene.contact.model = data::Contact::Model::none;
      Simulation<double> sim(scene, {{0, {L / 2 + 0.3, gap * a, L / 2 + 0.2}, mesh::identity_rotation, {}}});
      for (int i = 0; i < 600; ++i) sim.step();  // exp(-5) of the slowest mode of the whole gap
      const auto& body = std::get<rigid::RigidBodies<double>>(sim.groups()[0].cells);
      const double speed = body.velocity(0)[axis], viscosity = (scene.fluid.tau - 0.5) / 3;
      const double factor = sim.units().force(1e-13) / (6 * M_PI * viscosity * radius * speed);
      const auto exact = [&](double h) { return axis == 1 ? brenner(h) : faxen(h); };
      const double expected =
          exact(gap * a / radius) + (axis == 1 ? 0.29 : 0.785) * (exact((H - gap * a) / radius) - 1);
      std::printf("%.1f  %c  %.3f  %.3f\n", gap, "xyz"[axis], factor, expected);
      EXPECT_NEAR(factor / expected, 1, 0.06) << gap << " " << axis;
    }
}

}  // namespace
}  // namespace hemowalk::resolved
