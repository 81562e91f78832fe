#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <sstream>

#include "resolved/mesh/rotation.hpp"
#include "resolved/npfem/reference.hpp"
#include "resolved/npfem/terms/helfrich.hpp"
#include "resolved/npfem/terms/local_area.hpp"
#include "resolved/npfem/terms/neo_hookean.hpp"
#include "resolved/npfem/terms/skalak.hpp"
#include "resolved/npfem/terms/skalak_hardening.hpp"
#include "support/cells.hpp"

namespace hemowalk::npfem {
namespace {

using mesh::Vec3;
using support::Numbers;

struct Choice {
  Law law;
  Bending bending;
  const char* name;
};

/// Each term alone as far as possible, then all together. The volume force in the form printed in the paper
/// (VolumeForce::paper) is no gradient and is left out by name.
class Terms : public ::testing::TestWithParam<Choice> {
 protected:
  Material material() const {
    Material m;
    m.law = GetParam().law;
    m.bending = GetParam().bending;
    m.reference_curvature = 0.2;
    m.C = 500;  // all terms of comparable size
    m.bending_modulus = 2;
    return m;
  }
};

Vec3 direction_of(Numbers& numbers) { return {numbers(), numbers(), numbers()}; }

/// Central differences of the independently written energy along random displacements: their error must fall
/// with the square of the step, and at the best step agree to round-off of the energy.
TEST_P(Terms, ForceIsMinusTheGradientOfTheEnergy) {
  const auto type = support::red_cell_type(4, material());
  const auto x = support::shaken(type->rest().vertices, 0.25, 7);
  const auto f = forces(*type, x);
  Numbers numbers(11);
  for (int trial = 0; trial < 4; ++trial) {
    std::vector<Vec3> u(x.size());
    double work = 0, scale = 0;
    for (std::size_t k = 0; k < x.size(); ++k) {
      u[k] = direction_of(numbers);
      work += mesh::dot(f[k], u[k]);
      scale += std::abs(mesh::dot(f[k], u[k]));
    }
    const auto difference = [&](double step) {
      auto ahead = x, behind = x;
      for (std::size_t k = 0; k < x.size(); ++k) {
        mesh::accumulate(ahead[k], step, u[k]);
        mesh::accumulate(behind[k], -step, u[k]);
      }
      return std::abs((energy(*type, ahead).total() - energy(*type, behind).total()) / (2 * step) + work);
    };
    const double a = difference(4e-3), b = difference(2e-3), c = difference(1e-3);
    // Observed order between two pairs; a leading coefficient may be small by chance, hence "or already
    // tiny".
    const double tiny = 1e-7 * scale;
    EXPECT_TRUE(std::abs(std::log2(b / c) - 2) < 0.3 || c < tiny) << a << " " << b << " " << c;
    // eps E/step + step^2: best near 1e-5
    const double e = std::abs(energy(*type, x).total());
    EXPECT_LT(difference(1e-5), 10 * 2.2e-16 * e / 1e-5 + 1e-4 * c + 1e-12 * scale);
  }
}

TEST_P(Terms, RigidMotionChangesNothingAndForcesBalance) {
  const auto type = support::red_cell_type(4, material());
  const auto x = support::shaken(type->rest().vertices, 0.25, 3);
  const auto f = forces(*type, x);
  const auto q = mesh::rotation({1, 2, 3}, 1.1);
  auto moved = x;
  for (auto& p : moved) p = mesh::add({3, -2, 1}, mesh::rotate(q, p));
  const auto turned = forces(*type, moved);
  const double size = support::largest(f), round_off = 1e-12 * size;  // ~ 1e3 operations, stiff cancellations
  for (std::size_t k = 0; k < x.size(); ++k)
    EXPECT_LT(mesh::norm(mesh::subtract(turned[k], mesh::rotate(q, f[k]))), round_off);
  EXPECT_NEAR(energy(*type, moved).total(), energy(*type, x).total(), 1e-11 * energy(*type, x).total());
  Vec3 net{}, torque{};
  for (std::size_t k = 0; k < x.size(); ++k) {
    mesh::accumulate(net, 1, f[k]);
    mesh::accumulate(torque, 1, mesh::cross(x[k], f[k]));
  }
  EXPECT_LT(mesh::norm(net), round_off);
  EXPECT_LT(mesh::norm(torque), 10 * round_off);
}

TEST_P(Terms, RestShapeOfTheSheetIsFreeOfForce) {
  if (GetParam().bending == Bending::helfrich) GTEST_SKIP() << "Helfrich bending has its own rest shape";
  const auto type = support::red_cell_type(5, material());
  const double stiffness = material().C;  // force scale of a strain of order one over 1 um
  EXPECT_LT(support::largest(forces(*type, type->rest().vertices)), 1e-12 * stiffness);
  EXPECT_NEAR(energy(*type, type->rest().vertices).total(), 0, 1e-12 * stiffness);
}

INSTANTIATE_TEST_SUITE_P(, Terms,
                         ::testing::Values(Choice{Law::paper, Bending::none, "paper_sheet"},
                                           Choice{Law::paper, Bending::paper, "paper_with_edge_bending"},
                                           Choice{Law::paper, Bending::helfrich, "paper_with_helfrich"},
                                           Choice{Law::neo_hookean, Bending::none, "neo_hookean"},
                                           Choice{Law::neo_hookean, Bending::helfrich,
                                                  "neo_hookean_with_helfrich"},
                                           Choice{Law::skalak, Bending::none, "skalak"},
                                           Choice{Law::skalak, Bending::paper, "skalak_with_edge_bending"}),
                         [](const auto& choice) { return choice.param.name; });

/// The force of the printed volume term does no work around closed paths only if it is a gradient; it is not.
TEST(VolumeTerm, PrintedFormIsNoGradient) {
  Material m;
  m.volume_force = VolumeForce::paper;
  m.volume_modulus = 1e4;
  m.C = 0, m.B = 0, m.D = 0, m.bending = Bending::none;
  // the stand-in needs no stiffness: the mass keeps the matrix definite
  const auto type = support::red_cell_type(3, m);
  m.volume_force = VolumeForce::gradient;
  const auto gradient = support::red_cell_type(3, m);
  // Work around a small loop spanned by two displacements = antisymmetric part of the stiffness.
  const auto work = [](const CellType& t) {
    Numbers numbers(5);
    const auto x = support::shaken(t.rest().vertices, 0.4, 9);
    std::vector<Vec3> u(x.size()), v(x.size());
    for (std::size_t k = 0; k < x.size(); ++k) u[k] = direction_of(numbers), v[k] = direction_of(numbers);
    const double e = 1e-4;
    const auto slope = [&](const std::vector<Vec3>& along, const std::vector<Vec3>& onto) {
      auto a = x, b = x;
      for (std::size_t k = 0; k < x.size(); ++k)
        mesh::accumulate(a[k], e, along[k]), mesh::accumulate(b[k], -e, along[k]);
      const auto fa = forces(t, a), fb = forces(t, b);
      double sum = 0;
      for (std::size_t k = 0; k < x.size(); ++k)
        sum += mesh::dot(mesh::subtract(fa[k], fb[k]), onto[k]) / (2 * e);
      return sum;
    };
    return std::abs(slope(u, v) - slope(v, u)) / (std::abs(slope(u, v)) + std::abs(slope(v, u)));
  };
  EXPECT_LT(work(*gradient), 1e-6);  // e^2 and round-off/e
  EXPECT_GT(work(*type), 1e-3);
}

TEST(LocalArea, MultiplierProjectsOntoUnitArea) {
  for (double s1 : {0.5, 0.7, 0.9, 0.99, 1.0, 1.01, 1.2, 1.5, 2.0})
    for (double s2 : {0.6, 0.8, 0.95, 1.0, 1.0001, 1.1, 1.4}) {
      if (s1 * s2 > 1.6 || s1 * s2 < 0.4) continue;
      const Stretch<double> s{s1 * s1 + s2 * s2, s1 * s2, s1 + s2};
      const double l = LocalArea<double>::multiplier(s);
      const double a = (s1 - l * s2) / (1 - l * l), b = (s2 - l * s1) / (1 - l * l);
      EXPECT_NEAR(a * b, 1, 1e-12) << s1 << " " << s2;
      EXPECT_NEAR(((s1 - a) * (s1 - a) + (s2 - b) * (s2 - b)) / 2, local_area_energy(1, s1, s2), 1e-13);
      const Stretch<float> f{float(s.I1), float(s.J), float(s.t)};
      // two Newton steps reach single precision within [-0.3, 0.6] of area strain, and 5e-4 beyond
      const double tolerance = s.J > 0.7 ? 4e-7 + 2e-6 * std::abs(l) : 5e-4;
      EXPECT_NEAR(LocalArea<float>::multiplier(f), l, tolerance) << s1 << " " << s2;
    }
}

TEST(LocalArea, StaysFiniteFarFromRest) {
  for (double s1 : {1e-5, 0.05, 3.0, 20.0})
    for (double s2 : {1e-5, 0.1, 1.0, 10.0}) {
      const Stretch<float> s{float(s1 * s1 + s2 * s2), float(s1 * s2), float(s1 + s2)};
      const auto g = LocalArea<float>{5000}.gradient(s);
      EXPECT_TRUE(std::isfinite(g.t) && std::isfinite(g.J)) << s1 << " " << s2;
    }
}

TEST(Material, SmallStrainModuliFollowFromTheEnergies) {
  // w = 2 G e^2 for stretches (1+e, 1-e) and K (2e)^2/2 for (1+e, 1+e), both to O(e^3).
  Material m;
  const double e = 1e-4;
  const auto check = [&](auto w) {
    EXPECT_NEAR(w(1 + e, 1 - e) / (2 * e * e), m.shear_modulus(), 1e-3 * m.shear_modulus());
    EXPECT_NEAR(w(1 + e, 1 + e) / (2 * e * e), m.area_modulus(), 1e-3 * m.area_modulus());
  };
  m.C = 20;
  check([&](double a, double b) {
    return skalak_hardening_energy(m.B, m.D, a, b) + local_area_energy(m.C, a, b);
  });
  m.law = Law::neo_hookean;
  check([&](double a, double b) { return neo_hookean_energy(m.Gs, a, b); });
  m.law = Law::skalak, m.skalak_C = 3;
  check([&](double a, double b) { return skalak_energy(m.Gs, m.skalak_C, a, b); });
}

TEST(Material, KappaAsADragPerArea) {
  EXPECT_NEAR(drag_per_area_of(0.9), 28200, 10);  // method 3
  EXPECT_NEAR(kappa_of(drag_per_area_of(0.7), 0.511, 0.25, 400.3), 0.7, 1e-15);
  // kappa/(1-kappa) is proportional to h and to 1/m
  const double k = kappa_of(drag_per_area_of(0.5), 0.511, 1.0, 200.15);
  EXPECT_NEAR(k / (1 - k), 8, 1e-12);
}

TEST(Helfrich, AngleCoversTheWholeCircle) {
  for (int i = -170; i <= 170; i += 5) {
    const double angle = i * std::numbers::pi / 180;
    EXPECT_NEAR(angle_of(std::cos(angle), std::sin(angle)), angle, 2e-15);
    EXPECT_NEAR(angle_of(float(std::cos(angle)), float(std::sin(angle))), angle, 2e-6);
  }
}

/// E = 2 k_b (1/R - H0)^2 4 pi R^2 on a sphere; the sign of H0 matters.
TEST(Helfrich, SphereHasTheEnergyOfTheContinuum) {
  for (double h0 : {0.0, 0.3, -0.3}) {
    Material m;
    m.bending = Bending::helfrich;
    m.bending_modulus = 1;
    m.reference_curvature = h0;
    const double radius = 2,
                 exact = 2 * std::pow(1 / radius - h0, 2) * 4 * std::numbers::pi * radius * radius;
    double error[2];
    for (int i = 0; i < 2; ++i) {
      auto rest = mesh::sphere(radius, 8 << i);
      std::vector<double> metric(rest.vertex_count(), 1.0);
      const CellType type(std::move(rest), m, metric, 1);
      error[i] = std::abs(energy(type, type.rest().vertices).bending / exact - 1);
    }
    // Juelicher's energy keeps a mesh-dependent offset (vertex areas by thirds), so no order is asserted.
    EXPECT_LT(error[1], 0.05) << h0;
    EXPECT_LT(error[1], error[0] + 0.01);
  }
}

/// Uniaxial tension (T2 = 0) of one element against Barthes-Biesel et al. 2002: T1/Gs over e = (s1^2 - 1)/2,
/// Skalak with C = 1. Digitised curves: 3 % of the value plus 0.04 of reading error.
TEST(Constitutive, UniaxialTensionFollowsThePublishedCurves) {
  const std::string folder = HEMOWALK_SOURCE_DIR "/../shared/data/uniaxial_stretch/uniaxial_stretch__BB2002_";
  if (!std::filesystem::exists(folder + "skalak.csv")) GTEST_SKIP() << "reference data not present";
  const auto tension = [](const auto& law, double s1) {
    // T_i = (1/s_j) dw/ds_i, dw/ds_i = 2 s_i w_I1 + w_t + s_j w_J; s2 by bisection on T2 = 0
    double low = 0.2, high = 1.2;
    const auto slopes = [&](double s2) {
      const auto g = law.gradient(Stretch<double>{s1 * s1 + s2 * s2, s1 * s2, s1 + s2});
      return std::pair{(2 * s1 * g.I1 + g.t + s2 * g.J) / s2, (2 * s2 * g.I1 + g.t + s1 * g.J) / s1};
    };
    for (int i = 0; i < 100; ++i) {
      const double mid = (low + high) / 2;
      (slopes(mid).second > 0 ? high : low) = mid;
    }
    return slopes(low).first;
  };
  const auto compare = [&](const std::string& name, const auto& law) {
    std::ifstream in(folder + name);
    std::string line;
    int points = 0;
    while (std::getline(in, line)) {
      double e = 0, t = 0;
      char comma = 0;
      std::istringstream(line) >> e >> comma >> t;
      EXPECT_NEAR(tension(law, std::sqrt(1 + 2 * e)), t, 0.03 * std::abs(t) + 0.04)
          << name << " at e = " << e;
      ++points;
    }
    EXPECT_GT(points, 20);
  };
  compare("neo-hookean.csv", NeoHookean<double>{1});
  compare("skalak.csv", Skalak<double>{1, 1});
}

}  // namespace
}  // namespace hemowalk::npfem
