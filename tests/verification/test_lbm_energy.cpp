// The fluid's energy budget over single steps: what walls and forces put in is lost to the stress or kept.

#include <gtest/gtest.h>

#include "support/lbm_flows.hpp"

namespace hemowalk::lbm {
namespace {

using namespace hemowalk::test;

struct Budget {
  double missing = 0;  ///< of one step, over the sum of magnitudes
  EnergyFlows flows;
  double walls = 0;  ///< work of the moving walls
};

template <class Real>
Budget step_with_budget(Fluid<Real>& fluid, View<const Node4<Real>> force) {
  Budget b;
  b.flows = fluid.energy(force);
  fluid.collide_and_stream(force);
  const WallImpulse taken = fluid.wall_impulse();
  const Parameters& p = fluid.parameters();
  for (int d = 0; d < 3; ++d)
    b.walls -= p.lower_wall_velocity[d] * taken.lower[d] + p.upper_wall_velocity[d] * taken.upper[d];
  const EnergyFlows& e = b.flows;
  const double kept = fluid.energy({}).held - e.held;
  const double size =
      std::abs(b.walls) + std::abs(e.force) + std::abs(e.body_force) + e.viscous + e.stressless;
  b.missing = (b.walls + e.force + e.body_force - e.viscous - e.stressless - kept) / size;
  return b;
}

Parameters moving(double speed, Collision collision, double tau) {
  Parameters p;
  p.collision = collision, p.tau = tau;
  p.lower_wall_velocity = {-0.3 * speed, 0, -speed}, p.upper_wall_velocity = {0, 0, speed};
  return p;
}

/// An unsteady flow with walls, static solid and forces on every node. The budget is that of the linear
/// collision: what is missing is cubic in the velocity, so a tenth of the velocity leaves a tenth of it.
TEST(EnergyBudget, ClosesUpToTermsCubicInTheVelocity) {
  const Block block{12, 10, 9};
  for (const auto collision : {Collision::trt, Collision::bgk})
    for (const double tau : {0.8, 2.0}) {
      double before = 0;
      for (const double speed : {1e-2, 1e-3, 1e-4}) {
        auto p = moving(speed, collision, tau);
        p.body_force = {0, 0, 0.02 * speed};
        Fluid<double> fluid(block, p);
        fluid.set_solid([](int i, int j, int k) { return i == 4 && j > 3 && j < 7 && k > 2 && k < 6; });
        fluid.initialise([](double) { return 0.0; });
        RandomForce<double> force(block, 0.1 * speed);
        double worst = 0;
        for (int t = 0; t < 20; ++t) {
          force.next();
          worst = std::max(worst, std::abs(step_with_budget(fluid, force.view()).missing));
        }
        EXPECT_LT(worst, speed) << "tau " << tau;
        if (speed == 1e-4) {
          EXPECT_NEAR(before / worst, 10, 0.5) << "tau " << tau;
        }
        before = worst;
      }
    }
}

/// Couette flow is linear in y: the lattice's stress is exact, and every term of the budget with it.
TEST(EnergyBudget, CouetteFlowIsExact) {
  const Block block{6, 16, 5};
  const double U = 0.05;
  for (const auto collision : {Collision::trt, Collision::bgk}) {
    Parameters p;
    p.collision = collision;
    p.upper_wall_velocity = {0, 0, U};
    Fluid<double> fluid(block, p);
    fluid.initialise([&](double y) { return U * y / block.ny; });
    const Budget b = step_with_budget<double>(fluid, {});
    const double exact =
        fluid.viscosity() * U * U / block.ny * block.nx * block.nz;  // mu U^2/H times the area
    EXPECT_NEAR(b.walls / exact, 1, 1e-12);
    EXPECT_NEAR(b.flows.viscous / exact, 1, 1e-12);
    EXPECT_LT(std::abs(b.flows.stressless), 1e-12 * exact);
    EXPECT_LT(std::abs(b.missing), 1e-12);
  }
}

/// Poiseuille flow: the body force feeds what the stress loses. The stress at the nodes is exact for a
/// parabola, and sums over nodes are midpoint rules: the stress loses 1 - 1/H^2 of the exact power, the force
/// feeds 1 + 1/(2 H^2) of it. The odd modes that carry the curvature lose the difference, so the sum closes;
/// a body force g on a flow u leaves terms of relative size u^2 (here 1e-6).
TEST(EnergyBudget, PoiseuilleFlowLosesItsShareOfOrderTwoOffTheStress) {
  for (const int H : {8, 16, 32}) {
    const Block block{3, H, 4};
    const double U = 1e-3;
    Parameters p;
    const double nu = (p.tau - 0.5) / 3;
    p.body_force = {0, 0, 8 * nu * U / (H * H)};
    Fluid<double> fluid(block, p);
    fluid.initialise([&](double y) { return 4 * U * y * (H - y) / (H * H); });
    for (int t = 0; t < 12 * H * H / (M_PI * M_PI * nu); ++t) fluid.collide_and_stream({});
    const Budget b = step_with_budget<double>(fluid, {});
    const double expected = (1 - 1.0 / (H * H)) / (1 + 0.5 / (H * H));
    EXPECT_NEAR(b.flows.viscous / b.flows.body_force, expected, 1e-6) << "H " << H;
    EXPECT_LT(std::abs(b.missing), 1e-6) << "H " << H;
  }
}

/// Single precision rounds every population by up to half an ulp per step: the energy held, of order j^2/2,
/// moves by ulp times the root of held: small against the viscous loss of a sheared flow.
TEST(EnergyBudget, ClosesInSinglePrecision) {
  const Block block{12, 12, 12};
  Fluid<float> fluid(block, moving(0.02, Collision::trt, 2));
  RandomForce<float> force(block, 1e-3);
  for (int t = 0; t < 20; ++t) {
    force.next();
    EXPECT_LT(std::abs(step_with_budget(fluid, force.view()).missing), 0.02);
  }
}

}  // namespace
}  // namespace hemowalk::lbm
