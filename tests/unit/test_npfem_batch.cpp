#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>
#include <cstring>

#include "resolved/mesh/rotation.hpp"
#include "resolved/npfem/membranes.hpp"
#include "resolved/npfem/reference.hpp"
#include "support/cells.hpp"

namespace hemowalk::npfem {
namespace {

using mesh::Vec3;
using support::Numbers;

template <class Real>
class Batch : public ::testing::Test {
 protected:
  static constexpr double epsilon = sizeof(Real) == 4 ? 6e-8 : 1.1e-16;
};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Batch, Precisions);

template <class Real>
void predict(Membranes<Real>& cells, int c, const std::vector<Vec3>& v) {
  for (int k = 0; k < cells.vertices(); ++k)
    for (int d = 0; d < 3; ++d) cells.predicted()[cells.layout().at(c, k, d)] = static_cast<Real>(v[k][d]);
}
template <class Real>
std::vector<Vec3> velocities(const Membranes<Real>& cells, int c) {
  std::vector<Vec3> v(cells.vertices());
  for (int k = 0; k < cells.vertices(); ++k)
    for (int d = 0; d < 3; ++d) v[k][d] = cells.velocities()[cells.layout().at(c, k, d)];
  return v;
}
/// A shear flow, a push and some noise, um/us.
std::vector<Vec3> flow(const std::vector<Vec3>& x, std::uint64_t seed) {
  Numbers numbers(seed);
  std::vector<Vec3> v(x.size());
  for (std::size_t k = 0; k < x.size(); ++k)
    v[k] = {2e-3 + 1e-3 * numbers(), 1e-3 * numbers(), 2e-3 * x[k][1] + 1e-3 * numbers()};
  return v;
}

std::vector<Material> materials() {
  std::vector<Material> list(5);
  list[0].drag_per_area = drag_per_area_of(0.7);
  list[1].law = Law::neo_hookean, list[1].bending = Bending::helfrich, list[1].reference_curvature = 0.1;
  list[2].law = Law::skalak, list[2].skalak_C = 10, list[2].bending = Bending::none;
  list[3].volume_force = VolumeForce::paper, list[3].rayleigh_beta = 0.01;
  list[4].drag_per_area = drag_per_area_of(0.9), list[4].damp_after = true, list[4].rayleigh_beta = 0.01;
  return list;
}

/// Edge vectors of length l ~ 1 at distance ~ 4 from the anchor: strains to epsilon, forces to epsilon times
/// the stiffest modulus times the edge, a few operations each (factor 40).
TYPED_TEST(Batch, ForcesAgreeWithTheReference) {
  using Real = TypeParam;
  for (const auto& m : materials()) {
    const auto type = support::red_cell_type(5, m);
    Membranes<Real> cells(type);
    cells.add(0, {0, 0, 0}, mesh::identity_rotation);
    const auto x = support::shaken(type->rest().vertices, 0.2, 5);
    cells.set_positions(0, x);
    const auto exact = forces(*type, x);
    const double stiffness = std::max(m.standin(), m.volume_modulus);
    EXPECT_LT(support::largest_difference(cells.forces(0), exact), 40 * this->epsilon * stiffness);
  }
}

/// Many iterations of the fast path and L-BFGS with line search find the same velocity.
TYPED_TEST(Batch, StepConvergesToTheReference) {
  using Real = TypeParam;
  for (const auto& m : materials()) {
    if (m.volume_force == VolumeForce::paper) continue;  // no energy to minimise
    const auto type = support::red_cell_type(4, m);
    Membranes<Real> cells(type);
    cells.add(0, {0, 0, 0}, mesh::identity_rotation);
    State s{support::shaken(type->rest().vertices, 0.02, 5), {}};
    s.v.resize(s.x.size(), Vec3{});
    cells.set_positions(0, s.x);
    const auto v = flow(s.x, 3);
    predict(cells, 0, v);
    const auto report = cells.step({.iterations = 200, .measure_residual = true});
    const auto solved = step_implicit(*type, s, v, 1e-11);
    EXPECT_LT(solved.residual, 1e-11);
    EXPECT_EQ(report.bad_cell, -1);
    // Round-off of the forces over the mass term, and of v itself.
    const double stiffness = std::max(m.standin(), m.volume_modulus);
    const double speed = support::largest(s.v);
    const double tolerance =
        100 * this->epsilon * (stiffness / type->metric()[0] * type->h() + speed) + 1e-9 * speed;
    EXPECT_LT(support::largest_difference(velocities(cells, 0), s.v), tolerance);
    EXPECT_LT(support::largest_difference(cells.positions(0), s.x), tolerance * type->h() + 1e-14);
  }
}

/// Both momenta of v_pred are kept after one unconverged iteration, with and without damping.
TYPED_TEST(Batch, MomentaAreKeptByOneIteration) {
  using Real = TypeParam;
  for (double kappa : {0.0, 0.9}) {
    Material m;
    m.C *= 50, m.B *= 50, m.D *= 50;  // far from converged
    m.drag_per_area = drag_per_area_of(kappa);
    auto rest = mesh::red_cell(1, 4);
    std::vector<double> metric;
    for (double a : mesh::vertex_areas(rest)) metric.push_back(100 + 500 * a);  // uneven, as m + k a is
    const auto type = std::make_shared<const CellType>(rest, m, metric, 0.25);
    Membranes<Real> cells(type);
    cells.add(0, {0, 0, 0}, mesh::identity_rotation);
    for (int i = 0; i < 5; ++i) {
      const auto x = cells.positions(0);
      const auto w = flow(x, i);
      predict(cells, 0, w);
      cells.step();
      const auto v = velocities(cells, 0);
      Vec3 linear{}, angular{};
      double size = 0, size_angular = 0;
      for (std::size_t k = 0; k < x.size(); ++k) {
        // what was really handed over, rounded to Real
        Vec3 gap;
        for (int d = 0; d < 3; ++d) gap[d] = v[k][d] - double(Real(w[k][d]));
        mesh::accumulate(linear, metric[k], gap);
        mesh::accumulate(angular, metric[k], mesh::cross(x[k], gap));
        size += metric[k] * (mesh::norm(v[k]) + mesh::norm(w[k]));
        size_angular += metric[k] * mesh::norm(x[k]) * (mesh::norm(v[k]) + mesh::norm(w[k]));
      }
      EXPECT_LT(mesh::norm(linear), 4 * this->epsilon * size) << kappa;
      EXPECT_LT(mesh::norm(angular), 8 * this->epsilon * size_angular) << kappa;
    }
  }
}

/// A cell's history is the same bits alone, in any lane, with any neighbours and threads.
TYPED_TEST(Batch, LanesAndThreadsDoNotMatter) {
  using Real = TypeParam;
  const auto type = support::red_cell_type(3);
  const auto shape = support::shaken(type->rest().vertices, 0.1, 2);
  const auto run = [&](int lane, int cells_in_all, int threads) {
    omp_set_num_threads(threads);
    Membranes<Real> cells(type);
    for (int c = 0; c < cells_in_all; ++c) {
      cells.add(c, {10.0 * c, 0, 0}, mesh::rotation({1, 2, 3}, c));
      if (c == lane) cells.set_positions(c, shape);
    }
    for (int i = 0; i < 20; ++i) {
      for (int c = 0; c < cells_in_all; ++c)
        predict(cells, c, flow(type->rest().vertices, c == lane ? 77 : c));
      cells.step({.iterations = 2});
    }
    std::vector<std::byte> state(cells.state_bytes());
    cells.save(lane, state.data());
    return std::vector<std::byte>(state.begin() + sizeof(std::int64_t), state.end());  // without the id
  };
  const int before = omp_get_max_threads();
  const auto alone = run(0, 1, 1);
  EXPECT_EQ(alone, run(7, 8, 1));
  EXPECT_EQ(alone, run(3, 5, 2));
  EXPECT_EQ(alone, run(37, 40, 3));
  omp_set_num_threads(before);
}

TYPED_TEST(Batch, SavedCellsContinueExactlyAndRemovalKeepsTheOthers) {
  using Real = TypeParam;
  const auto type = support::red_cell_type(3);
  Membranes<Real> cells(type);
  for (int c = 0; c < 19; ++c) cells.add(100 + c, {9.0 * c, 499, 1e4}, mesh::rotation({0, 1, 1}, c));
  const auto advance = [&](Membranes<Real>& group, int steps) {
    for (int i = 0; i < steps; ++i) {
      for (int c = 0; c < group.count(); ++c)
        predict(group, c, flow(type->rest().vertices, 31 * static_cast<std::uint64_t>(group.id(c)) + i));
      group.step();
    }
  };
  advance(cells, 5);
  Membranes<Real> copy(type);
  std::vector<std::byte> state(cells.state_bytes()), again(state);
  for (int c = 18; c >= 0; --c) {
    cells.save(c, state.data());
    copy.load(state.data());
  }
  cells.remove(4);
  EXPECT_EQ(cells.count(), 18);
  EXPECT_EQ(cells.id(4), 118);
  advance(cells, 5);
  advance(copy, 5);
  for (int c = 0; c < cells.count(); ++c)
    for (int o = 0; o < copy.count(); ++o)
      if (copy.id(o) == cells.id(c)) {
        cells.save(c, state.data());
        copy.save(o, again.data());
        EXPECT_EQ(state, again) << cells.id(c);
      }
}

/// 998 lattice units from the wall, 1.25e-5 per step, 1e5 steps: a single precision coordinate would not move
/// at all.
TEST(SinglePrecision, SlowCellFarFromTheOriginDriftsRight) {
  using Real = float;
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);  // one batch: a team would only wait
  auto rest = mesh::red_cell(2, 2);
  Material m;
  for (double* modulus : {&m.B, &m.C, &m.D, &m.volume_modulus, &m.bending_modulus}) *modulus /= 8200;
  std::vector<double> metric(rest.vertex_count(), 5.7);
  Membranes<Real> cells(std::make_shared<const CellType>(rest, m, metric, 1));
  cells.add(0, {20, 998, 20}, mesh::identity_rotation);  // drifts
  cells.add(1, {20, 998, 20}, mesh::identity_rotation);  // spins in free flight: v_pred = v
  const double speed = 1.25e-5, spin = 1e-7 / 7.82;      // a fifth of an ulp of the offsets per step
  std::vector<Vec3> turning;
  for (const auto& p : rest.vertices) turning.push_back(mesh::cross({spin, 0, 0}, p));
  cells.set_velocities(0, std::vector<Vec3>(rest.vertices.size(), Vec3{0, speed, 0}));
  cells.set_velocities(1, turning);
  const auto start = cells.positions(0), before = cells.positions(1);
  const int steps = 100000;
  for (int i = 0; i < steps; ++i) {
    predict(cells, 0, std::vector<Vec3>(rest.vertices.size(), Vec3{0, speed, 0}));
    predict(cells, 1, velocities(cells, 1));
    cells.step();
  }
  for (int k = 0; k < cells.vertices(); ++k)
    EXPECT_NEAR(cells.position(0, k)[1] - start[k][1], steps * speed, 1e-4 * steps * speed);
  const auto at = [&](const std::vector<Vec3>& x) {  // angle of the marker in the y-z plane
    return cells.observe(1).tank_treading_angle -
           mesh::observe(rest, x, cells.type().marker()).tank_treading_angle;
  };
  EXPECT_NEAR(-at(before), steps * spin, 1e-4 * steps * spin);
  omp_set_num_threads(threads);
}

