// The device fluid against the host fluid: same body, other ways to find the numbers.

#include <gtest/gtest.h>

#include "resolved/lbm/device_fluid.hpp"
#include "support/lbm_flows.hpp"
#include "support/places.hpp"

namespace hemowalk::lbm {
namespace {

using namespace hemowalk::test;

constexpr double pi = 3.14159265358979323846;

class DeviceFluidTest : public OnPlace {};
HEMOWALK_ON_BOTH_PLACES(DeviceFluidTest);

Parameters moving_walls(bool walls) {
  Parameters p;
  p.tau = 0.9;
  p.walls_y = walls;
  p.lower_wall_velocity = {0.01, 0, -0.02};
  p.upper_wall_velocity = {-0.01, 0, 0.05};
  p.body_force = {1e-5, -2e-5, 3e-5};
  return p;
}

template <class Real>
Fluid<Real> wavy_fluid(const Block& b, const Parameters& p) {
  Fluid<Real> fluid(b, p);
  fluid.initialise([&](double x, double y, double z) {
    return FlowPoint{
        1 + 0.001 * std::sin(2 * pi * x / b.nx),
        {0.01 * std::sin(2 * pi * z / b.nz), 0.002 * std::cos(2 * pi * x / b.nx), 0.02 * y / b.ny}};
  });
  return fluid;
}

/// One fluid of each kind, stepped together under random forces.
template <class Real>
struct Pair {
  Pair(Place place, const Block& b, const Parameters& p, int planes)
      : block(b),
        queue(place),
        host(wavy_fluid<Real>(b, p)),
        device(queue, host, planes),
        force(b, 1e-3),
        host_velocity(b.size()),
        device_velocity(b.size()),
        placed_velocity(b.size(), place) {}

  void step() {
    force.next();
    host.advance(force.view(), host_velocity.view());
    const auto placed_force = place_copy(queue.place(), force.field);
    device.advance(placed_force.data(), placed_velocity.data(), Real(0));
    queue.copy(device_velocity.data(), placed_velocity.data(), placed_velocity.size());
    queue.wait();
    for (int a = 0; a < 3; ++a) {
      wall.lower[a] += host.wall_impulse().lower[a];
      wall.upper[a] += host.wall_impulse().upper[a];
    }
  }

