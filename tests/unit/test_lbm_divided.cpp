// A domain divided along z gives, bit for bit, what the whole gives.

#include <gtest/gtest.h>

#include <memory>

#include "core/check.hpp"
#include "support/lbm_flows.hpp"

namespace hemowalk::lbm {
namespace {

using namespace hemowalk::test;

bool bump(const Block& b, int i, int j, int k) {
  return (i < 2 && j < 2) || (i == b.nx - 1 && j == b.ny / 2 && k % 3 == 0) ||
         (j == b.ny - 1 && i > b.nx / 2 && k > 4);
}

/// Blocks stacked along z, periodic as a whole, in one process.
template <class Real>
class Stack {
 public:
  Stack(const Block& whole, Parameters p, const std::vector<int>& planes, bool solid) : whole_(whole) {
    p.divided_z = true;
    int first = 0;
    for (const int nz : planes) {
      const Block b{whole.nx, whole.ny, nz};
      parts_.push_back(
          {b, first, std::make_unique<Fluid<Real>>(b, p), Field<Real>(b.size()), Field<Real>(b.size())});
      if (solid)
        parts_.back().fluid->set_solid([&, first](int i, int j, int k) {
          return bump(whole_, i, j, (first + k + whole_.nz) % whole_.nz);
        });
      first += nz;
    }
  }
  void initialise(const std::function<FlowPoint(double, double, double)>& flow) {
    for (auto& p : parts_)
      p.fluid->initialise([&](double x, double y, double z) { return flow(x, y, p.first + z); });
  }
  static constexpr Real share = Real(0.485);  ///< of the force in the velocity
  void exchange() {
    std::vector<std::vector<Real>> up, down;
    for (auto& p : parts_) {
      up.emplace_back(p.fluid->border_size());
      down.emplace_back(p.fluid->border_size());
      p.fluid->send_border(Side::high, {up.back().data(), up.back().size()});
      p.fluid->send_border(Side::low, {down.back().data(), down.back().size()});
    }
    const std::size_t n = parts_.size();
    for (std::size_t r = 0; r < n; ++r) {
      const auto& from_below = up[(r + n - 1) % n];
      const auto& from_above = down[(r + 1) % n];
      parts_[r].fluid->receive_border(Side::low, {from_below.data(), from_below.size()});
      parts_[r].fluid->receive_border(Side::high, {from_above.data(), from_above.size()});
    }
  }
  void advance(const Field<Real>& force, Field<Real>& velocity) {
    for (auto& p : parts_) {
      for_nodes(p.block, [&](int i, int j, int k) {
        p.force[p.block.at(i, j, k)] = force[whole_.at(i, j, p.first + k)];
      });
      p.fluid->begin_advance(std::as_const(p.force).view(), p.velocity.view(), share);
    }
    exchange();
    for (auto& p : parts_) p.fluid->end_advance(std::as_const(p.force).view(), p.velocity.view(), share);
    collect(velocity);
  }
  void collect(Field<Real>& velocity) const {
    for (auto& p : parts_)
      for_nodes(p.block, [&](int i, int j, int k) {
        velocity[whole_.at(i, j, p.first + k)] = p.velocity[p.block.at(i, j, k)];
      });
  }
  /// Saves every block and loads it into a new one.
  void restart(const Parameters& parameters, bool solid) {
    std::vector<int> planes;
    for (auto& p : parts_) planes.push_back(p.block.nz);
    Stack fresh(whole_, parameters, planes, solid);
    bool missing = false;
    for (std::size_t r = 0; r < parts_.size(); ++r) {
      const auto state = parts_[r].fluid->save();
      fresh.parts_[r].fluid->load({state.data(), state.size()});
      missing = fresh.parts_[r].fluid->border_missing();
    }
    if (missing) fresh.exchange();
    for (std::size_t r = 0; r < parts_.size(); ++r) parts_[r].fluid = std::move(fresh.parts_[r].fluid);
  }
  Totals totals() const {
    Totals sum;
    for (auto& p : parts_) {
      const Totals t = p.fluid->totals();
      sum.mass += t.mass;
      for (int a = 0; a < 3; ++a) sum.momentum[a] += t.momentum[a];
    }
    return sum;
  }
  WallImpulse wall_impulse() const {
    WallImpulse sum;
    for (auto& p : parts_) {
      const WallImpulse w = p.fluid->wall_impulse();
      for (int a = 0; a < 3; ++a)
        sum.lower[a] += w.lower[a], sum.upper[a] += w.upper[a], sum.solid[a] += w.solid[a];
    }
    return sum;
  }

