// Invariants of a suspension: the 20 um box at 35 % over 22 ms, and with HEMOWALK_BOX=50 the 50 um box over
// 10 000 steps at acceleration 16. Prints the tables of docs/evidence/resolved.md.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "resolved/packing.hpp"
#include "resolved/simulation.hpp"
#include "support/blood_scene.hpp"
#include "support/figure.hpp"

namespace hemowalk::resolved {
namespace {

data::Scene blood(double box, double acceleration, double kappa) {
  data::Scene scene = test::blood_scene({box, box, box}, 0.35);
  scene.acceleration = acceleration;
  scene.cells.kinds[0].kappa_damping = kappa;
  return scene;
}

void expect_invariants(const data::Scene& scene, double end) {
  Simulation<float> sim(scene, pack(scene));
  const int n = sim.block().ny, parts = 11;
  const double area = static_cast<double>(n) * n, rate = sim.units().rate(100), stress = 0.5 * rate;
  const auto steps = static_cast<std::int64_t>(sim.units().steps(end));
  const Momentum start = sim.momentum();
  Momentum last = start;
  double lower = 0, upper = 0, core = 0, residual = 0;
  std::vector<double> times, below, above, height, speed;
  std::printf(
      "t/ms  stress lower upper / mu gamma  core shear  <u_x>/U  volume min max  gap/dx  momentum "
      "residual\n");
  for (std::int64_t i = 1; i <= steps; ++i) {
    sim.step();
    if (i % (steps / parts)) continue;
    const Momentum m = sim.momentum();
    const double interval = static_cast<double>(steps / parts);
    lower = (m.to_lower_wall[2] - last.to_lower_wall[2]) / interval / area / stress;
    upper = -(m.to_upper_wall[2] - last.to_upper_wall[2]) / interval / area / stress;
    last = m;
    const auto planes = sim.fluid().profiles(sim.force());
    core =
        (planes.velocity[n * 7 / 10][2] - planes.velocity[n * 3 / 10][2]) / (n * 7 / 10 - n * 3 / 10) / rate;
    times.push_back(1e3 * sim.time()), below.push_back(lower), above.push_back(upper);
    speed.resize(n), height.resize(n);
    for (int j = 0; j < n; ++j) {
      height[j] = (j + 0.5) / n;
      if (2 * i > steps) speed[j] += planes.velocity[j][2] / (rate * n);
    }
    double vorticity = 0, smallest = 2, largest = 0, scale = 0;
    for (const auto& u : planes.velocity) vorticity += u[0] / n / (rate * n);
    residual = 0;
    for (int d = 0; d < 3; ++d) {
      residual = std::max(residual, std::abs(m.fluid[d] + m.cells[d] + m.to_lower_wall[d] +
                                             m.to_upper_wall[d] - start.fluid[d] - start.cells[d]));
      scale = std::max(scale, std::abs(m.to_upper_wall[d]));
    }
    residual /= scale;
    const auto& cells = std::get<npfem::Membranes<float>>(sim.groups()[0].cells);
    for (int c = 0; c < cells.count(); ++c) {
      smallest = std::min(smallest, cells.volume(c) / cells.rest_volume());
      largest = std::max(largest, cells.volume(c) / cells.rest_volume());
    }
    std::printf("%5.1f  %5.2f %5.2f  %5.3f  %8.1e  %.4f %.4f  %5.2f  %.1e\n", 1e3 * sim.time(), lower, upper,
                core, vorticity, smallest, largest, sim.contact_summary().minimum_gap, residual);
    std::fflush(stdout);
    EXPECT_GT(smallest, 0.99);
    EXPECT_LT(largest, 1.01);
  }
  using Style = test::Figure::Style;
  const std::string box = std::to_string(n / 2);
  for (double& u : speed) u /= (parts + 1) / 2;
  test::Figure("suspension_" + box + "um_stress", "Blood at 35 % in a box of " + box + " µm", "time, ms",
               "wall shear stress over that of plasma")
      .with("set yrange [0:]")
      .curve("lower wall", Style::dots, 0, times, below)
      .curve("upper wall", Style::dots, 1, times, above)
      .write();
  test::Figure("suspension_" + box + "um_velocity", "Velocity, second half of the run", "height over gap",
               "velocity over that of the wall")
      .curve("blood", Style::line, 1, height, speed)
      .curve("plasma alone", Style::dashes, -1, height, height)
      .write();
  const Timings& t = sim.timings();
  std::printf("ms per step: fluid %.2f interpolation %.2f spreading %.2f solid %.2f contact %.2f\n",
              1e3 * t.fluid / t.steps, 1e3 * t.interpolation / t.steps, 1e3 * t.spreading / t.steps,
              1e3 * t.solid / t.steps, 1e3 * t.contact / t.steps);
  EXPECT_NEAR(upper / lower, 1, 0.03);
  EXPECT_GT(upper, 2);
  EXPECT_LT(upper, 4);
  EXPECT_GT(core, 0.75);
  EXPECT_LT(residual, 1e-5);
}

TEST(Suspension, Box20) { expect_invariants(blood(20, 50, 0.5), 22e-3); }

TEST(Suspension, Box50) {
  if (!std::getenv("HEMOWALK_BOX"))
    GTEST_SKIP() << "takes minutes to a quarter of an hour: set HEMOWALK_BOX=50";
  expect_invariants(blood(50, 16, 0.5), 20e-3);
}

}  // namespace
}  // namespace hemowalk::resolved
