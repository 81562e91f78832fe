// The red cell's solid alone, without fluid: stretched by optical tweezers (scatter after Mills 2004, Dao
// 2006), uniaxial tension of the membrane laws (Barthes-Biesel 2002), Helfrich bending of the biconcave
// shape. Prints the tables of docs/evidence/validation.md.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>

#include "resolved/mesh/vector.hpp"
#include "resolved/npfem/membranes.hpp"
#include "resolved/npfem/reference.hpp"
#include "resolved/npfem/terms/neo_hookean.hpp"
#include "resolved/npfem/terms/skalak.hpp"
#include "support/cells.hpp"
#include "support/figure.hpp"
#include "support/optical_tweezers.hpp"
#include "support/reference_data.hpp"

namespace hemowalk::npfem {
namespace {

using test::Curve;

#define NEED_REFERENCE(folder, name)                       \
  const std::string folder = test::reference_folder(name); \
  if (folder.empty()) GTEST_SKIP() << "no shared/data/" name " beside the repository"

Material skalak(double Gs) {
  Material m;
  m.law = Law::skalak, m.Gs = Gs, m.skalak_C = 10;
  return m;
}

TEST(OpticalTweezers, ParameterSetsAgainstTheScatter) {
  NEED_REFERENCE(folder, "optical_tweezers");
  auto scatter = test::read_numbers(folder + "/scatter.csv");
  std::vector<double> forces;
  for (const auto& row : scatter) forces.push_back(row.at(0));
  const struct {
    const char* name;
    Material material;
    bool shipped;
  } sets[] = {{"paper: B 5, C 5000, D 35, k_b 1", {}, true},
              {"Skalak: Gs 4, C 10, k_b 1", skalak(4), false},
              {"Skalak: Gs 5.3, C 10, k_b 1", skalak(5.3), false}};
  double best = 0;
  using Style = test::Figure::Style;
  test::Figure figure("optical_tweezers", "Red cell pulled by optical tweezers", "force, pN", "diameter, µm");
  std::vector<double> middle[2], half[2];
  for (const auto& row : scatter)
    for (const int i : {0, 1})
      middle[i].push_back((row[1 + 3 * i] + row[3 + 3 * i]) / 2),
          half[i].push_back((row[3 + 3 * i] - row[1 + 3 * i]) / 2);
  figure.curve("experiment, scatter", Style::points, -1, forces, middle[0], half[0]);
  figure.curve("", Style::points, -1, forces, middle[1], half[1]);
  int colour = 0;
  for (const auto& set : sets) {
    const auto cells = support::stretch(set.material, forces);
    std::printf("%s (pN/um, pN um)\nforce/pN  axial/um [scatter]  transverse/um [scatter]\n", set.name);
    int inside = 0;
    double square = 0;
    for (std::size_t i = 0; i < forces.size(); ++i) {
      const auto& r = scatter[i];
      const bool a = r[1] <= cells[i].axial && cells[i].axial <= r[3],
                 t = r[4] <= cells[i].transverse && cells[i].transverse <= r[6];
      inside += a + t;
      square += std::pow(cells[i].axial / r[2] - 1, 2) + std::pow(cells[i].transverse / r[5] - 1, 2);
      std::printf("%6.1f  %5.2f [%5.2f %5.2f]%s  %5.2f [%5.2f %5.2f]%s\n", forces[i], cells[i].axial, r[1],
                  r[3], a ? " " : "*", cells[i].transverse, r[4], r[6], t ? " " : "*");
    }
    const double points = 2.0 * static_cast<double>(forces.size());
    std::printf("inside: %d of %.0f (%.0f %%), rms deviation from the middle %.1f %%\n", inside, points,
                100 * inside / points, 100 * std::sqrt(square / points));
    std::vector<double> axial, transverse;
    for (const auto& cell : cells) axial.push_back(cell.axial), transverse.push_back(cell.transverse);
    figure.curve(set.name, Style::dots, colour, forces, axial);
    figure.curve("", Style::dots, colour++, forces, transverse);
    if (set.shipped) best = std::max(best, inside / points);
  }
  figure.with("set yrange [0:22]").write();
  EXPECT_GE(best, 0.95);
}

// Uniaxial tension T1(lambda) with T2 = 0, from the code's own derivative of the energy.
template <class Law>
double uniaxial_tension(const Law& law, double l1) {
  const auto tension = [&](double a, double b) {  // along a: (dw/da)/b
    const Stretch<double> s{a * a + b * b, a * b, a + b};
    const auto w = law.gradient(s);
    return (2 * w.I1 * a + w.t + w.J * b) / b;
  };
  double low = 0.1, high = 2;  // T2 rises with lambda2
  for (int i = 0; i < 80; ++i) {
    const double l2 = (low + high) / 2;
    (tension(l2, l1) < 0 ? low : high) = l2;
  }
  return tension(l1, low);
}

TEST(UniaxialTension, FollowsBarthesBiesel) {
  NEED_REFERENCE(folder, "uniaxial_stretch");
  const Curve neo_hookean(folder + "/uniaxial_stretch__BB2002_neo-hookean.csv"),
      skalak(folder + "/uniaxial_stretch__BB2002_skalak.csv");
  std::printf("strain (lambda^2 - 1)/2: T/Gs neo-Hookean, digitised | Skalak C = 1, digitised\n");
  for (const double e : {0.1, 0.2, 0.4, 0.6, 0.8, 0.95}) {
    const double l = std::sqrt(1 + 2 * e), a = uniaxial_tension(NeoHookean<double>{1}, l),
                 b = uniaxial_tension(Skalak<double>{1, 1}, l);
    std::printf("%.2f: %.3f %.3f | %.3f %.3f\n", e, a, neo_hookean(e), b, skalak(e));
    // In closed form: lambda2^2 = 1/lambda (neo-Hookean), (1 + C lambda^2)/(1 + C lambda^4) (Skalak).
    EXPECT_NEAR(a, (l * l - 1 / l) / std::sqrt(l), 1e-12);
    const double w2 = (1 + l * l) / (1 + l * l * l * l), J2 = l * l * w2;
    EXPECT_NEAR(b, (l * l * (l * l - 1) + J2 * (J2 - 1)) / std::sqrt(J2), 1e-11);
    // The digitised curves run 0.02 to 0.1 Gs high: 1 to 8 %.
    EXPECT_NEAR(a, neo_hookean(e), 0.03 * a + 0.03);
    EXPECT_NEAR(b, skalak(e), 0.03 * b + 0.03);
  }
}

// Bending of the Evans-Fung shape: energy 2 k_b int H^2 dA, and the force density k_b (2 Lap H + 4 H (H^2 -
// K)) along the outward normal (H > 0 where convex) through its work against smooth normal displacements psi.
// Vertex by vertex the discrete force does not converge on such meshes; its work does, in the dimple late:
// with the meshes of red cells, 258 to 4098 vertices, it is 2.8 to 1.8 times too large there.
TEST(Helfrich, EnergyAndForceOfTheBiconcaveShape) {
  NEED_REFERENCE(folder, "rbc_exact_bending");
  const Curve size(folder + "/biconcave_curvatures__rbc_exact_bending.csv"),
      curvature(folder + "/biconcave_curvatures__rbc_exact_curv.csv"),
      gauss(folder + "/biconcave_curvatures__rbc_exact_gcurv.csv"),
      laplacian(folder + "/biconcave_curvatures__rbc_exact_lbcurv.csv");
  const auto force = [&](double a) {
    const double H = curvature(a);
    return 2 * laplacian(a) + 4 * H * (H * H - gauss(a));
  };
  // The tabulated force density is the same without its sign.
  for (double a = 0; a < 1.55; a += 0.05) EXPECT_NEAR(std::abs(force(a)), size(a), 1e-3 * size(a) + 1e-3);
  const double radius = 3.91;
  // psi of the polar angle: the dimple, the shoulder, the rim's neighbourhood.
  const std::function<double(double)> modes[] = {
      [](double a) { return std::exp(-std::pow(a / 0.6, 2)); },
      [](double a) { return std::pow(std::sin(2 * a), 4); },
      [](double a) { return std::pow(std::sin(a), 8) * std::pow(std::sin(2 * a), 2); }};
  // Over the profile r = sin t, z = cos t (c0 + c1 r^2 + c2 r^4)/2, unit radius, both sides.
  double exact_energy = 0, exact_work[3] = {};
  const int points = 4000;
  const auto height = [](double t) {
    const double r2 = std::pow(std::sin(t), 2);
    return 0.5 * std::cos(t) * (0.81 + 7.83 * r2 - 4.39 * r2 * r2) / 3.91;
  };
  for (int i = 0; i < points; ++i) {
    const double dt = M_PI / 2 / points, t = (i + 0.5) * dt;
    const double slope = (height(t + dt / 4) - height(t - dt / 4)) / (dt / 2);
    const double dA = 2 * 2 * M_PI * std::sin(t) * std::hypot(std::cos(t), slope) * dt;
    const double angle = std::atan2(std::sin(t), height(t));
    exact_energy += 2 * std::pow(curvature(angle), 2) * dA;
    for (int j = 0; j < 3; ++j) exact_work[j] += force(angle) * modes[j](angle) * dA;
  }
  Material m;
  m.bending = Bending::helfrich, m.reference_curvature = 0, m.bending_modulus = 1;
  std::printf("vertices  energy/k_b (%.2f)  work on three modes / k_b (%.2f %.2f %.2f)\n", exact_energy,
              exact_work[0], exact_work[1], exact_work[2]);
  double finest = 0, work[3] = {}, coarser[3] = {};
  for (const int n : {8, 16, 32, 64, 128}) {
    const auto rest = mesh::red_cell(1, n);
    const auto normal = mesh::vertex_normals(rest);
    const CellType type(rest, m, std::vector<double>(normal.size(), 400), 0.25);
    const auto f = forces(type, rest.vertices);
    for (int j = 0; j < 3; ++j) coarser[j] = work[j], work[j] = 0;
    for (std::size_t k = 0; k < f.size(); ++k) {
      const auto& p = rest.vertices[k];
      const double angle = std::atan2(std::hypot(p[0], p[2]), std::abs(p[1]));
      for (int j = 0; j < 3; ++j) work[j] += radius * mesh::dot(f[k], normal[k]) * modes[j](angle);
    }
    finest = energy(type, rest.vertices).bending;
    std::printf("%zu  %.2f  %.2f %.2f %.2f\n", f.size(), finest, work[0], work[1], work[2]);
  }
  EXPECT_NEAR(finest / exact_energy, 1, 0.01);
  // Of its own value: the dimple is not yet there with 65 538 vertices (7 %), but falls in by order 2; the
  // shoulder and the rim are.
  const double allowed[] = {0.1, 0.01, 0.01};
  for (int j = 0; j < 3; ++j) {
    EXPECT_NEAR(work[j] / exact_work[j], 1, allowed[j]) << "mode " << j;
    const double limit = work[j] + (work[j] - coarser[j]) / 3;
    EXPECT_NEAR(limit / exact_work[j], 1, 0.015) << "mode " << j << ", extrapolated by order 2";
  }
}

}  // namespace
}  // namespace hemowalk::npfem
