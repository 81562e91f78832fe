// A neo-Hookean capsule in shear, viscosity ratio 1, against a boundary integral with the same membrane and
// three published curves (Pozrikidis 1995, Ramanujan and Pozrikidis 1998, Doddi and Bagchi 2008), at a = 5 dx
// and extrapolated in box and dx. Ca = mu gamma a/(3 Gs). Prints the tables of docs/evidence/validation.md.
// HEMOWALK_CAPSULE_CA=0.2 chooses any other Ca.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "resolved/mesh/shapes.hpp"
#include "support/boundary_integral.hpp"
#include "support/figure.hpp"
#include "support/red_cells.hpp"
#include "support/reference_data.hpp"
#include "support/single_body.hpp"

namespace hemowalk::resolved {
namespace {

struct Capsule {
  double Ca = 0.1, nodes = 5, box = 6;  // a in dx, box in a
  double acceleration = 50;             // Re = gamma a^2/nu = 6.25e-4 times this
  data::Coupling coupling;
  double tau = data::Fluid{}.tau;
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
  scene.fluid.dx = a / c.nodes, scene.coupling = c.coupling, scene.fluid.tau = c.tau;
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

/// The capsule alone in unbounded Stokes flow, 578 vertices. At Ca 0.1 and 1026 vertices D is 0.1 % lower at
/// strain 6 and 0.3 % higher at strains 0.5 to 1.5.
const Deformation& exact(double Ca) {
  static std::map<double, Deformation> known;
  if (const auto it = known.find(Ca); it != known.end()) return it->second;
  const auto sphere = mesh::sphere(1, 12);
  npfem::Material material;
  material.law = npfem::Law::neo_hookean, material.Gs = 1 / (3 * Ca);
  material.bending = npfem::Bending::none, material.volume_modulus = 0;
  const npfem::CellType type(sphere, material, std::vector<double>(sphere.vertices.size(), 1.0), 1);
  constexpr int steps = 240;
  test::MembraneInStokesFlow capsule(
      type, sphere, 1,
      [](const mesh::Vec3& p) {
        return mesh::Vec3{0, 0, p[1]};
      },
      sphere.vertices);
  Deformation out{{0}, {0}};
  for (int i = 1; i <= steps; ++i) {
    capsule.advance(end / steps);
    const auto o = mesh::observe(sphere, capsule.vertices(), type.marker());
    out.strain.push_back(i * end / steps), out.D.push_back(o.taylor_deformation);
    out.volume = o.volume / type.rest_volume();
  }
  return known[Ca] = out;
}

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

struct Series {
  std::vector<double> spacing;  ///< a/dx
  std::vector<Deformation> runs;
  Deformation wide;  ///< runs[0] in a box of 9 a in place of 6 a
  /// Images: the disturbance of a force-free body falls with the cube of the distance.
  double without_images(std::size_t run, double t) const {
    return runs[run].at(t) + (wide.at(t) - runs[0].at(t)) / (1 - std::pow(6.0 / 9, 3));
  }
  /// The order in dx that the three spacings show at strain \p t (Roache 1994), between 1 and 2; 1 where the
  /// differences change sign.
  double order(double t) const {
    const double d[] = {without_images(0, t), without_images(1, t), without_images(2, t)};
    const double seen = (d[1] - d[0]) / (d[2] - d[1]);
    const auto ratio = [&](double p) {
      const auto h = [&](int i) { return std::pow(spacing[i], -p); };
      return (h(0) - h(1)) / (h(1) - h(2));
    };
    if (!(seen > ratio(1))) return 1;
    double low = 1, high = 2;
    for (int i = 0; i < 40; ++i) (ratio((low + high) / 2) < seen ? low : high) = (low + high) / 2;
    return low;
  }
  /// The finest two by order \p p.
  double extrapolated(double t, double p) const {
    const double fine = without_images(2, t), coarse = without_images(1, t);
    return fine + (fine - coarse) / (std::pow(spacing[2] / spacing[1], p) - 1);
  }
  double extrapolated(double t) const { return extrapolated(t, order(t)); }
};

Series measure(double Ca) {
  Series s;
  Capsule c;
  c.Ca = Ca;
  const auto run = [&](double nodes) {
    c.nodes = nodes, c.acceleration = nodes > 5 ? 100 : 50;
    s.spacing.push_back(nodes), s.runs.push_back(shear(c));
  };
  for (const double nodes : {5.0, 7.5, 10.0}) run(nodes);
  c.nodes = 5, c.acceleration = 50, c.box = 9;
  s.wide = shear(c);
  return s;
}

void draw(double Ca, const Series& s, const References* published) {
  using Style = test::Figure::Style;
  char name[64], title[96];
  std::snprintf(name, sizeof name, "capsule_ca_%g", Ca);
  std::snprintf(title, sizeof title, "Neo-Hookean capsule in shear, Ca = %g", Ca);
  test::Figure figure(name, title, "strain", "Taylor deformation D");
  figure.with("set xrange [0:6]").with("set yrange [0:]");
  figure.curve("boundary integral, unbounded", Style::line, 6, exact(Ca).strain, exact(Ca).D);
  for (std::size_t i = 0; i < s.runs.size(); ++i) {
    char label[64];
    std::snprintf(label, sizeof label, "hemowalk, a = %g dx", s.spacing[i]);
    auto D = s.runs[i].D;
    for (std::size_t k = 0; k < D.size(); ++k) D[k] = s.without_images(i, s.runs[i].strain[k]);
    figure.curve(label, Style::line, static_cast<int>(i), s.runs[i].strain, D);
  }
  if (published) {
    const char* const sources[] = {"Pozrikidis 1995", "Ramanujan and Pozrikidis 1998",
                                   "Doddi and Bagchi 2008"};
    for (int i = 0; i < 3; ++i) {
      const auto& curve = published->curves[i];
      std::vector<double> t, D;
      for (double at = 0.25; at < end; at += 0.25)
        if (curve.covers(at)) t.push_back(at), D.push_back(curve(at));
      figure.curve(sources[i], Style::points, 3 + i, t, D);
    }
  }
  figure.write();
}

/// Prints the table and holds it against the boundary integral: the extrapolated deformation at strain 6
/// within \p tolerance.
Series compare(double Ca, double tolerance, const References* published = nullptr) {
  const Series s = measure(Ca);
  const Deformation& e = exact(Ca);
  std::printf("Ca %g, strain |", Ca);
  for (const double nodes : s.spacing) std::printf(" a = %g dx |", nodes);
  std::printf(" a = 5 dx in 9 a | extrapolated (order; by order 1) | exact |%s\n",
              published ? " published |" : "");
  for (const double t : {0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0}) {
    std::printf("%.1f |", t);
    for (const auto& r : s.runs) std::printf(" %.4f |", r.at(t));
    std::printf(" %.4f | %.4f (%.2f; %.4f) | %.4f |", s.wide.at(t), s.extrapolated(t), s.order(t),
                s.extrapolated(t, 1), e.at(t));
    if (published) std::printf(" %.4f |", t < 5 ? published->mean(t) : published->steady());
    std::printf("\n");
  }
  std::printf(
      "strain 6 against the exact one: a = 5 dx, box 6 a: %+.1f %%; without images: %+.1f, %+.1f %%; "
      "extrapolated %+.1f %%; volumes %.5f, exact %.5f\n",
      100 * (steady(s.runs[0]) / steady(e) - 1), 100 * (s.without_images(0, end) / steady(e) - 1),
      100 * (s.without_images(s.runs.size() - 1, end) / steady(e) - 1),
      100 * (s.extrapolated(end) / steady(e) - 1), s.runs[0].volume, e.volume);
  draw(Ca, s, published);
  EXPECT_NEAR(s.extrapolated(end) / steady(e), 1, tolerance);
  // Known: the retraction makes a soft membrane late (-8 % at Ca 0.2).
  EXPECT_NEAR(steady(s.runs[0]) / steady(e), 1, 0.1);
  for (const double t : {1.0, 1.5, 2.0, 3.0, 4.0}) EXPECT_NEAR(s.extrapolated(t) / e.at(t), 1, 0.03) << t;
  for (const auto& r : s.runs) EXPECT_NEAR(r.volume, 1, 0.002);
  EXPECT_NEAR(e.volume, 1, 0.01);
  return s;
}

void compare_published(const std::string& Ca, double tolerance, double apart) {
  const std::string folder = test::reference_folder("capsule_neo_hookean");
  if (folder.empty()) GTEST_SKIP() << "no shared/data/capsule_neo_hookean beside the repository";
  const References published(folder, Ca);
  const Series s = compare(std::atof(Ca.c_str()), tolerance, &published);
  std::printf("published, steady, %.4f: exact %+.1f %%, extrapolated %+.1f %%\n", published.steady(),
              100 * (steady(exact(std::atof(Ca.c_str()))) / published.steady() - 1),
              100 * (s.extrapolated(end) / published.steady() - 1));
  EXPECT_NEAR(s.extrapolated(end) / published.steady(), 1, tolerance);
  // The boundary integral and the solver against the published curves, transient included.
  for (const double t : {0.5, 1.0, 1.5, 2.0, 3.0, 4.0}) {
    EXPECT_NEAR(exact(std::atof(Ca.c_str())).at(t) / published.mean(t), 1, apart) << t;
    EXPECT_NEAR(s.extrapolated(t) / published.mean(t), 1, apart) << t;
  }
}

TEST(Capsule, DeformsAsPublishedAtCa01) { compare_published("0.1", 0.025, 0.04); }
TEST(Capsule, DeformsAsPublishedAtCa005) { compare_published("0.05", 0.05, 0.04); }
TEST(Capsule, DeformsAsTheBoundaryIntegralAtAnyCa) {
  const char* chosen = std::getenv("HEMOWALK_CAPSULE_CA");
  compare(chosen ? std::atof(chosen) : 0.2, 0.05);
}

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
    c.coupling.retraction = retraction;
    std::printf("retraction %.2f\n", retraction);
    const double shipped = run("shipped", c);
    // Known: with retraction the membrane is the stiffer the better its coupling points follow the fluid,
    // whose hold goes as chi/nu (2.5 % at tau 1, 1.6 % at theta 0.9); without it nothing of this matters (0.6
    // %), nor does the mesh.
    const double allowed = retraction > 0 ? 0.035 : 0.01;
    auto fine_steps = c, fine_mesh = c, slipping = c;
    fine_steps.tau = 1, fine_mesh.mesh = 1.5;
    slipping.coupling.theta_n = slipping.coupling.theta_t = 0.9;
    EXPECT_NEAR(run("tau 1", fine_steps) / shipped, 1, allowed);
    EXPECT_NEAR(run("mesh n = 12", fine_mesh) / shipped, 1, 0.01);
    EXPECT_NEAR(run("theta 0.9", slipping) / shipped, 1, allowed);
  }
}

// A narrower kernel needs less retraction, which is what makes a membrane late. a = 5 dx, images left in
// (0.0047 of D at strain 6).
TEST(Capsule, DeformsInTimeOverTheKernel) {
  Capsule narrow, wide;
  wide.coupling = data::Coupling::with(data::Coupling::Kernel::phi4);
  const auto shipped = shear(narrow, 4), other = shear(wide, 4);
  std::printf("Ca 0.1, strain | phi3 (shipped) | phi4 | exact\n");
  for (const double t : {0.5, 1.0, 1.5, 2.0, 3.0, 4.0}) {
    const double D = exact(0.1).at(t);
    std::printf("%.1f | %.4f | %.4f | %.4f\n", t, shipped.at(t), other.at(t), D);
    EXPECT_NEAR(shipped.at(t) / D, 1, 0.06) << t;
    EXPECT_LT(std::abs(shipped.at(t) / D - 1), std::abs(other.at(t) / D - 1)) << t;
  }
  EXPECT_NEAR(shipped.volume, 1, 0.002);
}

// Small deformations are known exactly: D = (25/12) mu gamma a/G_s = (25/4) Ca (Barthes-Biesel and Rallison
// 1981), reached within some strains of Ca; at Ca 0.004 and 0.008 the ratio is the same within 0.2 %. No
// reference curve comes between.
TEST(Capsule, DeformsExactlyInTheLimitOfSmallCa) {
  const auto ratio = [](double nodes, double retraction, double box) {
    Capsule c;
    c.Ca = 0.004, c.nodes = nodes, c.coupling.retraction = retraction, c.box = box;
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
    std::printf("%.2f | %.4f %.4f %.4f (images %.4f); %.4f %.4f\n", retraction, a[0], a[1], a[2], -images,
                limit(1), limit(2));
    std::fflush(stdout);
    EXPECT_LT(std::abs(a[2] - 1), std::abs(a[0] - 1)) << "does not converge";
    EXPECT_NEAR(limit(2), 1, 0.05);
  }
}

}  // namespace
}  // namespace hemowalk::resolved
