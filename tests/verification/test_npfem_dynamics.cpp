#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/data/scene.hpp"
#include "resolved/mesh/rotation.hpp"
#include "resolved/npfem/membranes.hpp"
#include "resolved/npfem/reference.hpp"
#include "support/cells.hpp"
#include "support/optical_tweezers.hpp"

namespace hemowalk::npfem {
namespace {

using mesh::Vec3;

class Dynamics : public ::testing::Test {
 protected:
  void SetUp() override { threads_ = omp_get_max_threads(), omp_set_num_threads(1); }
  void TearDown() override { omp_set_num_threads(threads_); }
  int threads_ = 1;
};

void free_flight(Membranes<double>& cells) {
  const auto v = cells.velocities();
  for (std::size_t i = 0; i < v.size; ++i) cells.predicted()[i] = v[i];
}

/// Massless relaxation zeta x' = F_int(x): with metric/h = zeta and v_pred = 0 a step is backward Euler or
/// Runge-Kutta of this equation. The stretched cell is symmetric, so that the projection on its momenta,
/// which are zero, takes nothing.
TEST_F(Dynamics, RungeKuttaIsOfFourthOrderWhereTheImplicitStepIsOfFirst) {
  Material m;
  m.C = 50;
  const double drag = 100, end = 1.6;  // pN us/um per vertex, us
  const auto relax = [&](double h, bool runge_kutta) {
    const auto type = support::red_cell_type(3, m, h, drag * h * 38);
    Membranes<double> cells(type);
    cells.add(0, {0, 0, 0}, mesh::identity_rotation);
    auto x = type->rest().vertices;
    for (auto& p : x) p = {1.04 * p[0], p[1] * 0.97, p[2] * 0.98};
    cells.set_positions(0, x);
    for (int i = 0; i < std::lround(end / h); ++i) {
      std::fill(cells.predicted().data, cells.predicted().data + cells.predicted().size, 0.0);
      cells.step({.iterations = 30, .runge_kutta = runge_kutta});
    }
    return cells.positions(0);
  };
  const auto exact = relax(0.0125, true);
  const auto order = [&](bool runge_kutta, double h) {
    return std::log2(support::largest_difference(relax(h, runge_kutta), exact) /
                     support::largest_difference(relax(h / 2, runge_kutta), exact));
  };
  EXPECT_NEAR(order(true, 0.2), 4, 0.5);
  EXPECT_NEAR(order(true, 0.1), 4, 0.4);
  EXPECT_NEAR(order(false, 0.1), 1, 0.15);
  EXPECT_NEAR(order(false, 0.05), 1, 0.1);
}

/// Implicit Euler against Runge-Kutta of fourth order: first order in h.
TEST_F(Dynamics, ImplicitStepIsOfFirstOrder) {
  Material m;
  m.C = 50;
  const double end = 4;  // us, about two periods of the fastest modes
  const auto start = [](const CellType& type) {
    auto x = type.rest().vertices;
    for (auto& p : x) p = {1.04 * p[0], p[1] * 0.97, p[2] * 0.98};
    return x;
  };
  const auto exact_type = support::red_cell_type(3, m, 0.25);
  State s{start(*exact_type), std::vector<Vec3>(exact_type->rest().vertices.size(), Vec3{})};
  const ExternalForce none = [](double, const auto&, const auto&, auto&) {};
  for (int i = 0; i < 400; ++i) step_rk4(*exact_type, s, 0.01 * i, 0.01, none);
  double error[3];
  for (int level = 0; level < 3; ++level) {
    const double h = 0.04 / (1 << level);
    Membranes<double> cells(support::red_cell_type(3, m, h));
    cells.add(0, {0, 0, 0}, mesh::identity_rotation);
    cells.set_positions(0, start(cells.type()));
    for (int i = 0; i < std::lround(end / h); ++i) {
      free_flight(cells);
      cells.step({.iterations = 8});
    }
    error[level] = support::largest_difference(cells.positions(0), s.x);
  }
  EXPECT_NEAR(std::log2(error[0] / error[1]), 1, 0.25);
  EXPECT_NEAR(std::log2(error[1] / error[2]), 1, 0.15);
}

/// kappa damping is a drag c_A A_k on the non-rigid velocity: the release of a small strain follows
/// c_A A_k dx_k/dt = F_k, integrated here explicitly, whatever h, mesh, mass and kappa. What else could move
/// the rate: the first order of the step, h rate/2 <= 0.14 %, and the start from rest, which takes the time
/// m/(c_A A) <= 1 us of the 350 us followed at the least, 0.28 %: 0.5 % in all.
TEST_F(Dynamics, KappaReleaseFollowsDragOverStiffness) {
  Material m;
  m.law = Law::neo_hookean;
  m.bending = Bending::none;
  const double radius = 3, strain = 0.01;
  double worst = 0;
  for (int n : {3, 6})
    for (double kappa : {0.5, 0.8, 0.9}) {
      const auto rest = mesh::sphere(radius, n);
      const auto area = mesh::vertex_areas(rest);
      auto x0 = rest.vertices;
      for (auto& p : x0) p = {p[0] * (1 + strain), p[1] / (1 + strain), p[2]};
      m.drag_per_area = drag_per_area_of(kappa);
      const auto amplitude = [&](const std::vector<Vec3>& x) {
        double sum = 0, square = 0;
        for (std::size_t k = 0; k < x.size(); ++k) {
          const auto u = mesh::subtract(x0[k], rest.vertices[k]);
          sum += mesh::dot(mesh::subtract(x[k], rest.vertices[k]), u);
          square += mesh::dot(u, u);
        }
        return sum / square;
      };
      const auto metric = [&](double mass) {
        std::vector<double> of(area);
        for (double& a : of) a *= mass * 400.3 / 0.511;
        return of;
      };
      // A quarter of the relaxation time c_A R^2/(4 Gs), on steps of 1/800 of that, second order.
      const double end = std::round(m.drag_per_area * radius * radius / (4 * m.Gs) / 16) * 16 / 4;
      const CellType plain(rest, m, metric(1), 1);
      auto x = x0;
      const int fine = 800;
      const auto slope = [&](const std::vector<Vec3>& at) {
        auto f = forces(plain, at);
        for (std::size_t k = 0; k < f.size(); ++k) f[k] = mesh::scale(1 / (m.drag_per_area * area[k]), f[k]);
        return f;
      };
      for (int i = 0; i < fine; ++i) {
        auto mid = x;
        const auto first = slope(x);
        for (std::size_t k = 0; k < x.size(); ++k) mesh::accumulate(mid[k], end / fine / 2, first[k]);
        const auto second = slope(mid);
        for (std::size_t k = 0; k < x.size(); ++k) mesh::accumulate(x[k], end / fine, second[k]);
      }
      const double exact = -std::log(amplitude(x)) / end;
      ASSERT_GT(exact * end, 0.1) << "hardly relaxed: the test would be empty";
      for (const auto& [h, mass] :
           {std::pair{0.25, 1.0}, {1.0, 0.25}, {1.0, 1.0}, {1.0, 4.0}, {4.0, 0.25}, {4.0, 1.0}, {4.0, 4.0}}) {
        Membranes<double> cells(std::make_shared<const CellType>(rest, m, metric(mass), h));
        cells.add(0, {0, 0, 0}, mesh::identity_rotation);
        cells.set_positions(0, x0);
        const int steps = static_cast<int>(std::lround(end / h));
        for (int i = 0; i < steps; ++i) {
          free_flight(cells);
          cells.step();
        }
        const double rate = -std::log(amplitude(cells.positions(0))) / (steps * h);
        EXPECT_NEAR(rate, exact, 0.005 * exact)
            << "n " << n << " kappa " << kappa << " h " << h << " mass " << mass;
        worst = std::max(worst, std::abs(rate / exact - 1));
      }
    }
  std::printf("[ kappa    ] largest deviation of a rate %.2f %%\n", 100 * worst);
}

/// The paper's red cell pulled at 2 % of its vertices on each side (method 3, measured on the authors'
/// solver; axial: distance of the centres of the pulled patches; transverse: width across the pull).
TEST_F(Dynamics, StretchedRedCellMatchesTheAuthorsSolver) {
  const std::vector<double> force{25, 50, 75, 100, 150, 200};
  const double axial[6] = {10.76, 12.18, 13.19, 14.04, 15.30, 16.24};
  const double transverse[6] = {5.89, 5.52, 5.03, 4.57, 4.00, 3.83};
  const auto cells = support::stretch({}, force);
  for (int c = 0; c < 6; ++c) {
    // two printed digits, the residue of the relaxation, and for the width the wrinkle at small pull
    EXPECT_NEAR(cells[c].axial, axial[c], 0.005 * axial[c]) << force[c];
    EXPECT_NEAR(cells[c].transverse, transverse[c], 0.015 * transverse[c]) << force[c];
    printf("[ stretch  ] %g pN: axial %.2f (%.2f) um, transverse %.2f (%.2f) um\n", force[c], cells[c].axial,
           axial[c], cells[c].transverse, transverse[c]);
  }
}

/// One iteration per step is enough: the paper's red cell in lattice units (dx 0.5 um, dt 0.125 us), moduli
/// and shear rate times the acceleration, inertia m + a with a = chi rho A dx as shipped and Stokes-like drag
/// towards a shear flow. Prints the table of docs/evidence/solid.md.
TEST_F(Dynamics, OneIterationFollowsTheConvergedSolution) {
  const auto run = [](double s, double kappa, int iterations) {
    auto rest = mesh::red_cell(2, 8);
    Material m;
    for (double* modulus : {&m.B, &m.C, &m.D, &m.volume_modulus}) *modulus *= s / 8200;
    m.bending_modulus *= 4 * s / 8200;
    m.drag_per_area = drag_per_area_of(kappa) / 128.125 * 0.125 * 0.25;
    const auto area = mesh::vertex_areas(rest);
    const double whole = std::accumulate(area.begin(), area.end(), 0.0), rate = 1.25e-5 * s;
    std::vector<double> metric;
    for (double a : area) metric.push_back(0.278 + data::Coupling{}.chi * a);
    Membranes<double> cells(std::make_shared<const CellType>(rest, m, metric, 1));
    cells.add(0, {0, 0, 0}, mesh::rotation({1, 0.3, 0.2}, 0.7));
    std::vector<Vec3> v;
    for (const auto& p : cells.positions(0)) v.push_back({0, 0, rate * p[1]});
    cells.set_velocities(0, v);
    const auto at = cells.layout();
    for (int i = 0; i < 300; ++i) {
      for (int k = 0; k < cells.vertices(); ++k)
        for (int d = 0; d < 3; ++d) {
          const double u = d == 2 ? rate * cells.offsets()[at.at(0, k, 1)] : 0;
          const double now = cells.velocities()[at.at(0, k, d)];
          const double drag = 0.5 * 6 * std::numbers::pi * 7.82 * area[k] / whole / metric[k];
          cells.predicted()[at.at(0, k, d)] = now - drag * (now - u);
        }
      cells.step({.iterations = iterations});
    }
    return cells.positions(0);
  };
  // Allowed of the radius with one iteration: twice what is measured. Started from v_pred it misses 8 to 22
  // times as much (docs/evidence/solid.md).
  const struct {
    double acceleration, kappa, allowed;
  } cases[] = {{1, 0, 3e-6}, {16, 0.9, 2e-5}, {50, 0.9, 1.6e-4}, {50, 0, 2.2e-3}};
  printf("acceleration, kappa, strain: largest (rms) error of the radius with 1, 2, 3 iterations\n");
  for (const auto& c : cases) {
    const auto converged = run(c.acceleration, c.kappa, 15);
    double before = c.allowed;
    printf("%g, %g, %.3f:", c.acceleration, c.kappa, 300 * 1.25e-5 * c.acceleration);
    for (const int iterations : {1, 2, 3}) {
      const auto x = run(c.acceleration, c.kappa, iterations);
      double square = 0;
      for (std::size_t k = 0; k < x.size(); ++k)
        square += std::pow(mesh::norm(mesh::subtract(x[k], converged[k])), 2);
      const double error = support::largest_difference(x, converged) / 7.82;
      printf("  %.1e (%.1e)", error, std::sqrt(square / static_cast<double>(x.size())) / 7.82);
      EXPECT_LT(error, before) << c.acceleration << ", " << c.kappa << ", " << iterations << " iterations";
      before = error / 1.5;  // each takes a good part of what is left
    }
    printf("\n");
  }
}

}  // namespace
}  // namespace hemowalk::npfem
