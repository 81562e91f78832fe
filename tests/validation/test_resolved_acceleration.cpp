// How far may rates be raised at constant capillary number? Single-cell and pair quantities against the
// smallest acceleration (method 6). HEMOWALK_ACCELERATIONS=1,4,8,16,32 chooses; the first is the reference.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <numeric>
#include <random>

#include "core/statistics.hpp"
#include "resolved/packing.hpp"
#include "resolved/recovery.hpp"
#include "resolved/simulation.hpp"
#include "support/blood_scene.hpp"
#include "support/environment.hpp"

namespace hemowalk::resolved {
namespace {

std::vector<double> accelerations() { return test::accelerations("4,8,16,32"); }

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
    if (s <= 16) {
      EXPECT_NEAR(value / reference, 1, allowed) << what << " at acceleration " << s;
    }
  }
  std::printf("\n");
}

/// Half the mean square displacement across the stream over 10 ms, per lag and cell, um^2/s, in the 20 um box
/// at 35 %: [kind][cell], from 10 ms to 60 ms, all origins. The packing is the same at every acceleration.
std::vector<std::vector<double>> diffusivities(double s) {
  data::Scene scene = test::blood_scene({20, 20, 20}, 0.35);
  scene.flow.walls = data::Flow::Walls::both;
  scene.acceleration = s;
  scene.cells.kinds[0].kappa_damping = 0.5;
  Simulation<float> sim(scene, pack(scene));
  const auto steps = std::llround(sim.units().steps(0.5e-3));
  constexpr int first = 20, samples = 120, lag = 20;  // of 0.5 ms
  std::vector<std::vector<std::vector<double>>> y;    // [kind][cell][sample]
  for (const auto& group : sim.groups())
    y.emplace_back(
        std::visit([](const auto& g) { return static_cast<std::size_t>(g.count()); }, group.cells));
  for (int k = 0; k <= samples; ++k) {
    for (std::size_t g = 0; g < y.size(); ++g)
      std::visit(
          [&](const auto& cells) {
            for (int c = 0; c < cells.count(); ++c)
              y[g][static_cast<std::size_t>(c)].push_back(1e6 *
                                                          sim.units().to_length(cells.observe(c).centre[1]));
          },
          sim.groups()[g].cells);
    for (std::int64_t i = 0; i < steps && k < samples; ++i) sim.step();
  }
  std::vector<std::vector<double>> d(y.size());
  for (std::size_t g = 0; g < y.size(); ++g)
    for (const auto& path : y[g]) {
      double sum = 0;
      for (int k = first; k + lag <= samples; ++k) {
        const double moved = path[static_cast<std::size_t>(k + lag)] - path[static_cast<std::size_t>(k)];
        sum += moved * moved / (2 * 10e-3);
      }
      d[g].push_back(sum / (samples - lag - first + 1));
    }
  return d;
}

/// D against the smallest acceleration's, cell by cell: the error is that of the ratio, from resampled cells.
TEST(Acceleration, Diffusivity) {
  std::vector<std::vector<double>> reference;
  std::printf(
      "| acceleration | red cells: D, um2/s | against the first | platelets: D | against the first |\n");
  for (const double s : accelerations()) {
    const auto d = diffusivities(s);
    if (reference.empty()) reference = d;
    std::printf("| %g |", s);
    for (std::size_t g = 0; g < d.size(); ++g) {
      const std::size_t n = d[g].size();
      std::mt19937 random(1);
      std::uniform_int_distribution<std::size_t> pick(0, n - 1);
      std::vector<double> value, ratio;
      for (int draw = 0; draw < 1000; ++draw) {
        double now = 0, then = 0;
        for (std::size_t c = 0; c < n; ++c) {
          const std::size_t k = pick(random);
          now += d[g][k], then += reference[g][k];
        }
        value.push_back(now / static_cast<double>(n)), ratio.push_back(now / then - 1);
      }
      const double mean = std::accumulate(d[g].begin(), d[g].end(), 0.0),
                   base = std::accumulate(reference[g].begin(), reference[g].end(), 0.0);
      std::printf(" %.1f +- %.1f | %+.2f +- %.2f %% |", mean / static_cast<double>(n),
                  standard_deviation(value), 100 * (mean / base - 1), 100 * standard_deviation(ratio));
      if (g == 0 && s <= 16) {
        EXPECT_LT(std::abs(mean / base - 1), 0.05 + 3 * standard_deviation(ratio));
      }
    }
    std::printf("\n");
    std::fflush(stdout);
  }
}

TEST(Acceleration, RedCellRotation) { compare("red cell: membrane rotation/γ", red_cell_rotation, 0.02); }
TEST(Acceleration, CapsuleTreading) { compare("capsule, Ca 0.1: tank-treading/γ", capsule_treading, 0.02); }
TEST(Acceleration, RecoveryTime) { compare("red cell: recovery time, ms", recovery, 0.02); }
TEST(Acceleration, PairDisplacement) { compare("two red cells: displacement, µm", pair_displacement, 0.05); }

}  // namespace
}  // namespace hemowalk::resolved