  Block block;
  Queue queue;
  Fluid<Real> host;
  DeviceFluid<Real> device;
  RandomForce<Real> force;
  Field<Real> host_velocity, device_velocity, placed_velocity;
  WallImpulse wall;
};

// The two take sums in the same order and may differ by contraction of products and sums (fused or not)
// alone: a few roundings of numbers below 0.1 per step. Forces are bounded and the lattice does not amplify,
// so they add up like a random walk at most linearly: 100 steps x 8 roundings x 0.1.
template <class Real>
void follow(Place place, const Block& b, bool walls, int planes) {
  Pair<Real> pair(place, b, moving_walls(walls), planes);
  const double tolerance = 100 * 8 * 0.1 * round_off(Real());
  double scale = 0;
  for (int i = 0; i < 101; ++i) {
    pair.step();
    ASSERT_LE(largest_difference(b, pair.host_velocity, pair.device_velocity), tolerance) << "step " << i;
  }
  const WallImpulse on_device = pair.device.wall_impulse();
  for (int a = 0; a < 3 && walls; ++a) scale = std::max(scale, std::abs(pair.wall.upper[a]));
  for (int a = 0; a < 3 && walls; ++a) {
    EXPECT_NEAR(on_device.lower[a], pair.wall.lower[a], 101.0 * b.nx * b.nz * tolerance);
    EXPECT_NEAR(on_device.upper[a], pair.wall.upper[a], 101.0 * b.nx * b.nz * tolerance);
  }
  if (walls) {
    EXPECT_GT(scale, 100 * 101.0 * b.nx * b.nz * tolerance) << "the comparison would see little";
  }
}

TEST_P(DeviceFluidTest, FollowsTheHostBetweenWalls) { follow<double>(GetParam(), {11, 9, 8}, true, 3); }
TEST_P(DeviceFluidTest, FollowsTheHostInAPeriodicBox) { follow<double>(GetParam(), {8, 7, 9}, false, 0); }
TEST_P(DeviceFluidTest, FollowsTheHostInSinglePrecision) { follow<float>(GetParam(), {16, 9, 8}, true, 5); }

TEST_P(DeviceFluidTest, SmallestBlocks) {
  for (const Block b : {Block{4, 2, 1}, Block{1, 2, 2}, Block{5, 3, 2}})
    follow<double>(GetParam(), b, true, 1);
}

TEST_P(DeviceFluidTest, SlabsAndOrderOfThreadsChangeNoBit) {
  const Block b{12, 7, 9};
  std::vector<std::byte> first;
  for (const int planes : {9, 2, 1, 4})
    for (const HostThreads order : {HostThreads::forward, HostThreads::backward}) {
      ThreadOrder now(order);
      Pair<float> pair(GetParam(), b, moving_walls(true), planes);
      for (int i = 0; i < 5; ++i) pair.step();
      Fluid<float> result(b, moving_walls(true));
      pair.device.download(result);
      const auto state = result.save();
      if (first.empty()) first = state;
      EXPECT_TRUE(first == state) << planes << " planes";
    }
}

TEST_P(DeviceFluidTest, StatesGoToAndFroWithoutLoss) {
  const Block b{9, 6, 5};
  const Parameters p = moving_walls(true);
  for (int steps = 0; steps < 3; ++steps) {  // both parities
    Fluid<float> host = wavy_fluid<float>(b, p);
    for (int i = 0; i < steps; ++i) host.collide_and_stream({});
    Queue queue(GetParam());
    const DeviceFluid<float> device(queue, host);
    Fluid<float> back(b, p);
    device.download(back);
    EXPECT_TRUE(back.save() == host.save()) << steps << " steps";
  }
}

// The halo of the velocity is what interpolation reads beyond the block's faces: images, or the wall.
TEST_P(DeviceFluidTest, HaloHoldsImagesAndWalls) {
  const Block b{7, 6, 5};
  for (const bool walls : {true, false}) {
    Pair<double> pair(GetParam(), b, moving_walls(walls), 2);
    const auto none = static_cast<const Node4<double>*>(nullptr);
    pair.device.moments(none, pair.placed_velocity.data(), 0);
    pair.device.advance(none, pair.placed_velocity.data(), 0);
    const auto u = place_copy(Place::host, (pair.queue.wait(), pair.placed_velocity));
    constexpr int h = Block::halo;
    for (int k = -h; k < b.nz + h; ++k)
      for (int j = -h; j < b.ny + h; ++j)
        for (int i = -h; i < b.nx + h; ++i) {
          const auto here = u[b.at(i, j, k)];
          if (walls && (j < 0 || j >= b.ny)) {
            EXPECT_EQ(here.x, j < 0 ? 0.01 : -0.01);
            EXPECT_EQ(here.z, j < 0 ? -0.02 : 0.05);
          } else {
            const auto image = u[b.at((i + b.nx) % b.nx, (j + b.ny) % b.ny, (k + b.nz) % b.nz)];
            ASSERT_EQ(here.x, image.x) << i << ' ' << j << ' ' << k;
            ASSERT_EQ(here.w, image.w);
          }
        }
  }
}

// u* + share F: what interpolation reads in a coupled run.
TEST_P(DeviceFluidTest, ShareOfTheForceIsAddedToTheVelocity) {
  const Block b{6, 5, 4};
  Pair<double> with(GetParam(), b, moving_walls(true), 2), without(GetParam(), b, moving_walls(true), 2);
  with.force.next();
  const auto force = place_copy(GetParam(), with.force.field);
  with.device.advance(force.data(), with.placed_velocity.data(), 0.485);
  without.device.advance(force.data(), without.placed_velocity.data(), 0);
  const auto a = place_copy(Place::host, (with.queue.wait(), with.placed_velocity)),
             c = place_copy(Place::host, (without.queue.wait(), without.placed_velocity));
  for_nodes(b, [&](int i, int j, int k) {
    const std::size_t n = b.at(i, j, k);
    // speeds below 0.1, rounded twice, the product fused or not
    EXPECT_NEAR(a[n].y, c[n].y + 0.485 * with.force.field[n].y, 3 * 0.1 * 0x1p-53);
  });
}

// A domain divided along z, as many blocks in one process, against the undivided device fluid: the same
// numbers meet in the same order.
template <class Real>
void divided_like_whole(Place place, const std::vector<int>& planes, bool walls) {
  const Block whole{9, 5, 11};
  Parameters p = moving_walls(walls);
  Pair<Real> one(place, whole, p, 3);
  p.divided_z = true;
  struct Part {
    Block block;
    int first;
    DeviceFluid<Real> fluid;
    Field<Real> force, velocity;
    std::vector<Real> out, in;
  };
  std::vector<Part> parts;
  int first = 0;
  for (const int nz : planes) {
    const Block b{whole.nx, whole.ny, nz};
    Fluid<Real> host(b, p);
    const auto state = one.host.save();
    const auto cut = cut_state({state.data(), state.size()}, first, nz);
    host.load({cut.data(), cut.size()});
    const std::size_t n = 2 * host.border_size();
    parts.push_back({b, first, DeviceFluid<Real>(one.queue, host, 2), Field<Real>(b.size(), place),
                     Field<Real>(b.size(), place), std::vector<Real>(n), std::vector<Real>(n)});
    parts.back().fluid.moments(nullptr, parts.back().velocity.data(), Real(0));
    first += nz;
  }
  for (int step = 0; step < 5; ++step) {
    one.step();
    for (Part& part : parts) {
      Field<Real> force(part.block.size());
      for_nodes(part.block, [&](int i, int j, int k) {
        force[part.block.at(i, j, k)] = one.force.field[whole.at(i, j, part.first + k)];
      });
      one.queue.copy(part.force.data(), force.data(), force.size());
      part.fluid.begin_advance(part.force.data(), part.velocity.data(), Real(0));
      part.fluid.send_borders(part.out.data());
      one.queue.wait();
    }
    for (std::size_t r = 0; r < parts.size(); ++r) {
      const std::size_t n = parts[r].fluid.border_size();
      const auto &below = parts[(r + parts.size() - 1) % parts.size()],
                 &above = parts[(r + 1) % parts.size()];
      std::copy_n(below.out.begin() + static_cast<std::ptrdiff_t>(n), n, parts[r].in.begin());
      std::copy_n(above.out.begin(), n, parts[r].in.begin() + static_cast<std::ptrdiff_t>(n));
      parts[r].fluid.receive_borders(parts[r].in.data());
      parts[r].fluid.end_advance(parts[r].force.data(), parts[r].velocity.data(), Real(0));
      one.queue.wait();
    }
    for (const Part& part : parts) {
      const auto u = place_copy(Place::host, part.velocity);
      for_nodes(part.block, [&](int i, int j, int k) {
        const auto mine = u[part.block.at(i, j, k)],
                   same = one.device_velocity[whole.at(i, j, part.first + k)];
        ASSERT_EQ(mine.x, same.x) << step << ": " << i << ' ' << j << ' ' << part.first + k;
        ASSERT_EQ(mine.y, same.y);
        ASSERT_EQ(mine.z, same.z);
        ASSERT_EQ(mine.w, same.w);
      });
      for (int k = 1; k <= Block::halo; ++k)
        for (int j = -Block::halo; j < whole.ny + Block::halo; ++j)
          for (const int beyond : {-k, part.block.nz - 1 + k})
            ASSERT_EQ(u[part.block.at(0, j, beyond)].z, 0) << "the halo along z belongs to the neighbours";
    }
  }
}

TEST_P(DeviceFluidTest, DividedGivesTheWholeBitForBit) {
  for (const bool walls : {true, false})
    for (const std::vector<int>& planes : {std::vector<int>{11}, {5, 6}, {1, 3, 7}, {4, 1, 1, 5}}) {
      divided_like_whole<float>(GetParam(), planes, walls);
      divided_like_whole<double>(GetParam(), planes, walls);
    }
}

TEST(DeviceFluid, RefusesSolidNodes) {
  Fluid<float> host({8, 8, 8}, Parameters{});
  host.set_solid([](int i, int j, int k) { return i + j + k == 3; });
  Queue queue(Place::host);
  EXPECT_THROW(DeviceFluid<float>(queue, host), InputError);
}

}  // namespace
}  // namespace hemowalk::lbm
