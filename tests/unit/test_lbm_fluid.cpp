// The fast fluid against the readable one, what it conserves, and what must not change its results.

#include <gtest/gtest.h>
#include <omp.h>

#include "core/check.hpp"
#include "resolved/lbm/reference_fluid.hpp"
#include "support/lbm_flows.hpp"

namespace hemowalk::lbm {
namespace {

using namespace hemowalk::test;

constexpr double pi = 3.14159265358979323846;

/// Sets the number of threads for one scope.
struct Threads {
  explicit Threads(int n) : before(omp_get_max_threads()) { omp_set_num_threads(n); }
  ~Threads() { omp_set_num_threads(before); }
  int before;
};

Parameters moving_walls(Collision collision, Forcing forcing, bool walls) {
  Parameters p;
  p.tau = 0.9;
  p.collision = collision;
  p.forcing = forcing;
  p.walls_y = walls;
  p.lower_wall_velocity = {0.01, 0, -0.02};
  p.upper_wall_velocity = {-0.01, 0, 0.05};
  p.body_force = {1e-5, -2e-5, 3e-5};
  return p;
}

/// A flow without symmetry whose velocities stay below 0.06 and whose density varies.
FlowPoint wavy(const Block& b, double x, double y, double z) {
  return {1 + 0.001 * std::sin(2 * pi * x / b.nx),
          {0.01 * std::sin(2 * pi * z / b.nz), 0.002 * std::cos(2 * pi * x / b.nx), 0.02 * y / b.ny}};
}

bool bump(const Block& b, int i, int j, int k) {
  return (i < 2 && j < 2) || (i == b.nx - 1 && j == b.ny / 2 && k == 0) || (j == b.ny - 1 && i > b.nx / 2);
}

// ---- against the reference

template <class Real>
void compare_with_reference(const Block& b, const Parameters& p, bool solid, int steps) {
  Fluid<Real> fluid(b, p);
  ReferenceFluid reference(b, p);
  if (solid) {
    fluid.set_solid([&](int i, int j, int k) { return bump(b, i, j, k); });
    reference.set_solid([&](int i, int j, int k) { return bump(b, i, j, k); });
  }
  const auto flow = [&](double x, double y, double z) { return wavy(b, x, y, z); };
  fluid.initialise(flow);
  reference.initialise(flow);
  RandomForce<Real> force(b, 1e-3);
  Field<double> force64(b.size());
  Field<Real> u(b.size());
  Field<double> v(b.size());
  // Worst case of rounding: every step adds at most one round-off of each of 19 terms, relative to the
  // largest population it is stored as (the reference rounds f ~ 1/3; the fast one f - w, |f - w| < 0.02
  // here).
  const double per_node = steps * 19 * (round_off(Real()) * 0.02 + round_off(double()) / 3);
  const double per_wall = per_node * 5 * b.nx * b.nz;
  for (int t = 0; t < steps; ++t) {
    force.next();
    for_nodes(b, [&](int i, int j, int k) {
      const auto& F = force.field[b.at(i, j, k)];
      force64[b.at(i, j, k)] = {F.x, F.y, F.z, 0};
    });
    fluid.advance(force.view(), u.view());
    reference.advance(force64.view(), v.view());
    ASSERT_LE(largest_difference(b, u, v), per_node) << "step " << t;
    const WallImpulse a = fluid.wall_impulse(), r = reference.wall_impulse();
    for (int d = 0; d < 3; ++d) {
      ASSERT_NEAR(a.lower[d], r.lower[d], per_wall) << "step " << t;
      ASSERT_NEAR(a.upper[d], r.upper[d], per_wall) << "step " << t;
      ASSERT_NEAR(a.solid[d], r.solid[d], 4 * per_wall) << "step " << t;
    }
  }
  double fastest = 0;
  for_nodes(b, [&](int i, int j, int k) { fastest = std::max(fastest, std::fabs(v[b.at(i, j, k)].z)); });
  EXPECT_GT(fastest, 1e-3) << "the comparison must not be of two fluids at rest";
}

using Case = std::tuple<Collision, Forcing, bool, bool>;
class AgainstReference : public testing::TestWithParam<Case> {};

TEST_P(AgainstReference, AgreesToRoundOffUnderRandomForces) {
  const auto [collision, forcing, walls, solid] = GetParam();
  const Parameters p = moving_walls(collision, forcing, walls);
  compare_with_reference<double>({21, 7, 5}, p, solid, 300);
  compare_with_reference<float>({37, 6, 4}, p, solid, 200);
}

INSTANTIATE_TEST_SUITE_P(Physics, AgainstReference,
                         testing::Combine(testing::Values(Collision::trt, Collision::bgk),
                                          testing::Values(Forcing::guo, Forcing::shan_chen), testing::Bool(),
                                          testing::Bool()));

TEST(AgainstReferenceShapes, AnyBlockSize) {
  for (const Block& b : {Block{1, 2, 1}, Block{2, 3, 2}, Block{14, 2, 3}, Block{15, 3, 1}, Block{16, 4, 2},
                         Block{17, 5, 3}, Block{20, 3, 2}, Block{24, 3, 2}, Block{32, 3, 2}, Block{33, 2, 7}})
    for (bool walls : {true, false}) {
      compare_with_reference<double>(b, moving_walls(Collision::trt, Forcing::guo, walls), false, 20);
      compare_with_reference<float>(b, moving_walls(Collision::trt, Forcing::guo, walls), false, 20);
    }
}

// ---- conservation and bookkeeping

template <class Real>
class FluidOf : public testing::Test {};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(FluidOf, Reals);

TYPED_TEST(FluidOf, MassIsKeptAndMomentumIsForceMinusImpulse) {
  using Real = TypeParam;
  const Block b{19, 8, 6};
  for (const bool solid : {false, true})
    for (const bool walls : {true, false}) {
      const Parameters p = moving_walls(Collision::trt, Forcing::guo, walls);
      Fluid<Real> fluid(b, p);
      if (solid) fluid.set_solid([&](int i, int j, int k) { return bump(b, i, j, k); });
      fluid.initialise([&](double x, double y, double z) { return wavy(b, x, y, z); });
      RandomForce<Real> force(b, 1e-3, 7);
      // 19 populations per node, each rounded a few times at a size below 0.02.
      const double tolerance = 4 * 19 * 0.02 * round_off(Real()) * static_cast<double>(b.interior());
      Totals before = fluid.totals();
      double largest_change = 0;
      for (int t = 0; t < 50; ++t) {
        force.next();
        Vec3 sum{};
        for_nodes(b, [&](int i, int j, int k) {
          if (fluid.is_solid(i, j, k)) return;
          const auto& F = force.field[b.at(i, j, k)];
          sum = {sum[0] + F.x + p.body_force[0], sum[1] + F.y + p.body_force[1],
                 sum[2] + F.z + p.body_force[2]};
        });
        fluid.collide_and_stream(force.view());
        const Totals after = fluid.totals();
        const WallImpulse wall = fluid.wall_impulse();
        ASSERT_NEAR(after.mass, before.mass, tolerance);
        for (int a = 0; a < 3; ++a) {
          ASSERT_NEAR(after.momentum[a] - before.momentum[a],
                      sum[a] - wall.lower[a] - wall.upper[a] - wall.solid[a], tolerance)
              << "axis " << a << " step " << t << (solid ? " solid" : "") << (walls ? " walls" : "");
          largest_change = std::max(largest_change, std::fabs(after.momentum[a] - before.momentum[a]));
        }
        before = after;
      }
      EXPECT_GT(largest_change, 10 * tolerance) << "the balance must be sharper than what it balances";
    }
}

TYPED_TEST(FluidOf, AdvanceIsCollideThenMomentsBitForBit) {
  using Real = TypeParam;
  for (const Block& b : {Block{37, 9, 7}, Block{16, 2, 1}, Block{5, 4, 2}})
    for (const bool solid : {false, true}) {
      const Parameters p = moving_walls(Collision::trt, Forcing::guo, true);
      Fluid<Real> one(b, p), two(b, p);
      for (auto* f : {&one, &two}) {
        if (solid) f->set_solid([&](int i, int j, int k) { return bump(b, i, j, k); });
        f->initialise([&](double x, double y, double z) { return wavy(b, x, y, z); });
      }
      RandomForce<Real> force(b, 1e-3);
      Field<Real> u(b.size()), v(b.size());
      for (int t = 0; t < 7; ++t) {
        force.next();
        one.advance(force.view(), u.view());
        two.collide_and_stream(force.view());
        two.moments(v.view());
        ASSERT_TRUE(bitwise_equal(b, u, v)) << "step " << t;
      }
      EXPECT_EQ(one.save(), two.save());
    }
}

TYPED_TEST(FluidOf, AdvanceAddsTheShareOfTheForceThatACouplingReads) {
  using Real = TypeParam;
  const Block b{37, 9, 7};
  const Parameters p = moving_walls(Collision::trt, Forcing::guo, true);
  Fluid<Real> one(b, p), two(b, p);
  for (auto* f : {&one, &two}) f->initialise([&](double x, double y, double z) { return wavy(b, x, y, z); });
  RandomForce<Real> force(b, 1e-3);
  Field<Real> u(b.size()), v(b.size());
  const Real share = Real(0.485);
  for (int t = 0; t < 3; ++t) {
    force.next();
    one.advance(force.view(), u.view(), share);
    two.advance(force.view(), v.view());
    const double tolerance = 2 * round_off(Real()) * 0.1;  // one product, one sum of numbers below 0.1
    for_nodes(b, [&](int i, int j, int k) {
      const std::size_t n = b.at(i, j, k);
      const Node4<Real>&f = force.field[n], &with = u[n], &without = v[n];
      ASSERT_NEAR(with.x, without.x + share * f.x, tolerance);
      ASSERT_NEAR(with.y, without.y + share * f.y, tolerance);
      ASSERT_NEAR(with.z, without.z + share * f.z, tolerance);
    });
  }
}

TYPED_TEST(FluidOf, FieldsAreWrittenInTheInteriorOnly) {
  using Real = TypeParam;
  const Block b{13, 4, 3};
  Fluid<Real> fluid(b, {});
  Field<Real> u(b.size());
  for (auto& node : u) node = {7, 7, 7, 7};
  fluid.advance({}, u.view());
  std::size_t touched = 0;
  for (const auto& node : u) touched += node.x != 7 || node.y != 7 || node.z != 7 || node.w != 7;
  EXPECT_EQ(touched, b.interior());
  for_nodes(b, [&](int i, int j, int k) { EXPECT_EQ(u[b.at(i, j, k)].w, 0); });
}

TYPED_TEST(FluidOf, ResultsDoNotDependOnThreads) {
  using Real = TypeParam;
  const Block b{40, 20, 33};  // enough for 25 slabs
  const auto run = [&](int threads) {
    Threads scope(threads);
    Fluid<Real> fluid(b, moving_walls(Collision::trt, Forcing::guo, true));
    fluid.set_solid([&](int i, int j, int k) { return bump(b, i, j, k); });
    fluid.initialise([&](double x, double y, double z) { return wavy(b, x, y, z); });
    RandomForce<Real> force(b, 1e-3);
    Field<Real> u(b.size());
    for (int t = 0; t < 5; ++t) {
      force.next();
      fluid.advance(force.view(), u.view());
    }
    const WallImpulse w = fluid.wall_impulse();
    const Totals sums = fluid.totals();
    return std::tuple(fluid.save(), w.lower, w.upper, w.solid, sums.mass, sums.momentum);
  };
  const auto serial = run(1);
  for (int threads : {2, 3, 4, 16}) EXPECT_EQ(run(threads), serial) << threads << " threads";
}

/// The place of a node in a pack, a row or a plane must not matter: shifting forces shifts the flow, bit for
/// bit.
TYPED_TEST(FluidOf, ShiftedForcesGiveTheShiftedFlow) {
  using Real = TypeParam;
  for (const int nx : {35, 36, 40, 42}) {  // rests of a pack: idle lanes, and packs of their size
    const Block b{nx, 6, 5};
    Parameters p;
    p.walls_y = false;
    p.tau = 1.3;
    Fluid<Real> here(b, p), there(b, p);
    RandomForce<Real> force(b, 1e-3);
    Field<Real> shifted(b.size()), u(b.size()), v(b.size()), back(b.size());
    const auto moved = [&](int i, int j, int k) {
      return b.at((i + 5) % b.nx, (j + 2) % b.ny, (k + 3) % b.nz);
    };
    for (int t = 0; t < 8; ++t) {
      force.next();
      for_nodes(b, [&](int i, int j, int k) { shifted[moved(i, j, k)] = force.field[b.at(i, j, k)]; });
      here.advance(force.view(), u.view());
      there.advance(shifted.view(), v.view());
      for_nodes(b, [&](int i, int j, int k) { back[b.at(i, j, k)] = v[moved(i, j, k)]; });
      ASSERT_TRUE(bitwise_equal(b, u, back)) << "nx " << nx << " step " << t;
    }
  }
}

/// Mirror images of forces and walls give the mirror image of the flow, to round-off (sums change their
/// order).
TYPED_TEST(FluidOf, MirroredForcesGiveTheMirroredFlow) {
  using Real = TypeParam;
  const Block b{18, 7, 5};
  for (int axis = 0; axis < 3; ++axis) {
    Parameters p = moving_walls(Collision::trt, Forcing::guo, true), q = p;
    if (axis == 1) std::swap(q.lower_wall_velocity, q.upper_wall_velocity);
    for (auto* v : {&q.lower_wall_velocity, &q.upper_wall_velocity, &q.body_force}) (*v)[axis] *= -1;
    Fluid<Real> here(b, p), there(b, q);
    RandomForce<Real> force(b, 1e-3);
    Field<Real> image(b.size()), u(b.size()), v(b.size()), back(b.size());
    const auto mirrored = [&](int i, int j, int k) {
      return b.at(axis == 0 ? b.nx - 1 - i : i, axis == 1 ? b.ny - 1 - j : j, axis == 2 ? b.nz - 1 - k : k);
    };
    const auto flip = [&](Node4<Real> n) {
      (axis == 0 ? n.x : axis == 1 ? n.y : n.z) *= -1;
      return n;
    };
    const int steps = 40;
    for (int t = 0; t < steps; ++t) {
      force.next();
      for_nodes(b, [&](int i, int j, int k) { image[mirrored(i, j, k)] = flip(force.field[b.at(i, j, k)]); });
      here.advance(force.view(), u.view());
      there.advance(image.view(), v.view());
    }
    for_nodes(b, [&](int i, int j, int k) { back[b.at(i, j, k)] = flip(v[mirrored(i, j, k)]); });
    EXPECT_LE(largest_difference(b, u, back), steps * 19 * 0.02 * round_off(Real())) << "axis " << axis;
  }
}

// ---- checkpoints

TYPED_TEST(FluidOf, ARestartContinuesExactly) {
  using Real = TypeParam;
  const Block b{18, 5, 4};
  const Parameters p = moving_walls(Collision::trt, Forcing::guo, true);
  for (int before : {4, 5}) {  // both parities of the in-place update
    Fluid<Real> whole(b, p);
    whole.initialise([&](double x, double y, double z) { return wavy(b, x, y, z); });
    RandomForce<Real> force(b, 1e-3);
    Field<Real> u(b.size()), v(b.size());
    for (int t = 0; t < before; ++t) {
      force.next();
      whole.advance(force.view(), u.view());
    }
    const std::vector<std::byte> state = whole.save();
    Fluid<Real> resumed(b, p);
    resumed.load({state.data(), state.size()});
    EXPECT_EQ(resumed.steps(), before);
    resumed.moments(v.view());
    EXPECT_TRUE(bitwise_equal(b, u, v));
    for (int t = 0; t < 5; ++t) {
      force.next();
      whole.advance(force.view(), u.view());
      resumed.advance(force.view(), v.view());
      ASSERT_TRUE(bitwise_equal(b, u, v)) << "step " << t;
    }
    EXPECT_EQ(whole.save(), resumed.save());
    EXPECT_EQ(whole.wall_impulse().lower, resumed.wall_impulse().lower);
  }
}

TEST(Fluid, RefusesAStateThatDoesNotFit) {
  Fluid<float> fluid({8, 4, 4}, {});
  std::vector<std::byte> state = fluid.save();
  EXPECT_THROW(Fluid<double>({8, 4, 4}, {}).load({state.data(), state.size()}), InputError);
  EXPECT_THROW(Fluid<float>({8, 4, 5}, {}).load({state.data(), state.size()}), InputError);
  EXPECT_THROW(fluid.load({state.data(), state.size() - 1}), InputError);
  EXPECT_THROW(fluid.load({state.data(), 3}), InputError);
  state[0] = std::byte{0};
  EXPECT_THROW(fluid.load({state.data(), state.size()}), InputError);
}

TEST(Fluid, RefusesImpossibleParameters) {
  const auto with = [](auto change) {
    Parameters p;
    change(p);
    return p;
  };
  const Block b{4, 4, 4};
  EXPECT_THROW(Fluid<float>(b, with([](Parameters& p) { p.tau = 0.5; })), InputError);
  EXPECT_THROW(Fluid<float>(b, with([](Parameters& p) { p.tau = NAN; })), InputError);
  EXPECT_THROW(Fluid<float>(b, with([](Parameters& p) { p.magic = 0; })), InputError);
  EXPECT_THROW(Fluid<float>(b, with([](Parameters& p) { p.upper_wall_velocity = {0, 0.1, 0}; })), InputError);
  EXPECT_THROW(Fluid<float>({4, 0, 4}, {}), InputError);
  EXPECT_THROW(Fluid<float>({4, 1, 4}, {}), InputError);
  EXPECT_NO_THROW(Fluid<float>({4, 1, 4}, with([](Parameters& p) { p.walls_y = false; })));
}

}  // namespace
}  // namespace hemowalk::lbm