 private:
  struct Part {
    Block block;
    int first;
    std::unique_ptr<Fluid<Real>> fluid;
    Field<Real> force, velocity;
  };
  Block whole_;
  std::vector<Part> parts_;
};

template <class Real>
class Divided : public testing::Test {};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(Divided, Reals);

TYPED_TEST(Divided, GivesTheWholeBitForBit) {
  using Real = TypeParam;
  const Block b{21, 6, 11};
  for (const std::vector<int>& planes : {std::vector<int>{11}, {5, 6}, {1, 3, 7}, {4, 1, 1, 5}})
    for (const bool solid : {false, true})
      for (const bool walls : {true, false}) {
        Parameters p;
        p.tau = 0.8;
        p.walls_y = walls;
        p.lower_wall_velocity = {0.01, 0, -0.02};
        p.upper_wall_velocity = {-0.01, 0, 0.03};
        p.body_force = {1e-5, 0, 2e-5};
        const auto flow = [&](double x, double y, double z) {
          return FlowPoint{1 + 1e-3 * std::sin(x), {0.01 * std::sin(z), 0.002, 0.02 * y / b.ny}};
        };
        Fluid<Real> whole(b, p);
        if (solid) whole.set_solid([&](int i, int j, int k) { return bump(b, i, j, k); });
        whole.initialise(flow);
        Stack<Real> stack(b, p, planes, solid);
        stack.initialise(flow);
        RandomForce<Real> force(b, 1e-3);
        Field<Real> u(b.size()), v(b.size());
        for (int t = 0; t < 10; ++t) {
          force.next();
          whole.advance(force.view(), u.view(), Stack<Real>::share);
          stack.advance(force.field, v);
          ASSERT_TRUE(bitwise_equal(b, u, v)) << planes.size() << " blocks, step " << t << " solid " << solid;
          if (t == 4 || t == 7) stack.restart(p, solid);
        }
        const Totals one = whole.totals(), many = stack.totals();
        const WallImpulse w = whole.wall_impulse(), s = stack.wall_impulse();
        // Sums in double over blocks instead of planes.
        const double tolerance = 4 * round_off(double()) * 0.02 * 19 * static_cast<double>(b.interior());
        EXPECT_NEAR(one.mass, many.mass, tolerance);
        for (int a = 0; a < 3; ++a) {
          EXPECT_NEAR(one.momentum[a], many.momentum[a], tolerance);
          EXPECT_NEAR(w.lower[a], s.lower[a], tolerance);
          EXPECT_NEAR(w.upper[a], s.upper[a], tolerance);
          EXPECT_NEAR(w.solid[a], s.solid[a], tolerance);
        }
      }
}

TEST(DividedBlock, RefusesMessagesOfTheWrongLength) {
  Parameters p;
  p.divided_z = true;
  Fluid<float> fluid({4, 4, 4}, p);
  std::vector<float> message(fluid.border_size() + 1);
  EXPECT_THROW(fluid.send_border(Side::low, {message.data(), message.size()}), InputError);
  EXPECT_THROW(fluid.receive_border(Side::low, {message.data(), message.size()}), InputError);
}

}  // namespace
}  // namespace hemowalk::lbm
