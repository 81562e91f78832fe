// How far may rates be raised at constant capillary number? Single-cell and pair quantities against the
// smallest acceleration (method 6). HEMOWALK_ACCELERATIONS=1,4,8,16,32 chooses; the first is the reference.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <sstream>

#include "resolved/recovery.hpp"
#include "resolved/simulation.hpp"
#include "support/blood_scene.hpp"

namespace hemowalk::resolved {
namespace {

std::vector<double> accelerations() {
  const char* chosen = std::getenv("HEMOWALK_ACCELERATIONS");
  std::stringstream list(chosen ? chosen : "4,8,16,32");
  std::vector<double> s;
  for (std::string word; std::getline(list, word, ',');) s.push_back(std::atof(word.c_str()));
  return s;
}

data::Scene couette(const data::Vec3& size, double acceleration) {
  data::Scene scene = test::blood_scene(size, 0);
  scene.cells.hematocrit.reset();
  scene.flow.walls = data::Flow::Walls::both;
  scene.acceleration = acceleration;
  scene.cells.kinds[0].kappa_damping = 0.5;
  return scene;
}

const npfem::Membranes<float>& membranes(const Simulation<float>& sim) {
  return std::get<npfem::Membranes<float>>(sim.groups().front().cells);
}

/// Mean angular velocity of a material point of the membrane over the shear rate, from \p from to \p to (s).
double membrane_rotation(Simulation<float>& sim, double from, double to) {
  const auto angle = [&] { return membranes(sim).observe(0).tank_treading_angle; };
  double last = angle(), turned = 0, first = 0, began = -1;
  for (std::int64_t step = 1; sim.time() < to; ++step) {
    sim.step();
    if (step % 100) continue;
    const double now = angle();
    turned += std::remainder(now - last, 2 * M_PI), last = now;
    if (began < 0 && sim.time() >= from) began = sim.time(), first = turned;
  }
  return std::abs(turned - first) / (sim.time() - began) / sim.scene().flow.shear_rate;
}

/// A red cell lying askew in shear: it turns over or its membrane goes round, whatever it likes.
double red_cell_rotation(double s) {
  const data::Scene scene = couette({12, 14, 12}, s);
  Simulation<float> sim(scene, {{0, {12, 14, 12}, mesh::rotation({1, 0, 0}, 0.6), {}}});
  return membrane_rotation(sim, 20e-3, 90e-3);
}

/// Tank-treading neo-Hookean capsule at Ca = mu gamma a/G_s = 0.1.
double capsule_treading(double s) {
  data::Scene scene = couette({12, 14, 12}, s);
  auto& kind = scene.cells.kinds[0];
  kind.shape.type = data::Shape::Type::sphere;
  kind.shape.radii = {3e-6, 3e-6, 3e-6};
  kind.law = data::Kind::Law::neo_hookean;
  kind.Gs = scene.fluid.density * scene.fluid.kinematic_viscosity * scene.flow.shear_rate * 3e-6 / 0.1;
  kind.bending.model = data::Bending::Model::none;
  Simulation<float> sim(scene, {{0, {12, 14, 12}, mesh::identity_rotation, {}}});
  return membrane_rotation(sim, 20e-3, 60e-3);
}

/// ms, at kappa 0.5.
double recovery(double s) { return 1e3 * recovery_time(couette({12, 12, 12}, 1), s); }

/// Net displacement across the stream of a red cell that passes another one 3 um above it, um.
double pair_displacement(double s) {
  const data::Scene scene = couette({12, 18, 24}, s);
  const double centre = 18;
  Simulation<float> sim(scene, {{0, {12, centre - 3, 30}, mesh::rotation({1, 0, 0}, 0.3), {}},
                                {0, {12, centre + 3, 18}, mesh::rotation({1, 0, 0}, 0.3), {}}});
  const auto at = [&](int c, int d) { return membranes(sim).observe(c).centre[d]; };
  const double before = at(1, 1) - at(0, 1);
  // From 12 dx behind to 12 dx ahead.
  for (std::int64_t step = 1; sim.time() < 0.15; ++step) {
    sim.step();
    if (step % 50 == 0 && at(1, 2) - at(0, 2) > 12) break;
  }
  return sim.units().to_length(at(1, 1) - at(0, 1) - before) * 1e6 / 2;
}

/// \p allowed: largest relative deviation at each acceleration up to 16 (at 32 it is only printed).
void compare(const char* what, const std::function<double(double)>& measure, double allowed) {
  double reference = 0;
  std::printf("| %s |", what);
  for (const double s : accelerations()) {
    const double value = measure(s);
    if (reference == 0) reference = value;
    std::printf(" %.4f (%+.2f %%) |", value, 100 * (value / reference - 1));
    std::fflush(stdout);
    EXPECT_TRUE(std::isfinite(value) && value != 0);
    if (s <= 16) EXPECT_NEAR(value / reference, 1, allowed) << what << " at acceleration " << s;
  }
  std::printf("\n");
}

TEST(Acceleration, RedCellRotation) { compare("red cell: membrane rotation/γ", red_cell_rotation, 0.02); }
TEST(Acceleration, CapsuleTreading) { compare("capsule, Ca 0.1: tank-treading/γ", capsule_treading, 0.02); }
TEST(Acceleration, RecoveryTime) { compare("red cell: recovery time, ms", recovery, 0.02); }
TEST(Acceleration, PairDisplacement) { compare("two red cells: displacement, µm", pair_displacement, 0.05); }

}  // namespace
}  // namespace hemowalk::resolved
