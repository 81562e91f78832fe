// The whole step on a handful of cells: momentum closes, threads and restarts change no bit, precision and
// acceleration change little.
#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>
#include <cstdio>
#include <cstring>

#include "core/check.hpp"
#include "resolved/simulation.hpp"
#include "support/blood_scene.hpp"
#include "support/cells.hpp"

namespace hemowalk::resolved {
namespace {

data::Scene small_scene(double acceleration = 32) { return test::plasma_scene({12, 14, 12}, acceleration); }

// Two red cells nearly touching, a platelet close to the moving wall. Lattice units.
std::vector<InitialCell> small_crowd() {
  return {{0, {12, 7.5, 12}, mesh::rotation({1, 0, 0}, 0.3), {}},
          {0, {15, 14.2, 10}, mesh::rotation({1, 0, 0.4}, 0.2), {}},
          {1, {12, 25.9, 12}, mesh::rotation({0, 0, 1}, 0.2), {}}};
}

template <class Real>
std::array<double, 3> residual(const Simulation<Real>& sim, std::array<double, 3> start, double& scale) {
  const Momentum m = sim.momentum();
  std::array<double, 3> r{};
  for (int d = 0; d < 3; ++d) {
    r[d] = m.fluid[d] + m.cells[d] + m.to_lower_wall[d] + m.to_upper_wall[d] - start[d];
    scale = std::max(scale, std::abs(m.to_upper_wall[d]));
  }
  return r;
}

template <class Real>
void expect_momentum_to_close(double relative) {
  Simulation<Real> sim(small_scene(), small_crowd());
  const auto start = sim.momentum().fluid;
  for (int i = 0; i < 300; ++i) sim.step();
  double scale = 0;
  const auto r = residual(sim, start, scale);
  EXPECT_GT(scale, 1);
  EXPECT_GT(sim.contact_summary().contacts, 0) << "the scene should exercise contact";
  for (int d = 0; d < 3; ++d) EXPECT_LT(std::abs(r[d]), relative * scale) << "component " << d;
}

// Round-off of some 1e4 nodes and 600 markers over 300 steps, relative to the impulse on a wall.
TEST(Simulation, MomentumOfFluidCellsAndWallsClosesInDouble) { expect_momentum_to_close<double>(1e-12); }
TEST(Simulation, MomentumOfFluidCellsAndWallsClosesInSingle) { expect_momentum_to_close<float>(1e-5); }

TEST(Simulation, ThreadsChangeNoBit) {
  std::vector<std::byte> first;
  for (const int threads : {1, 2, 3}) {
    omp_set_num_threads(threads);
    Simulation<float> sim(small_scene(), small_crowd());
    for (int i = 0; i < 40; ++i) sim.step();
    const auto state = sim.save();
    if (first.empty()) first = state;
    EXPECT_TRUE(first == state) << threads << " threads";
  }
  omp_set_num_threads(omp_get_num_procs());
}

TEST(Simulation, RestartChangesNoBit) {
  Simulation<float> whole(small_scene(), small_crowd());
  for (int i = 0; i < 30; ++i) whole.step();
  const auto middle = whole.save();
  for (int i = 0; i < 30; ++i) whole.step();
  Simulation<float> again(small_scene(), small_crowd());
  again.load({middle.data(), middle.size()});
  for (int i = 0; i < 30; ++i) again.step();
  EXPECT_TRUE(whole.save() == again.save());
}

TEST(Simulation, SinglePrecisionFollowsDouble) {
  Simulation<float> single(small_scene(), small_crowd());
  Simulation<double> twice(small_scene(), small_crowd());
  for (int i = 0; i < 200; ++i) single.step(), twice.step();
  for (std::size_t g = 0; g < single.groups().size(); ++g)
    for (int c = 0; c < single.groups()[g].count(); ++c) {
      const auto a = std::visit([&](const auto& x) { return x.observe(c); }, single.groups()[g].cells);
      const auto b = std::visit([&](const auto& x) { return x.observe(c); }, twice.groups()[g].cells);
      // Displacements here are of order 1 dx; single precision of the forces is of order 1e-4 relative.
      for (int d = 0; d < 3; ++d) EXPECT_NEAR(a.centre[d], b.centre[d], 1e-3);
      EXPECT_NEAR(a.volume / b.volume, 1, 1e-5);
      EXPECT_NEAR(a.taylor_deformation, b.taylor_deformation, 1e-4);
    }
}

// One strain at two accelerations: same physical motion up to inertia, O(s Re) with Re = 1.5e-3.
TEST(Simulation, AccelerationLeavesThePhysicsOfOneCell) {
  mesh::Observables seen[2];
  const double s[2] = {10, 20};
  for (int i = 0; i < 2; ++i) {
    Simulation<double> sim(small_scene(s[i]), {{0, {12, 14, 12}, mesh::rotation({1, 0, 0}, 0.5), {}}});
    while (sim.time() < 4e-3) sim.step();
    seen[i] = std::visit([](const auto& g) { return g.observe(0); }, sim.groups()[0].cells);
  }
  EXPECT_NEAR(seen[0].inclination, seen[1].inclination, 0.01);
  EXPECT_NEAR(seen[0].taylor_deformation, seen[1].taylor_deformation, 0.003);
  EXPECT_GT(std::abs(seen[0].inclination + 0.5), 0.08) << "the cell should have turned";
}

// coupling.integrator: the membranes' part of a step by implicit Euler or by Runge-Kutta. Both tend to the
// same motion with the step, which in physical time is as long as the acceleration: their difference is that
// of the first-order one and halves with it. A soft capsule, stretched at first, in shear over a strain of
// 0.4.
TEST(Simulation, RungeKuttaMovesASoftCapsuleAsTheImplicitStepToFirstOrder) {
  const auto shape = [](double acceleration, data::Coupling::Integrator integrator) {
    data::Scene scene = test::plasma_scene({12, 12, 12}, acceleration);
    scene.flow.walls = data::Flow::Walls::both;
    data::Kind& capsule = scene.cells.kinds[0];
    capsule.shape.type = data::Shape::Type::sphere, capsule.shape.radii = {2.5e-6, 2.5e-6, 2.5e-6};
    capsule.subdivision = 6;
    capsule.law = data::Kind::Law::neo_hookean, capsule.bending.model = data::Bending::Model::none;
    capsule.kappa_damping = 0;
    scene.coupling.integrator = integrator, scene.coupling.iterations = 6;
    InitialCell cell{0, {12, 12, 12}, mesh::identity_rotation, mesh::sphere(5, 6).vertices};
    for (auto& x : cell.vertices) x = {12 + x[0] / 1.1, 12 + x[1], 12 + 1.1 * x[2]};
    Simulation<double> sim(scene, {cell});
    while (sim.time() < 4e-3 - 1e-9) sim.step();
    return std::get<npfem::Membranes<double>>(sim.groups()[0].cells).positions(0);
  };
  using Integrator = data::Coupling::Integrator;
  double difference[3];
  for (int i = 0; i < 3; ++i) {
    const double s = 64 >> i;
    difference[i] =
        support::largest_difference(shape(s, Integrator::implicit), shape(s, Integrator::runge_kutta));
    std::printf("[ integrat ] acceleration %g: largest difference %.2e dx\n", s, difference[i]);
  }
  EXPECT_NEAR(std::log2(difference[0] / difference[1]), 1, 0.1);
  EXPECT_NEAR(std::log2(difference[1] / difference[2]), 1, 0.05);
  EXPECT_LT(difference[2], 1e-3);
}

TEST(Simulation, CellsKeepTheirVolumeAndDoNotSlip) {
  Simulation<float> sim(small_scene(), small_crowd());
  for (int i = 0; i < 400; ++i) sim.step();
  for (int c = 0; c < 2; ++c) {
    const auto& g = std::get<npfem::Membranes<float>>(sim.groups()[0].cells);
    EXPECT_NEAR(g.volume(c) / g.rest_volume(), 1, 0.01);
  }
  const double wall_speed = sim.units().velocity(100 * 14e-6);
  EXPECT_LT(sim.slip_rms(), 0.02 * wall_speed);
}

TEST(Simulation, BlowUpNamesCellAndStep) {
  data::Scene scene = small_scene(60);
  scene.cells.loads = {{0, "+z", 0.02, {0, 0, 1e-3}}};  // a thousand million times a red cell's strength
  Simulation<float> sim(scene, small_crowd());
  try {
    for (int i = 0; i < 200; ++i) sim.step();
    FAIL() << "survived";
  } catch (const PhysicsError& error) {
    EXPECT_TRUE(std::string(error.what()).find("cell") != std::string::npos ||
                std::string(error.what()).find("marker") != std::string::npos ||
                std::string(error.what()).find("body") != std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace hemowalk::resolved