TEST(Report, NamesACellThatIsNotFinite) {
  const auto type = support::red_cell_type(2);
  Membranes<float> cells(type);
  for (int c = 0; c < 20; ++c) cells.add(c, {9.0 * c, 0, 0}, mesh::identity_rotation);
  EXPECT_EQ(cells.step().bad_cell, -1);
  cells.predicted()[cells.layout().at(17, 3, 1)] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(cells.step().bad_cell, 17);
}

TEST(Report, StiffVolumeConverges) {
  Material m;
  m.law = Law::neo_hookean;
  m.volume_modulus = 1e5;  // sixteen times the mass term
  const auto type = support::red_cell_type(4, m);
  Membranes<double> cells(type);
  cells.add(0, {0, 0, 0}, mesh::identity_rotation);
  auto x = type->rest().vertices;
  for (auto& p : x) p = mesh::scale(1.01, p);
  cells.set_positions(0, x);
  const auto report = cells.step({.iterations = 30, .measure_residual = true});
  EXPECT_LT(report.residual, 1e-8);
}

/// Without elastic forces to speak of the paper's damping leaves v = V + omega x r + (1 - kappa) (v_pred - V
/// - omega x r), and that is what moves the vertices. The metric is laid out as the areas: kappa is the same
/// everywhere, and no rigid part comes from the damping itself.
TYPED_TEST(Batch, DampingAfterTheSolveMovesByTheDampedVelocity) {
  using Real = TypeParam;
  Material m;
  m.B = m.D = m.C = 1e-9, m.volume_modulus = 0, m.bending = Bending::none;
  m.drag_per_area = drag_per_area_of(0.9), m.damp_after = true;
  auto rest = mesh::red_cell(1, 4);
  auto metric = mesh::vertex_areas(rest);
  for (double& k : metric) k *= 800;
  const double h = 0.25;
  const auto type = std::make_shared<const CellType>(rest, m, metric, h);
  const double kappa = type->kappa_after()[0];
  EXPECT_NEAR(kappa / (1 - kappa), m.drag_per_area * h / 800, 1e-12);
  // The non-rigid part: a stretch along the axis of symmetry and across it has no momenta.
  Membranes<Real> cells(type);
  cells.add(0, {0, 0, 0}, mesh::identity_rotation);
  const auto x = cells.positions(0);
  std::vector<Vec3> v(x.size()), expected(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    const Vec3 rigid{0.1, 0.2, 0.3 + 0.1 * x[k][0]}, stretch{0.01 * x[k][0], -0.02 * x[k][1], 0.01 * x[k][2]};
    // rotation about y: omega = (0, -0.1, 0) gives (-0.1 z, 0, 0.1 x)
    v[k] = {rigid[0] - 0.1 * x[k][2] + stretch[0], rigid[1] + stretch[1], rigid[2] + stretch[2]};
    for (int d = 0; d < 3; ++d) expected[k][d] = v[k][d] - kappa * stretch[d];
  }
  predict(cells, 0, v);
  StepOptions options;
  options.iterations = 40;
  cells.step(options);
  const auto after = velocities(cells, 0), moved = cells.positions(0);
  for (std::size_t k = 0; k < x.size(); ++k)
    for (int d = 0; d < 3; ++d) {
      EXPECT_NEAR(after[k][d], expected[k][d], 40 * TestFixture::epsilon + 1e-9);
      EXPECT_NEAR(moved[k][d], x[k][d] + h * after[k][d], 40 * TestFixture::epsilon);
    }
}

