// Spheres against walls and each other, where the integral of the pressure over the surface is known.
#include <gtest/gtest.h>

#include "core/check.hpp"
#include "tests/support/contact_bodies.hpp"

using namespace hemowalk;
using namespace hemowalk::contact;
using test::ContactBodies;

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr Law law{1.0, 0.7, 1.0, 0.3};

/// Force of a plane on a sphere of radius R whose lowest point is at gap h: every ring dA = 2 pi R dy feels
/// K (rc - g)^2/rc straight up, so F = 2 pi R K (rc - h)^3/(3 rc).
double sphere_on_plane(double R, double h) {
  return 2 * pi * R * law.stiffness * std::pow(law.range - h, 3) / (3 * law.range);
}

/// Force between two spheres of radius R with centres D apart, pressure K (rc - g)^2/rc/2 from each one's
/// surface on the other along the line to the other's centre; by symmetry twice the integral over one, by
/// Simpson's rule.
double sphere_on_sphere(double R, double D) {
  const int n = 20000;
  const double reach = R + law.range;  // points of sphere 1 within this distance of centre 2
  const double cosine = (R * R + D * D - reach * reach) / (2 * R * D);
  double sum = 0;
  for (int i = 0; i <= n; ++i) {
    const double c = cosine + (1 - cosine) * i / n;  // cos of the polar angle towards the other sphere
    const double r = std::sqrt(R * R + D * D - 2 * R * D * c), depth = law.range - (r - R);
    const double along = (D - R * c) / r;  // of the line to centre 2 on the axis
    const double f = depth > 0 ? law.stiffness / 2 * depth * depth / law.range * along : 0;
    sum += f * (i == 0 || i == n ? 1 : i % 2 ? 4 : 2);
  }
  return 2 * 2 * pi * R * R * sum * (1 - cosine) / n / 3;
}

struct Result {
  double force, energy, virial;
};
Result touching_spheres(int n, double R, double D, const mesh::Quaternion& q) {
  ContactBodies<double> set;
  const int shape = set.add_shape(mesh::sphere(R, n));
  set.add(shape, {20, 20, 20}, q);
  set.add(shape, {20, 20 + D, 20}, mesh::multiply(mesh::rotation({1, 2, 3}, 0.7), q));
  auto contact = set.contact(law);
  const Summary sum = set.compute(contact);
  double force = 0;
  for (std::size_t v = 0; v < set.vertices(1); ++v) force += set.force[set.bodies[1].first + v].y;
  return {force, sum.energy, sum.virial[1]};
}

}  // namespace

// A mesh of spacing d sits inside its sphere by up to d^2/(8 R) and samples the pressure at its vertices:
// second order. Errors at n = 8, 16, 32 must fall by 4 each time; 2.5 allows for where vertices happen to
// fall.
TEST(ContactSpheres, PlaneForceConvergesToTheIntegral) {
  const double R = 6, h = 0.3, exact = sphere_on_plane(R, h);
  double error[3];
  for (int level = 0; level < 3; ++level) {
    error[level] = 0;
    const int orientations = 24;  // mean square over orientations: no accident of one vertex
    for (int o = 0; o < orientations; ++o) {
      ContactBodies<double> set;
      const int shape = set.add_shape(mesh::sphere(R, 8 << level));
      set.add(shape, {20, R + h, 20}, mesh::rotation({std::sin(o), 1, std::cos(3.0 * o)}, 0.9 * o));
      auto contact = set.contact(law, Domain{{0, 0, 0}, {Walls::Geometry::slab, 0, 40, 0, 0, 0}});
      const Summary sum = set.compute(contact);
      error[level] += std::pow(-sum.wall_force[0][1] / exact - 1, 2) / orientations;
      EXPECT_EQ(sum.wall_force[1][1], 0);
      EXPECT_NEAR(sum.minimum_wall_gap, h, 0.35 * std::pow(1.6 * R / (8 << level), 2) / R);
    }
    error[level] = std::sqrt(error[level]);
  }
  EXPECT_LT(error[1], error[0] / 2.5);
  EXPECT_LT(error[2], error[1] / 2.5);
  EXPECT_LT(error[2], 0.01);
}

TEST(ContactSpheres, PairForceConvergesToTheIntegral) {
  const double R = 6;
  for (const double h : {0.5, 0.0, -0.4}) {
    const double exact = sphere_on_sphere(R, 2 * R + h);
    double error[3];
    for (int level = 0; level < 3; ++level) {
      error[level] = 0;
      const int orientations = 24;
      for (int o = 0; o < orientations; ++o)
        error[level] +=
            std::pow(touching_spheres(8 << level, R, 2 * R + h,
                                      mesh::rotation({std::sin(o), 1, std::cos(3.0 * o)}, 0.9 * o))
                                 .force /
                             exact -
                         1,
                     2) /
            orientations;
      error[level] = std::sqrt(error[level]);
    }
    EXPECT_LT(error[1], error[0] / 2.5) << "gap " << h;
    EXPECT_LT(error[2], error[1] / 2.5) << "gap " << h;
    EXPECT_LT(error[2], 0.02) << "gap " << h;
  }
}

