// Blood in a tube against Pries et al. 1992 (in vitro): apparent viscosity and the Fahraeus effect.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "resolved/packing.hpp"
#include "resolved/resolve.hpp"
#include "resolved/simulation.hpp"
#include "support/blood_scene.hpp"
#include "support/figure.hpp"
#include "support/pries.hpp"

namespace hemowalk::resolved {
namespace {

using test::pries_fahraeus;
using test::pries_viscosity;

/// The least tube over discharge hematocrit that goes with the relative viscosity \p eta where an annulus of
/// plasma surrounds a core of uniform hematocrit: with y = (core radius/tube radius)^2 and a core m times as
/// viscous, 1/eta = 1 - y^2 (1 - 1/m) and the core's mean velocity over the bulk's is 2 eta (1 - y + y/(2
/// m)); at a given eta that is largest for a plug, y^2 = 1 - 1/eta.
double least_fahraeus(double eta) { return 1 / (2 * eta * (1 - std::sqrt(1 - 1 / eta))); }

/// The annulus of plasma, um, with which such a tube of \p d um and \p Ht has the relative viscosity \p eta,
/// its core being blood of a wide tube.
double layer_of_two_fluids(double d, double Ht, double eta) {
  double low = Ht / 0.9, high = 1;
  for (int i = 0; i < 50; ++i) {
    const double y = (low + high) / 2, m = test::wide_tube_viscosity(Ht / y);
    (1 / (1 - y * y * (1 - 1 / m)) < eta ? low : high) = y;
  }
  return d / 2 * (1 - std::sqrt(low));
}

struct Vessel {
  double viscosity, fahraeus, discharge;
  double plasma_layer;  ///< um
};

/// Mean distance, dx, from the wall of a tube of \p radius to the outermost vertex, over slices of 2 dx and
/// eighths of the circumference that hold one.
double plasma_layer(const Simulation<float>& sim, double radius) {
  const int slices = sim.block().nz / 2;
  std::vector<double> outermost(8 * slices, 0);
  for (const auto& group : sim.groups())
    for (int c = 0; c < group.count(); ++c)
      for (const auto& p : std::get<npfem::Membranes<float>>(group.cells).positions(c)) {
        const double x = p[0] - sim.block().nx / 2.0, y = p[1] - sim.block().ny / 2.0,
                     z = p[2] / 2 - slices * std::floor(p[2] / 2 / slices);
        const int sector = static_cast<int>(std::floor((std::atan2(y, x) + M_PI) / (2 * M_PI) * 8)) % 8;
        double& far = outermost[8 * std::min(static_cast<int>(z), slices - 1) + sector];
        far = std::max(far, std::hypot(x, y));
      }
  double sum = 0, found = 0;
  for (const double r : outermost)
    if (r > 0) sum += radius - r, found += 1;
  return sum / found;
}

struct Tube {
  double diameter;    ///< um
  double hematocrit;  ///< tube hematocrit asked for
  double velocity;    ///< mean velocity that plasma alone would have, mm/s
  double way = 0.4;   ///< mm that such plasma would flow
};

/// Shear rate at the wall of plasma alone, times acceleration, 1/s: the same in all tubes. The boxes' is
/// 5000.
constexpr double inertia = 6400;

/// Mean over the last eighth of the way of blood driven by a constant gradient.
Vessel measure(const Tube& tube) {
  const double diameter = tube.diameter, hematocrit = tube.hematocrit, duration = tube.way / tube.velocity;
  data::Scene scene = test::blood_scene({diameter + 2, diameter + 2, 30}, hematocrit);
  scene.domain.geometry = data::Domain::Geometry::tube;
  scene.domain.tube_diameter = 1e-6 * diameter;
  scene.flow.type = data::Flow::Type::poiseuille;
  scene.flow.mean_velocity = 1e-3 * tube.velocity;
  scene.cells.platelets_per_rbc = 0;
  scene.cells.kinds.resize(1);
  scene.cells.kinds[0].kappa_damping = 0.5;
  scene.acceleration = inertia / (8e3 * tube.velocity / diameter);
  const auto problems = preflight(scene);
  EXPECT_TRUE(problems.empty()) << problems.front();
  const double true_hematocrit = census(scene).rbc * census(scene).rbc_volume /
                                 (M_PI / 4 * std::pow(1e-6 * diameter, 2) * scene.domain.size[2]);
  // The lattice's own tube, without cells, is the reference: the staircase cancels.
  data::Scene plasma = scene;
  plasma.cells = {};
  Simulation<float> empty(plasma, {});
  for (int i = 0; i < 4000; ++i) empty.step();
  const auto flux = [](const auto& sim) {
    return sim.momentum().fluid[2] / static_cast<double>(sim.fluid().fluid_nodes());
  };
  const double plasma_velocity = flux(empty);

  Simulation<float> sim(scene, pack(scene));
  // Cells wander to the middle over some 25 diameters: eight windows show how far that has gone.
  constexpr int windows = 8;
  Vessel now{};
  double bulk = 0, cells = 0, layer = 0;
  int samples = 0, window = 1;
  std::vector<double> until, viscosity, fahraeus, viscosity_pries, fahraeus_pries;
  std::printf("until, ms | viscosity | tube over discharge hematocrit | plasma layer, um\n");
  for (std::int64_t step = 1; window <= windows; ++step) {
    sim.step();
    if (step % 500) continue;
    double mean = 0;
    for (const auto& group : sim.groups())
      std::visit(
          [&](const auto& g) {
            const auto v = g.velocities();
            for (int c = 0; c < g.count(); ++c)
              for (int k = 0; k < g.vertices(); ++k)
                mean += v[g.layout().at(c, k, 2)] / (static_cast<double>(g.vertices()) * g.count());
          },
          group.cells);
    bulk += flux(sim), cells += mean, ++samples;
    layer += plasma_layer(sim, diameter / 2 / 0.5) * 0.5;
    if (sim.time() < duration * window / windows) continue;
    now = {plasma_velocity * samples / bulk, bulk / cells, true_hematocrit * cells / bulk, layer / samples};
    std::printf("%.0f | %.3f | %.3f | %.2f\n", 1e3 * sim.time(), now.viscosity, now.fahraeus,
                now.plasma_layer);
    std::fflush(stdout);
    until.push_back(1e3 * sim.time());
    viscosity.push_back(now.viscosity), viscosity_pries.push_back(pries_viscosity(diameter, now.discharge));
    fahraeus.push_back(now.fahraeus), fahraeus_pries.push_back(pries_fahraeus(diameter, now.discharge));
    bulk = cells = layer = 0, samples = 0, ++window;
  }
  using Style = test::Figure::Style;
  char name[64], title[96];
  std::snprintf(name, sizeof name, "vessel_%.0fum_%.0f_%.0fmm_per_s", diameter, 100 * hematocrit,
                tube.velocity);
  std::snprintf(title, sizeof title, "Tube of %.0f µm, tube hematocrit %.2f, %.0f mm/s", diameter,
                true_hematocrit, tube.velocity);
  test::Figure(name, title, "time, ms", "")
      .with("set yrange [0:]")
      .curve("relative viscosity", Style::dots, 0, until, viscosity)
      .curve("Pries et al. 1992", Style::dashes, 0, until, viscosity_pries)
      .curve("tube over discharge hematocrit", Style::dots, 1, until, fahraeus)
      .curve("Pries et al. 1992", Style::dashes, 1, until, fahraeus_pries)
      .write();
  return now;
}

void compare(Tube tube) {
  if (const char* way = std::getenv("HEMOWALK_VESSEL_MM")) tube.way = std::atof(way);
  const Vessel v = measure(tube);
  std::printf(
      "| diameter, um | plasma, mm/s | tube hematocrit | discharge | viscosity | Pries | Ht/Hd | Pries | "
      "least with this viscosity, with Pries' | plasma layer, um | of two fluids with Pries' viscosity "
      "times 1.1, 1, 0.9 |\n");
  const double pries = pries_viscosity(tube.diameter, v.discharge), Ht = v.fahraeus * v.discharge;
  const auto layer = [&](double share) { return layer_of_two_fluids(tube.diameter, Ht, share * pries); };
  std::printf("| %.0f | %.0f | %.2f | %.3f | %.2f | %.2f | %.3f | %.3f | %.3f %.3f | %.2f |", tube.diameter,
              tube.velocity, tube.hematocrit, v.discharge, v.viscosity, pries, v.fahraeus,
              pries_fahraeus(tube.diameter, v.discharge), least_fahraeus(v.viscosity), least_fahraeus(pries),
              v.plasma_layer);
  std::printf(" %.2f %.2f %.2f |\n", layer(1.1), layer(1), layer(0.9));
  // Pries et al. scatter by some 10 % about their fit; lattice and mesh add 15 % of viscosity at dx 0.5 um
  // (validate_rheology).
  EXPECT_NEAR(v.viscosity / pries, 1, 0.25);
  // What their viscosity asks of the plasma layer, within the same scatter and a lattice spacing.
  EXPECT_GT(v.plasma_layer, layer(1.1) - 0.5);
  EXPECT_LT(v.plasma_layer, layer(0.9) + 0.5);
  EXPECT_NEAR(v.fahraeus / pries_fahraeus(tube.diameter, v.discharge), 1, 0.20);
  // Their two fits do not go together: at 20 um and a discharge hematocrit of 0.2 the viscosity of 1.18 asks
  // for 0.695 or more, the fit says 0.615. Ours have to.
  EXPECT_GT(v.fahraeus, 0.97 * least_fahraeus(v.viscosity));
}

// Pries et al. state their fits for velocities of 50 diameters per second and more: 1 mm/s is the least of
// them here.
TEST(Vessel, PriesAt20umAnd15PerCent) { compare({20, 0.15, 1}); }
TEST(Vessel, PriesAt20umAnd15PerCentFast) { compare({20, 0.15, 4, 0.2}); }
TEST(Vessel, PriesAt20umAnd30PerCent) { compare({20, 0.3, 4}); }
TEST(Vessel, PriesAt40um) { compare({40, 0.3, 4}); }

}  // namespace
}  // namespace hemowalk::resolved