TYPED_TEST(Batch, SpeedsAreCappedAndDriftFollowsWhatIsPredicted) {
  using Real = TypeParam;
  Membranes<Real> cells(support::red_cell_type(4));
  cells.add(0, {0, 0, 0}, mesh::identity_rotation);
  const auto x = cells.positions(0);
  predict(cells, 0, std::vector<Vec3>(x.size(), Vec3{0.3, 0, 0.4}));
  StepOptions options;
  options.velocity_cap = 0.1, options.iterations = 4;
  cells.step(options);
  for (const auto& v : velocities(cells, 0)) EXPECT_NEAR(mesh::norm(v), 0.1, 20 * TestFixture::epsilon);
  const auto start = cells.positions(0);
  const auto wild = flow(start, 5);
  predict(cells, 0, wild);
  cells.drift();
  const auto end = cells.positions(0), v = velocities(cells, 0);
  for (std::size_t k = 0; k < x.size(); ++k)
    for (int d = 0; d < 3; ++d) {
      EXPECT_EQ(v[k][d], static_cast<Real>(wild[k][d]));
      EXPECT_NEAR(end[k][d], start[k][d] + cells.h() * v[k][d], 10 * TestFixture::epsilon);
    }
}

}  // namespace
}  // namespace hemowalk::npfem
