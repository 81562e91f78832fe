// The device markers against the host markers, whatever the order of threads.

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "resolved/ibm/device_markers.hpp"
#include "support/places.hpp"

namespace hemowalk::ibm {
namespace {

using namespace hemowalk::test;

class DeviceMarkersTest : public OnPlace {};
HEMOWALK_ON_BOTH_PLACES(DeviceMarkersTest);

/// Markers of a few bodies all over a block, some crowded into one corner, some outside the period, some
/// closer to a wall than half a spacing.
template <class Real>
struct Cloud {
  Cloud(const Block& b, bool walls, int count, unsigned seed)
      : origin(3), local(count), value(count), field(b.size()) {
    std::mt19937 gen(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    std::normal_distribution<double> normal;
    origin[0] = {0, 0, 0}, origin[1] = {b.nx - 2, walls ? b.ny / 2 : b.ny + 1, -1},
    origin[2] = {2, 1, 2 * b.nz + 1};
    for (int m = 0; m < count; ++m) {
      body.push_back(m % 3);
      const double edge = m % 5 == 0 ? 0.1 : 1;
      const double x = edge * unit(gen) * b.nx, y = 0.02 + edge * unit(gen) * (b.ny - 0.04),
                   z = unit(gen) * b.nz;
      const Origin& o = origin[m % 3];
      local[m] = {Real(x - (m % 3 == 1 ? 0 : o[0])), Real(y - o[1]), Real(z), Real(0)};
      value[m] = {Real(normal(gen)), Real(normal(gen)), Real(normal(gen)), Real(NAN)};
    }
    for (int k = 0; k < b.nz; ++k)
      for (int j = 0; j < b.ny; ++j)
        for (int i = 0; i < b.nx; ++i)
          field[b.at(i, j, k)] = {Real(normal(gen)), Real(normal(gen)), Real(normal(gen)), Real(normal(gen))};
  }
  std::vector<std::int32_t> body;
  Array<Origin> origin;
  Array<Node4<Real>> local, value, field;
};

template <class Real>
struct Outcome {
  Array<Node4<Real>> read, force;
  std::array<std::array<double, 3>, 2> wall{};
};

template <class Real>
Outcome<Real> on_host(const Block& b, const Faces& faces, Kernel kernel, Cloud<Real>& cloud) {
  Outcome<Real> out{Array<Node4<Real>>(cloud.local.size()), Array<Node4<Real>>(b.size()), {}};
  Markers<Real> markers(b, faces, kernel, cloud.body);
  markers.locate(cloud.origin.view(), cloud.local.view());
  fill_velocity_halo(b, faces, cloud.field.view());
  markers.interpolate(cloud.field.view(), out.read.view());
  markers.spread(cloud.value.view(), out.force.view());
  out.wall = fold_force_halo(b, faces, out.force.view());
  return out;
}

template <class Real>
Outcome<Real> on_queue(Place place, const Block& b, const Faces& faces, Kernel kernel,
                       const Cloud<Real>& cloud) {
  Queue queue(place);
  DeviceMarkers<Real> markers(queue, b, faces, kernel, cloud.body);
  const auto origin = place_copy(place, cloud.origin);
  const auto local = place_copy(place, cloud.local), value = place_copy(place, cloud.value),
             field = place_copy(place, cloud.field);
  Array<Node4<Real>> read(cloud.local.size(), place), force(b.size(), place);
  for (int again = 0; again < 2; ++again) {  // the second time finds what the first has left
    markers.locate(origin.data(), local.data());
    markers.interpolate(field.data(), read.data());
    markers.spread(value.data(), force.data(), 2);
  }
  queue.wait();
  EXPECT_EQ(markers.fault(), -1);
  Outcome<Real> out{place_copy(Place::host, read), place_copy(Place::host, force), markers.wall_force()};
  for (int w = 0; w < 2; ++w)
    for (int d = 0; d < 3; ++d)
      EXPECT_DOUBLE_EQ(markers.wall_impulse()[w][d], 4 * out.wall[w][d]) << "two steps of two fluid steps";
  return out;
}

// Weights are the same numbers, so what differs is the order of sums: 64 products with weights that add up to
// one for a reading, some hundred markers for a node.
template <class Real>
void expect_as_on_host(Place place, const Block& b, bool walls, Kernel kernel) {
  Cloud<Real> cloud(b, walls, 1500, 5);
  Faces faces{true, !walls, true, {0.1, 0, -0.2}, {0.3, 0, 0.4}};
  const auto host = on_host(b, faces, kernel, cloud);
  const auto device = on_queue(place, b, faces, kernel, cloud);
  const double eps = std::numeric_limits<Real>::epsilon();
  for (std::size_t m = 0; m < cloud.local.size(); ++m) {
    const double most = 64 * eps * 5;  // of normal numbers
    ASSERT_NEAR(device.read[m].x, host.read[m].x, most) << m;
    ASSERT_NEAR(device.read[m].y, host.read[m].y, most) << m;
    ASSERT_NEAR(device.read[m].z, host.read[m].z, most) << m;
    ASSERT_NEAR(device.read[m].w, host.read[m].w, most) << m;
  }
  const double most = 500 * eps * 5;
  for (int k = 0; k < b.nz; ++k)
    for (int j = 0; j < b.ny; ++j)
      for (int i = 0; i < b.nx; ++i) {
        const std::size_t n = b.at(i, j, k);
        ASSERT_NEAR(device.force[n].x, host.force[n].x, most) << i << ' ' << j << ' ' << k;
        ASSERT_NEAR(device.force[n].y, host.force[n].y, most) << i << ' ' << j << ' ' << k;
        ASSERT_NEAR(device.force[n].z, host.force[n].z, most) << i << ' ' << j << ' ' << k;
      }
  double size = 0;
  for (int w = 0; w < 2; ++w)
    for (int d = 0; d < 3; ++d) {
      EXPECT_NEAR(device.wall[w][d], host.wall[w][d], b.nx * b.nz * 4 * most);
      size = std::max(size, std::abs(host.wall[w][d]));
    }
  if (walls) {
    EXPECT_GT(size, 0.1) << "no marker reaches a wall: nothing is compared";
  }
}

TEST_P(DeviceMarkersTest, ReadAndSpreadLikeTheHostBetweenWalls) {
  for (const Kernel kernel : {Kernel::phi2, Kernel::phi3, Kernel::phi4})
    expect_as_on_host<double>(GetParam(), {18, 13, 22}, true, kernel);
}
TEST_P(DeviceMarkersTest, ReadAndSpreadLikeTheHostInAPeriodicBox) {
  expect_as_on_host<double>(GetParam(), {17, 19, 12}, false, Kernel::phi4);
}
TEST_P(DeviceMarkersTest, ReadAndSpreadLikeTheHostInSinglePrecision) {
  expect_as_on_host<float>(GetParam(), {16, 16, 16}, true, Kernel::phi4);
}
// Tiles and bins wider than the block: a kernel meets its own images.
TEST_P(DeviceMarkersTest, SmallestBlocks) {
  expect_as_on_host<double>(GetParam(), {5, 6, 4}, true, Kernel::phi4);
  expect_as_on_host<double>(GetParam(), {9, 4, 5}, false, Kernel::phi4);
}

// Blocks divided along z, each with the planes of the field that are its own and all markers, in the image
// nearest to it: every node counts once, so readings and impulses on walls add up, and each block has its
// part of the force. A marker far beyond any block must reach none.
TEST_P(DeviceMarkersTest, DividedBlocksAddUpToTheWhole) {
  const Block whole{9, 13, 26};
  const Faces faces{true, false, true, {0.1, 0, -0.2}, {0.3, 0, 0.4}};
  Faces divided = faces;
  divided.periodic_z = false;
  Cloud<double> cloud(whole, true, 1500, 5);
  fill_velocity_halo(whole, faces, cloud.field.view());
  const auto one = on_queue(GetParam(), whole, faces, Kernel::phi4, cloud);
  Array<Node4<double>> read(cloud.local.size());
  std::array<std::array<double, 3>, 2> wall{};
  int first = 0;
  for (const int planes : {7, 19}) {
    const Block b{whole.nx, whole.ny, planes};
    const std::size_t count = cloud.local.size();
    Cloud<double> part(b, true, static_cast<int>(count) + 1, 5);  // a body per marker, and one far away
    part.origin = Array<Origin>(count + 1);
    for (auto& node : part.field) node = {0, 0, 0, 0};
    for (int k = 0; k < planes; ++k)
      std::copy_n(&cloud.field[whole.at(-3, -3, first + k)], b.plane(), &part.field[b.at(-3, -3, k)]);
    const double lowest = (planes - whole.nz) / 2;
    for (std::size_t m = 0; m <= count; ++m) part.body[m] = static_cast<std::int32_t>(m);
    for (std::size_t m = 0; m < count; ++m) {
      part.origin[m] = cloud.origin[cloud.body[m]];
      part.local[m] = cloud.local[m], part.value[m] = cloud.value[m];
      const double z = part.origin[m][2] + part.local[m].z - first;
      part.origin[m][2] -= first + static_cast<int>(std::floor((z - lowest) / whole.nz)) * whole.nz;
    }
    part.origin[count] = {1, 1, 200000}, part.local[count] = {0.5, 0.5, 0.5, 0};
    const auto found = on_queue(GetParam(), b, divided, Kernel::phi4, part);
    EXPECT_EQ(found.read[count].x, 0);
    for (std::size_t m = 0; m < read.size(); ++m)
      read[m].x += found.read[m].x, read[m].y += found.read[m].y, read[m].z += found.read[m].z;
    for (int w = 0; w < 2; ++w)
      for (int d = 0; d < 3; ++d) wall[w][d] += found.wall[w][d];
    const double most = 500 * std::numeric_limits<double>::epsilon() * 5;
    for (int k = 0; k < planes; ++k)
      for (int j = 0; j < b.ny; ++j)
        for (int i = 0; i < b.nx; ++i) {
          const auto mine = found.force[b.at(i, j, k)], same = one.force[whole.at(i, j, first + k)];
          ASSERT_NEAR(mine.x, same.x, most) << i << ' ' << j << ' ' << first + k;
          ASSERT_NEAR(mine.z, same.z, most) << i << ' ' << j << ' ' << first + k;
        }
    first += planes;
  }
  for (std::size_t m = 0; m < read.size(); ++m) {
    const double most = 64 * std::numeric_limits<double>::epsilon() * 5;
    ASSERT_NEAR(read[m].x, one.read[m].x, most) << m;
    ASSERT_NEAR(read[m].z, one.read[m].z, most) << m;
  }
  for (int w = 0; w < 2; ++w)
    for (int d = 0; d < 3; ++d) EXPECT_NEAR(wall[w][d], one.wall[w][d], 1e-11);
}

TEST_P(DeviceMarkersTest, OrderOfThreadsChangesNoBit) {
  const Block b{18, 13, 22};
  const Cloud<float> cloud(b, true, 1500, 3);
  const auto first = on_queue(GetParam(), b, Faces{}, Kernel::phi4, cloud);
  for (const HostThreads order : {HostThreads::backward, HostThreads::scattered}) {
    ThreadOrder now(order);
    const auto other = on_queue(GetParam(), b, Faces{}, Kernel::phi4, cloud);
    EXPECT_EQ(std::memcmp(first.read.data(), other.read.data(), first.read.size() * sizeof(Node4<float>)), 0);
    EXPECT_EQ(std::memcmp(first.force.data(), other.force.data(), first.force.size() * sizeof(Node4<float>)),
              0);
    EXPECT_EQ(first.wall, other.wall);
  }
}

TEST_P(DeviceMarkersTest, MarkersThatBlewUpAreNamedAndTakeNoPart) {
  const Block b{12, 10, 9};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Node4<double> bad : {Node4<double>{nan, 3, 3, 0}, Node4<double>{3, -0.6, 3, 0},
                                  Node4<double>{3, 10.6, 3, 0}, Node4<double>{3, 3, 1e30, 0}}) {
    Array<Origin> origin(1);
    Array<Node4<double>> local(4), value(4);
    for (auto& x : local) x = {5, 5, 5, 0};
    for (auto& v : value) v = {1, 1, 1, 0};
    local[2] = bad;
    Queue queue(GetParam());
    DeviceMarkers<double> markers(queue, b, Faces{}, Kernel::phi4, {0, 0, 0, 0});
    const auto o = place_copy(GetParam(), origin);
    const auto x = place_copy(GetParam(), local), v = place_copy(GetParam(), value);
    Array<Node4<double>> force(b.size(), GetParam());
    markers.locate(o.data(), x.data());
    markers.spread(v.data(), force.data(), 1);
    EXPECT_EQ(markers.fault(), 2);
    const auto F = place_copy(Place::host, force);
    double sum = 0;
    for (const auto& node : F) sum += node.x;
    EXPECT_NEAR(sum, 3, 1e-12) << "the three good markers";
  }
}

}  // namespace
}  // namespace hemowalk::ibm
