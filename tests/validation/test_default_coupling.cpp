// The constants of the coupling, jointly: kernel, retraction, slip factors and chi against everything they
// act on at once, each quantity by its deviation from an exact or converged value. Prints the table of
// docs/evidence/validation.md, section 1.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>

#include "support/red_cells_in_stokes_flow.hpp"
#include "support/sheets.hpp"
#include "support/single_body.hpp"
#include "support/suspension.hpp"

namespace hemowalk::resolved {
namespace {

/// Relative deviations at dx 0.5 um.
struct Deviations {
  double sheets = 0;    ///< friction, root mean square over gaps of 1, 2, 4 dx
  double sphere = 0;    ///< drag, a = 5 dx
  double platelet = 0;  ///< rigid: period and two drags, root mean square
  double capsule = 0;   ///< Ca 0.1: D, root mean square over strains 1, 2, 3, 4
  double recovery = 0;  ///< of a red cell, time
  double tumbling = 0;  ///< of a red cell, frequency at 100 1/s
  double blood = 0;     ///< stress of the box of 12 um against the limit of small dx
  double volume = 0;    ///< of the capsule without a force that keeps it, at a strain of 1: largest

  double score() const {
    double sum = 0;
    for (const double x : {sheets, sphere, platelet, capsule, recovery, tumbling, blood}) sum += x * x;
    return std::sqrt(sum / 7);
  }
};

double rms(const std::vector<double>& x) {
  double sum = 0;
  for (const double value : x) sum += value * value;
  return std::sqrt(sum / static_cast<double>(x.size()));
}

double of_sheets(const data::Coupling& c) {
  std::vector<double> error;
  for (const double gap : {1.0, 2.0, 4.0}) {
    test_support::SheetCase s;
    s.gap = gap, s.retraction = c.retraction, s.chi = c.chi;
    s.kernel = c.kernel == data::Coupling::Kernel::phi3 ? ibm::Kernel::phi3 : ibm::Kernel::phi4;
    s.theta_n = c.theta_n, s.theta_t = c.theta_t;
    error.push_back(test_support::relative_friction(s) - 1);
  }
  return rms(error);
}

double of_platelet(const data::Coupling& coupling) {
  const mesh::Vec3 radii{1.8, 0.55, 1.8};
  test::BodyCase c;
  c.shape = test::platelet_shape(), c.coupling = coupling;
  return rms({test::jeffery_period(c) / 22.5 - 1,
              test::stokes_radius(c, 1) / test::exact_stokes_radius(radii, 1) - 1,
              test::stokes_radius(c, 0) / test::exact_stokes_radius(radii, 0) - 1});
}

/// \p exact: D by the boundary integral (validation.md, section 2) at strains 1, 2, 3, 4. A box of 6 a raises
/// it by one part in a hundred.
double of_capsule(const data::Coupling& coupling, const std::vector<double>& exact, double* volume) {
  data::Kind kind;
  kind.name = "capsule", kind.shape = test::sphere_shape(2.5), kind.law = data::Kind::Law::neo_hookean;
  kind.Gs = 1025e-6 * 100 * 2.5e-6 / (3 * 0.1), kind.kappa_damping = 0, kind.volume_modulus = 0;
  kind.bending.model = data::Bending::Model::none, kind.density = 1025;
  auto scene = test::shear_scene({15, 15, 15}, 50, {kind});
  scene.coupling = coupling;
  Simulation<float> sim(scene, {{0, {15, 15, 15}, mesh::identity_rotation, {}}});
  const auto& cells = std::get<npfem::Membranes<float>>(sim.groups()[0].cells);
  const double rate = sim.units().rate(100), before = cells.volume(0);
  std::vector<double> error;
  int step = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    for (; step * rate < static_cast<double>(i + 1); ++step) sim.step();
    error.push_back(test::observe(sim, 0, 0).taylor_deformation / exact[i] - 1);
    if (i == 0) *volume = cells.volume(0) / before - 1;
  }
  return rms(error);
}

double of_blood(const data::Coupling& coupling, double limit) {
  test::SuspensionCase c;
  c.box = {12, 12, 12}, c.strain = 8, c.coupling = coupling;
  return test::shear_suspension(c, 1).viscosity / limit - 1;
}

/// Of a red cell with \p c, over the shear rate.
double tumbling(const data::Coupling& c, double wider) {
  test::ShearCase s;
  s.angle = M_PI / 3, s.from = 1, s.coupling = c;
  for (double& length : s.box) length *= wider;
  return test::red_cell_in_shear(s).marker_frequency();
}

TEST(DefaultCoupling, JointlyAgainstAllItActsOn) {
  // Exact or converged: capsule at strains 1 to 4, the recovery time and tumbling by the boundary integral,
  // the box of 12 um from dx 0.5, 1/3, 0.25 um by order 2 (validation.md, sections 2, 5, 6, 9).
  const std::vector<double> capsule{0.310, 0.385, 0.398, 0.399};
  const double recovery = test::return_time_in_stokes_flow(), blood = 2.04, turns = 0.0538;
  const data::Coupling shipped;
  // What images and walls take of the tumbling (by the cube of the box).
  const double boxed = tumbling(shipped, 1), wide_box = tumbling(shipped, 2),
               alone = (wide_box + (wide_box - boxed) / 7) / boxed;
  std::vector<data::Coupling> choices;
  const auto choose = [&](const data::Coupling& from, double retraction, double theta_n, double theta_t,
                          double chi) {
    choices.push_back(from);
    auto& c = choices.back();
    c.retraction = retraction, c.theta_n = theta_n, c.theta_t = theta_t, c.chi = chi;
  };
  for (const double chi : {1.5, shipped.chi, 2.5})
    for (const double theta : {0.9, shipped.theta_n, 0.99})
      for (const double retraction : {0.3, shipped.retraction, 0.4})
        choose(shipped, retraction, theta, theta, chi);
  choose(shipped, shipped.retraction, shipped.theta_n, 0.9, shipped.chi);
  choose(shipped, shipped.retraction, 0.9, shipped.theta_t, shipped.chi);
  const auto phi4 = data::Coupling::with(data::Coupling::Kernel::phi4);
  for (const double retraction : {0.5, phi4.retraction, 0.7})
    choose(phi4, retraction, phi4.theta_n, phi4.theta_t, phi4.chi);
  std::printf(
      "| kernel | chi | theta, normal and along | retraction | sheets | sphere | platelet | capsule | "
      "recovery | tumbling | blood | rms | volume, %% |\n");
  double best = 1, ours = 1;
  for (const data::Coupling& c : choices) {
    Deviations d;
    test::BodyCase sphere;
    sphere.shape = test::sphere_shape(2.5), sphere.subdivision = 5, sphere.box = 14, sphere.coupling = c;
    d.sheets = of_sheets(c);
    d.sphere = test::stokes_radius(sphere, 2) / 2.5 - 1;
    d.platelet = of_platelet(c);
    d.capsule = of_capsule(c, capsule, &d.volume);
    const double narrow = test::return_time(0, 50, mesh::identity_rotation, 20, 2, 0.5, 0.1, c),
                 wide = test::return_time(0, 50, mesh::identity_rotation, 30, 2, 0.5, 0.1, c);
    d.recovery = (wide - (narrow - wide) / (std::pow(1.5, 3) - 1)) / recovery - 1;
    d.blood = of_blood(c, blood);
    d.tumbling = alone * tumbling(c, 1) / turns - 1;
    std::printf(
        "| %s | %.2f | %.2f %.2f | %.2f | %.3f | %+.3f | %.3f | %.3f | %+.3f | %+.3f | %+.3f | **%.3f** | "
        "%.2f |\n",
        c.kernel == shipped.kernel ? "phi3" : "phi4", c.chi, c.theta_n, c.theta_t, c.retraction, d.sheets,
        d.sphere, d.platelet, d.capsule, d.recovery, d.tumbling, d.blood, d.score(), 100 * d.volume);
    std::fflush(stdout);
    const bool as_shipped = c.kernel == shipped.kernel && c.retraction == shipped.retraction &&
                            c.theta_n == shipped.theta_n && c.theta_t == shipped.theta_t &&
                            c.chi == shipped.chi;
    if (as_shipped) ours = d.score();
    // A smaller theta lets plasma slip, which makes up for what the lattice adds without curing it.
    if (c.theta_n >= shipped.theta_n && c.theta_t >= shipped.theta_t) best = std::min(best, d.score());
  }
  // To what the references themselves are known, a hundredth (blood's limit, images).
  EXPECT_LT(ours, best + 0.01) << "another choice is better in all together";
}

}  // namespace
}  // namespace hemowalk::resolved