// Coming closer along the centre line: work done equals the energy stored (trapezoidal rule, error of order
// step^2), force and energy start smoothly at the range.
TEST(ContactSpheres, WorkBecomesEnergy) {
  const double R = 6, step = 0.01;
  const mesh::Quaternion q = mesh::rotation({1, 1, 0}, 0.4);
  double work = 0, before = 0;
  for (double h = 1.1; h > -0.5; h -= step) {
    const Result now = touching_spheres(16, R, 2 * R + h, q);
    work += (now.force + before) / 2 * step;
    const double rule =
        step * std::abs(now.force - before) / 12;  // of the last step; all steps together are alike
    before = now.force;
    if (h >= 1.0 + 0.01) {
      EXPECT_EQ(now.energy, 0);
    }
    ASSERT_NEAR(work, now.energy, 2 * rule + 1e-8) << h;
  }
  EXPECT_GT(work, 1);
}

// A vertex at radius r in a tube of radius Rt is pushed to the axis with K A (rc - g)^2/rc, g = Rt - r.
TEST(ContactSpheres, TubeWall) {
  ContactBodies<double> set;
  const int shape = set.add_shape(mesh::sphere(4, 12));
  set.add(shape, {20 + 5.5, 20, 20});
  const Domain tube{{0, 0, 40}, {Walls::Geometry::tube, 0, 0, 20, 20, 10}};
  auto contact = set.contact(law, tube);
  const Summary sum = set.compute(contact);
  double force = 0, energy = 0;
  for (std::size_t v = 0; v < set.vertices(0); ++v) {
    const mesh::Vec3 x = set.at(0, v);
    const double r = std::hypot(x[0] - 20, x[1] - 20), depth = law.range - (10 - r);
    if (depth <= 0) continue;
    const double f = law.stiffness * set.shapes[0].area[v] * depth * depth / law.range;
    force += f * (x[0] - 20) / r;
    energy += f * depth / 3;
  }
  ASSERT_GT(force, 0);
  EXPECT_NEAR(sum.wall_force[0][0], force, 1e-12 * force);
  EXPECT_NEAR(sum.wall_force[0][1], 0, 1e-12 * force);
  EXPECT_NEAR(sum.energy, energy, 1e-12 * energy);
  EXPECT_NEAR(sum.minimum_wall_gap, 0.5, 1e-12);
}

// Two flat plates of many vertices, parallel at a gap g: the pressure is K (rc - g)^2/rc whatever the meshes.
TEST(ContactSpheres, PressureBetweenFlatSidesIsTheStatedOne) {
  // Flat ellipsoids as plates: near the axis they are parallel to order (r/20)^2.
  const double gap = 0.25;
  ContactBodies<double> set;
  const int shape = set.add_shape(mesh::ellipsoid({60, 1, 60}, 40));
  set.add(shape, {80, 20, 80}, mesh::rotation({0, 1, 0}, 0.3));
  set.add(shape, {80, 22 + gap, 80});
  auto contact = set.contact(law);
  set.compute(contact);
  // Force on the lower plate's top within a disc, own vertices and reactions of the upper ones, over its
  // area.
  double force = 0, area = 0;
  for (std::size_t v = 0; v < set.vertices(0); ++v) {
    const mesh::Vec3 x = set.at(0, v);
    if (std::hypot(x[0] - 80, x[2] - 80) > 6 || x[1] < 20) continue;
    force -= set.force[v].y;
    area += set.shapes[0].area[v];
  }
  const double pressure = law.stiffness * std::pow(law.range - gap, 2) / law.range;
  // Within r = 6 the gap grows by 2 (1 - sqrt(1 - (6/60)^2)) = 0.010 at the rim: pressure falls by up to 2.7
  // %; the patch's edge shares reactions with its neighbours: one ring of spacing 2.4 dx on 6, averaged out
  // to some per cent.
  EXPECT_NEAR(force / area, pressure, 0.05 * pressure);
}

TEST(ContactSpheres, OverlapIsMeasuredHoweverDeep) {
  ContactBodies<double> set;
  const int large = set.add_shape(mesh::sphere(8, 12)), small = set.add_shape(mesh::sphere(1, 3));
  set.add(large, {20, 20, 20});
  set.add(small, {20 + 21, 20, 20 - 40});  // in the middle of an image of the large one
  const auto measure = [&] {
    return measure_overlap(Domain{{21, 0, 20}, {}}, set.shapes, set.bodies, set.origins(), set.positions(),
                           3.0);
  };
  const Overlap deep = measure();
  EXPECT_EQ(deep.inside, static_cast<std::int64_t>(set.vertices(1)));
  EXPECT_LT(deep.minimum_gap, -6.8);
  EXPECT_EQ(deep.first, 1);
  EXPECT_EQ(deep.second, 0);
  set.origin[1][1] += 11;  // centres 11 apart: gap 2
  const Overlap apart = measure();
  EXPECT_EQ(apart.inside, 0);
  EXPECT_NEAR(apart.minimum_gap, 2, 0.06);  // the meshes lie inside their spheres by d^2/(8R) at most
}
