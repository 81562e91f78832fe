// Slip and leakage of a membrane in shear against the slip correction and the relaxation time. Prints a table
// of docs/evidence/validation.md.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "support/red_cells.hpp"

namespace hemowalk::resolved {
namespace {

struct Leak {
  double slip;    ///< root mean square over gamma a
  double volume;  ///< inside the coupling surface x - delta n, at the end over the start, minus 1
};

/// Neo-Hookean capsule, Ca 0.1, a = 5 dx, without any force of its own that keeps its volume, at a strain
/// of 1.
Leak leak(double theta, double tau) {
  const double a = 2.5e-6, rate = 100;
  data::Kind kind;
  kind.name = "capsule", kind.shape = test::sphere_shape(2.5), kind.law = data::Kind::Law::neo_hookean;
  kind.Gs = 1025e-6 * rate * a / (3 * 0.1), kind.kappa_damping = 0, kind.volume_modulus = 0;
  kind.bending.model = data::Bending::Model::none, kind.density = 1025;
  auto scene = test::shear_scene({12, 12, 12}, 50, {kind});
  scene.fluid.tau = tau;
  scene.coupling.theta_n = scene.coupling.theta_t = theta;
  Simulation<float> sim(scene, {{0, {12.2, 12, 12}, mesh::identity_rotation, {}}});
  const auto& cells = std::get<npfem::Membranes<float>>(sim.groups()[0].cells);
  const auto inside = [&] {
    mesh::TriangleMesh m{cells.positions(0), cells.rest().triangles};
    const auto normals = mesh::vertex_normals(m);
    for (int k = 0; k < cells.vertices(); ++k)
      mesh::accumulate(m.vertices[k], -scene.coupling.retraction, normals[k]);
    return mesh::volume(m);
  };
  const double volume = inside(), strain = sim.units().rate(rate);
  for (int i = 0; i < 1 / strain; ++i) sim.step();
  return {sim.slip_rms() / (strain * 5), inside() / volume - 1};
}

TEST(Leakage, FallsWithThetaAndGrowsWithTau) {
  std::printf("theta, tau | slip/(gamma a), volume error\n");
  const auto show = [](double theta, double tau) {
    const Leak l = leak(theta, tau);
    std::printf("%.2f  %.1f | %.5f %.6f\n", theta, tau, l.slip, l.volume);
    std::fflush(stdout);
    return l;
  };
  double before = 1;
  for (const double theta : {0.0, 0.5, 0.9, 0.97}) {
    const Leak l = show(theta, 2);
    EXPECT_LT(l.slip, before);
    before = l.slip;
  }
  // A marker's slip is (1 - theta) of its kick J/a, a force per area times dt: over gamma a it goes with tau
  // - 1/2.
  for (const double tau : {0.8, 1.2, 4.0}) {
    const Leak l = show(0.97, tau);
    EXPECT_NEAR(l.slip / (tau - 0.5), before / 1.5, 0.25 * before / 1.5) << "tau " << tau;
    EXPECT_LT(std::abs(l.volume), 2.5e-3 * (tau - 0.5)) << "tau " << tau;
  }
}

}  // namespace
}  // namespace hemowalk::resolved
