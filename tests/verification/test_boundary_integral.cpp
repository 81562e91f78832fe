// The boundary integral that the coupled solver is validated against, against exact Stokes flow.
#include "support/boundary_integral.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "resolved/mesh/observables.hpp"
#include "resolved/mesh/shapes.hpp"

namespace hemowalk {
namespace {

using mesh::Vec3;

// A sphere under uniform traction translates as a whole, 6 pi mu a U = F; under tractions 3 mu w x n it turns
// with w. Errors of the flat triangles fall with the square of their size.
TEST(BoundaryIntegral, SphereTranslatesAndTurnsByStokes) {
  double before[2] = {1, 1};
  for (const int n : {4, 8, 16}) {
    const auto sphere = mesh::sphere(1, n);
    const test::BoundaryIntegral fluid(sphere, 1);
    const auto area = mesh::vertex_areas(sphere);
    double total = 0;
    for (const double a : area) total += a;
    std::vector<Vec3> push, twist;
    for (std::size_t k = 0; k < area.size(); ++k) {
      push.push_back({6 * M_PI * area[k] / total, 0, 0});
      twist.push_back(mesh::scale(3 * area[k], mesh::cross({0, 0, 1}, sphere.vertices[k])));
    }
    const auto mobility = fluid.mobility(sphere.vertices);
    const auto moves = [&](const std::vector<Vec3>& force) {
      return test::BoundaryIntegral::vectors(mobility * test::BoundaryIntegral::columns(force));
    };
    const auto u = moves(push), w = moves(twist);
    double worst[2] = {0, 0};
    for (std::size_t k = 0; k < area.size(); ++k) {
      worst[0] = std::max(worst[0], mesh::norm(mesh::subtract(u[k], {1, 0, 0})));
      worst[1] =
          std::max(worst[1], mesh::norm(mesh::subtract(w[k], mesh::cross({0, 0, 1}, sphere.vertices[k]))));
    }
    std::printf("n = %d: %.5f %.5f\n", n, worst[0], worst[1]);
    for (int i = 0; i < 2; ++i) {
      EXPECT_LT(worst[i], i ? 1.3 / (n * n) : 0.6 / (n * n));
      EXPECT_LT(worst[i], before[i] / 3);
      before[i] = worst[i];
    }
  }
}

// D = (25/12) mu gamma a/G_s for a neo-Hookean sphere that deforms little (Barthes-Biesel and Rallison 1981).
TEST(BoundaryIntegral, StiffCapsuleDeformsAsInTheLimit) {
  const double Ca = 0.004;  // mu gamma a/(3 G_s)
  for (const int n : {4, 6}) {
    const auto sphere = mesh::sphere(1, n);
    npfem::Material material;
    material.law = npfem::Law::neo_hookean, material.Gs = 1 / (3 * Ca);
    material.bending = npfem::Bending::none, material.volume_modulus = 0;
    const npfem::CellType type(sphere, material, std::vector<double>(sphere.vertices.size(), 1.0), 1);
    test::MembraneInStokesFlow capsule(
        type, sphere, 1,
        [](const Vec3& p) {
          return Vec3{0, 0, p[1]};
        },
        sphere.vertices);
    for (int i = 0; i < 16; ++i) capsule.advance(0.025);
    const auto seen = mesh::observe(sphere, capsule.vertices(), mesh::marker_vertex(sphere));
    const double ratio = seen.taylor_deformation / (6.25 * Ca);
    std::printf("n = %d: D over the exact one %.4f, volume %.6f\n", n, ratio,
                seen.volume / type.rest_volume());
    EXPECT_NEAR(ratio, 1, 1.2 / (n * n));
    EXPECT_NEAR(seen.volume / type.rest_volume(), 1, 1e-3);
  }
}

/// A soft capsule in shear at a strain of 1.6, moved there by \p move.
double deformation(const std::function<void(test::MembraneInStokesFlow&)>& move) {
  const auto sphere = mesh::sphere(1, 3);
  npfem::Material material;
  material.law = npfem::Law::neo_hookean, material.Gs = 4;
  material.bending = npfem::Bending::none, material.volume_modulus = 0;
  const npfem::CellType type(sphere, material, std::vector<double>(sphere.vertices.size(), 1.0), 1);
  test::MembraneInStokesFlow capsule(
      type, sphere, 1,
      [](const Vec3& p) {
        return Vec3{0, 0, p[1]};
      },
      sphere.vertices);
  move(capsule);
  return mesh::observe(sphere, capsule.vertices(), mesh::marker_vertex(sphere)).taylor_deformation;
}
double in_steps(int steps) {
  return deformation([&](test::MembraneInStokesFlow& capsule) {
    for (int i = 0; i < steps; ++i) capsule.step(1.6 / steps);
  });
}

// Steps many times longer than the stiffest mode of the membrane lives, of second order.
TEST(BoundaryIntegral, StepsAreOfSecondOrder) {
  const double exact = in_steps(320), coarse = in_steps(20) - exact, fine = in_steps(40) - exact;
  std::printf("D %.6f, with 20 and 40 steps %+.2e %+.2e\n", exact, coarse, fine);
  EXPECT_GT(std::abs(coarse), 3 * std::abs(fine));
  EXPECT_LT(std::abs(fine), 1e-3 * exact);
}

// In one step the capsule is lost; advance() finds steps that keep its error small.
TEST(BoundaryIntegral, TakesTheStepsThatTheErrorAllows) {
  const double exact = in_steps(320);
  EXPECT_FALSE(std::abs(in_steps(1) / exact - 1) < 0.1);
  for (const double tolerance : {1e-3, 1e-4}) {
    const double error =
        deformation([&](test::MembraneInStokesFlow& capsule) { capsule.advance(1.6, tolerance); }) / exact -
        1;
    std::printf("tolerance %.0e: %+.1e\n", tolerance, error);
    EXPECT_LT(std::abs(error), 10 * tolerance);
  }
}

}  // namespace
}  // namespace hemowalk
