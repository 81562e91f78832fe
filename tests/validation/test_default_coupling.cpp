// The constants of the coupling, jointly: retraction, slip factor theta and chi against everything they act
// on at once, each quantity by its deviation from an exact or converged value. Prints the table of
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
  double blood = 0;     ///< stress of the box of 12 um against the limit of small dx
  double volume = 0;    ///< of the capsule without a force that keeps it, at a strain of 1: largest

  double score() const {
    double sum = 0;
    for (const double x : {sheets, sphere, platelet, capsule, recovery, blood}) sum += x * x;
    return std::sqrt(sum / 6);
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
    s.gap = gap, s.retraction = c.retraction, s.kernel = ibm::Kernel::phi3, s.chi = c.chi;
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

/// D of the exact capsule (boundary integral, validation.md section 2) at strains 1, 2, 3, 4, lowered by the
/// images of a box of 6 a.
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

TEST(DefaultCoupling, JointlyAgainstAllItActsOn) {
  // Exact or converged: capsule at strains 1 to 4 and the recovery time by the boundary integral, the box of
  // 12 um from dx 0.5, 1/3, 0.25 um by order 2 (validation.md, sections 2, 5, 9).
  const std::vector<double> capsule{0.310, 0.385, 0.398, 0.399};
  const double recovery = test::return_time_in_stokes_flow(), blood = 2.04;
  struct Choice {
    double retraction, theta, chi;
  };
  const data::Coupling shipped;
  std::vector<Choice> choices;
  for (const double chi : {1.5, shipped.chi})
    for (const double theta : {0.9, shipped.theta_n, 0.99})
      for (const double retraction : {0.3, shipped.retraction, 0.4})
        choices.push_back({retraction, theta, chi});
  std::printf(
      "| retraction | theta | chi | sheets | sphere | platelet | capsule | recovery | blood | rms | volume, "
      "%% |\n");
  double best = 1, ours = 1;
  for (const Choice& choice : choices) {
    data::Coupling c;
    c.retraction = choice.retraction, c.theta_n = c.theta_t = choice.theta, c.chi = choice.chi;
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
    std::printf("| %.2f | %.2f | %.2f | %.3f | %+.3f | %.3f | %.3f | %+.3f | %+.3f | **%.3f** | %.2f |\n",
                choice.retraction, choice.theta, choice.chi, d.sheets, d.sphere, d.platelet, d.capsule,
                d.recovery, d.blood, d.score(), 100 * d.volume);
    std::fflush(stdout);
    best = std::min(best, d.score());
    if (c.retraction == shipped.retraction && c.theta_n == shipped.theta_n && c.chi == shipped.chi)
      ours = d.score();
  }
  EXPECT_LT(ours, 1.25 * best) << "another choice is better in all together";
}

}  // namespace
}  // namespace hemowalk::resolved
