// A neo-Hookean capsule in shear, viscosity ratio 1, against three published curves (Pozrikidis 1995,
// Ramanujan and Pozrikidis 1998, Doddi and Bagchi 2008), at a = 5 dx and extrapolated in box and dx. Ca = mu
// gamma a/(3 Gs). Prints the tables of docs/evidence/validation.md. HEMOWALK_CAPSULE=full adds a = 10 dx
// (half an hour).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "support/red_cells.hpp"
#include "support/reference_data.hpp"
#include "support/single_body.hpp"

namespace hemowalk::resolved {
namespace {

struct Capsule {
  double Ca = 0.1, nodes = 5, box = 6;  // a in dx, box in a
  double acceleration = 50;             // Re = gamma a^2/nu = 6.25e-4 times this
  double retraction = data::Coupling{}.retraction;
  double tau = data::Fluid{}.tau, theta = data::Coupling{}.theta_n;
  double mesh = 1;  // subdivision over 1.6 a/dx
};

struct Deformation {
  std::vector<double> strain, D;
  double volume = 1;  // at the end over the start
  double by_radii =
      0;  // at the end, (L - B)/(L + B) of the longest and shortest radius in place of the moments
  double at(double t) const {
    for (std::size_t i = 1; i < strain.size(); ++i)
      if (t <= strain[i])
        return D[i - 1] + (D[i] - D[i - 1]) * (t - strain[i - 1]) / (strain[i] - strain[i - 1]);
    return D.back();
  }
};

constexpr double end = 6;  // strain; the references are steady from 3 on

Deformation shear(const Capsule& c, double end = ::hemowalk::resolved::end) {
  const double a = 2.5e-6, rate = 100, box = c.box * a * 1e6;
  data::Kind kind;
  kind.name = "capsule", kind.shape = test::sphere_shape(2.5), kind.law = data::Kind::Law::neo_hookean;
  kind.subdivision = static_cast<int>(std::lround(1.6 * c.nodes * c.mesh));
  kind.Gs = 1025e-6 * rate * a / (3 * c.Ca);
  kind.kappa_damping = 0, kind.bending.model = data::Bending::Model::none, kind.volume_modulus = 50 * kind.Gs;
  kind.density = 1025;
  auto scene = test::shear_scene({box, box, box}, c.acceleration, {kind});
  scene.fluid.dx = a / c.nodes, scene.coupling.retraction = c.retraction;
  scene.coupling.theta_n = scene.coupling.theta_t = c.theta, scene.fluid.tau = c.tau;
  const double middle = c.box * c.nodes / 2;
  Simulation<float> sim(scene, {{0, {middle + 0.2, middle, middle}, mesh::identity_rotation, {}}});
  const double per_step = sim.units().rate(rate);
  const int steps = static_cast<int>(end / per_step), every = steps / 60;
  Deformation out{{0}, {0}};
  const double volume = test::observe(sim, 0, 0).volume;
  for (int i = 1; i <= steps; ++i) {
    sim.step();
    if (i % every) continue;
    const auto o = test::observe(sim, 0, 0);
    out.strain.push_back(i * per_step), out.D.push_back(o.taylor_deformation), out.volume = o.volume / volume;
  }
  const auto& cells = std::get<npfem::Membranes<float>>(sim.groups()[0].cells);
  const auto centre = test::observe(sim, 0, 0).centre;
  double longest = 0, shortest = 1e9;
  for (const auto& x : cells.positions(0)) {
    const double r = std::hypot(x[0] - centre[0], x[1] - centre[1], x[2] - centre[2]);
    longest = std::max(longest, r), shortest = std::min(shortest, r);
  }
  out.by_radii = (longest - shortest) / (longest + shortest);
  return out;
}

double steady(const Deformation& d) { return d.at(end); }

struct References {
  std::vector<test::Curve> curves;
  explicit References(const std::string& folder, const std::string& Ca)
      : curves{test::Curve(folder + "/nh_shear_3d__pozrikidis1995_ca_" + Ca + ".csv"),
               test::Curve(folder + "/nh_shear_3d__pozrikidis1998_ca_" + Ca + ".csv"),
               test::Curve(folder + "/nh_shear_3d__bagchi_ca" + Ca + ".csv")} {}
  double mean(double t) const {
    double sum = 0, n = 0;
    for (const auto& c : curves)
      if (c.covers(t)) sum += c(t), n += 1;
    return sum / n;
  }
  // Steady value: mean of the last values of those that get there.
  double steady() const { return (curves[1](curves[1].last()) + curves[2](curves[2].last())) / 2; }
};

struct Tolerance {
  double raw, extrapolated;
};

void compare(const std::string& Ca, const Tolerance& tolerance) {
  const std::string folder = test::reference_folder("capsule_neo_hookean");
  if (folder.empty()) GTEST_SKIP() << "no shared/data/capsule_neo_hookean beside the repository";
  const References reference(folder, Ca);
  const bool full = std::getenv("HEMOWALK_CAPSULE") != nullptr;
  Capsule c;
  c.Ca = std::atof(Ca.c_str());
  std::vector<Deformation> runs{shear(c)};
  c.box = 9;
  const Deformation wide = shear(c);
  c.box = 6, c.acceleration = 100, c.nodes = 7.5;
  runs.push_back(shear(c));
  if (full) c.nodes = 10, runs.push_back(shear(c));
  std::printf("Ca %s  strain: a/dx = 5, 7.5%s | a/dx = 5 in the wide box | references\n", Ca.c_str(),
              full ? ", 10" : "");
  for (const double t : {0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0}) {
    std::printf("%.1f:", t);
    for (const auto& r : runs) std::printf(" %.4f", r.at(t));
    std::printf(" | %.4f | %.4f\n", wide.at(t), t < 5 ? reference.mean(t) : reference.steady());
  }
  // Images: the disturbance of a force-free body falls with the cube of the distance. The error in dx was
  // seen to be of order 1 (a = 5, 7.5, 10 dx at Ca 0.1: differences 0.0117 and 0.0061).
  const double box_correction = (steady(wide) - steady(runs[0])) / (1 - std::pow(6.0 / 9, 3));
  const double fine = steady(runs.back()), coarse = steady(runs[runs.size() - 2]),
               ratio = full ? 10 / 7.5 : 1.5;
  const double raw = steady(runs[0]) / reference.steady() - 1,
               extrapolated =
                   (fine + (fine - coarse) / (ratio - 1) + box_correction) / reference.steady() - 1;
  std::printf(
      "strain 6 against the references' steady mean %.4f: a = 5 dx, box 6 a: %+.1f %%; extrapolated in box "
      "and "
      "dx (order 1): %+.1f %%; volume %.5f\n",
      reference.steady(), 100 * raw, 100 * extrapolated, runs[0].volume);
  EXPECT_LT(std::abs(raw), tolerance.raw);
  EXPECT_LT(std::abs(extrapolated), tolerance.extrapolated);
  for (const auto& r : runs) EXPECT_NEAR(r.volume, 1, 0.002);
}

// What was reached (docs/evidence/validation.md), not what is wanted: 2.5 % at Ca 0.1 and 5 % at 0.05,
// extrapolated.
TEST(Capsule, DeformsAsPublishedAtCa01) { compare("0.1", {0.06, 0.06}); }
TEST(Capsule, DeformsAsPublishedAtCa005) { compare("0.05", {0.10, 0.06}); }

// What the deformation depends on beside a/dx, the box and the acceleration: one change at a time.
TEST(Capsule, OverNumericalChoices) {
  std::printf("Ca 0.1, a = 5 dx, box 6 a | D at strains 1, 2, 3, 4; by radii; volume\n");
  const auto run = [&](const char* name, Capsule c) {
    const auto d = shear(c, 4);
    std::printf("%s | %.4f %.4f %.4f %.4f; %.4f; %.5f\n", name, d.at(1), d.at(2), d.at(3), d.at(4),
                d.by_radii, d.volume);
    std::fflush(stdout);
    EXPECT_NEAR(d.volume, 1, 0.006) << name;
    return d.at(4);
  };
  for (const double retraction : {0.0, data::Coupling{}.retraction}) {
    Capsule c;
    c.retraction = retraction;
    std::printf("retraction %.1f\n", retraction);
    const double shipped = run("shipped", c);
    // Known: with retraction the membrane is the stiffer the better its coupling points follow the fluid.
    const double allowed = retraction > 0 ? 0.12 : 0.02;
    auto fine_steps = c, fine_mesh = c, slipping = c;
    fine_steps.tau = 1, fine_mesh.mesh = 1.5, slipping.theta = 0.9;
    EXPECT_NEAR(run("tau 1", fine_steps) / shipped, 1, allowed);
    EXPECT_NEAR(run("mesh n = 12", fine_mesh) / shipped, 1, 0.02);
    EXPECT_NEAR(run("theta 0.9", slipping) / shipped, 1, allowed);
  }
}

// Small deformations are known exactly: D = (25/12) mu gamma a/G_s = (25/4) Ca (Barthes-Biesel and Rallison
// 1981), reached within some strains of Ca; at Ca 0.004 and 0.008 the ratio is the same within 0.2 %. No
// reference curve comes between.
TEST(Capsule, DeformsExactlyInTheLimitOfSmallCa) {
  const auto ratio = [](double nodes, double retraction, double box) {
    Capsule c;
    c.Ca = 0.004, c.nodes = nodes, c.retraction = retraction, c.box = box;
    c.acceleration = nodes > 5 ? 100 : 50;
    return shear(c, 1).at(1) / (6.25 * c.Ca);
  };
  std::printf("retraction | D/(25/4 Ca) at a = 5, 7.5, 10 dx, box corrected; extrapolated by order 1, 2\n");
  for (const double retraction : {0.0, data::Coupling{}.retraction}) {
    const double narrow = ratio(5, retraction, 6), wide = ratio(5, retraction, 9),
                 images = (wide - narrow) / (1 - std::pow(6.0 / 9, 3));
    const double a[] = {narrow + images, ratio(7.5, retraction, 6) + images,
                        ratio(10, retraction, 6) + images};
    const auto limit = [&](int order) {
      const double shrink = std::pow(0.75, order);
      return (a[2] - shrink * a[1]) / (1 - shrink);
    };
    std::printf("%.1f | %.4f %.4f %.4f (images %.4f); %.4f %.4f\n", retraction, a[0], a[1], a[2], -images,
                limit(1), limit(2));
    std::fflush(stdout);
    EXPECT_LT(std::abs(a[2] - 1), std::abs(a[0] - 1)) << "does not converge";
    EXPECT_NEAR(limit(2), 1, 0.05);
  }
}

}  // namespace
}  // namespace hemowalk::resolved
