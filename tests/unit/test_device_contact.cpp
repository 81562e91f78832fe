// Contact on the device against the host's, whatever the order of threads.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "core/check.hpp"
#include "resolved/contact/device_contact.hpp"
#include "resolved/ibm/device_markers.hpp"
#include "support/contact_bodies.hpp"
#include "support/places.hpp"

namespace hemowalk::contact {
namespace {

using namespace hemowalk::test;

class DeviceContactTest : public OnPlace {};
HEMOWALK_ON_BOTH_PLACES(DeviceContactTest);

constexpr Block block{22, 20, 26};

/// Cells and platelets thrown into the box, overlapping each other and the walls by less than the depth that
/// is seen.
template <class Real>
struct Crowded : ContactBodies<Real> {
  explicit Crowded(int count, unsigned seed) {
    const int red = this->add_shape(mesh::red_cell(0.9, 4)), small = this->add_shape(mesh::platelet(0.7, 3));
    std::mt19937 gen(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int c = 0; c < count; ++c) {
      const bool platelet = c % 4 == 3;
      const double margin = platelet ? 1.2 : 3.4;
      // Layers along z, so that surfaces come close without running through each other too deeply.
      const mesh::Vec3 centre{22 * unit(gen), margin + (20 - 2 * margin) * unit(gen), 26.0 * c / count};
      this->add(platelet ? small : red, centre, mesh::rotation({0.3, 1, 0.2}, 0.4 * unit(gen)));
    }
    domain.period = {22, 0, 26};
    domain.walls.geometry = Walls::Geometry::slab;
    domain.walls.lower = 0, domain.walls.upper = 20;
    law.stiffness = 0.01;
  }
  /// Everybody moves a little on, and across the periodic faces.
  void shift(const mesh::Vec3& by) {
    for (std::size_t b = 0; b < this->bodies.size(); ++b)
      for (std::size_t v = 0; v < this->vertices(static_cast<int>(b)); ++v) {
        auto& p = this->local[this->bodies[b].first + v];
        const double turn = b % 2 == 0 ? 1 : -1;
        p = {Real(p.x + turn * by[0]), Real(p.y + turn * by[1]), Real(p.z + turn * by[2]), Real(0)};
      }
  }
  Domain domain;
  Law law;
};

template <class Real>
struct OnQueue {
  OnQueue(Place place, const Crowded<Real>& crowd)
      : queue(place),
        contact(queue, crowd.law, crowd.domain, crowd.shapes, shapes_of(crowd)),
        markers(queue, block, ibm::Faces{}, ibm::Kernel::phi4, bodies_of(crowd)) {}
  static std::vector<std::uint16_t> shapes_of(const Crowded<Real>& crowd) {
    std::vector<std::uint16_t> of;
    for (const Body& b : crowd.bodies) of.push_back(b.shape);
    return of;
  }
  static std::vector<std::int32_t> bodies_of(const Crowded<Real>& crowd) {
    std::vector<std::int32_t> of;
    for (std::size_t b = 0; b < crowd.bodies.size(); ++b)
      of.insert(of.end(), crowd.vertices(static_cast<int>(b)), b);
    return of;
  }
  std::vector<mesh::Vec3> forces(const Crowded<Real>& crowd) {
    const auto origin = make_array(queue.place(), crowd.origin);
    const auto local = make_array(queue.place(), crowd.local);
    markers.locate(origin.data(), local.data());
    const auto& b = markers.bins();
    contact.compute(origin.data(), local.data(),
                    {block, true, 0, ibm::bin_edge, b.x, b.y, b.z, markers.begin(), markers.listed(), 1e-3});
    std::vector<std::int64_t> grains(3 * crowd.local.size());
    queue.copy(grains.data(), contact.forces(), grains.size());
    queue.wait();
    std::vector<mesh::Vec3> f(crowd.local.size());
    for (std::size_t i = 0; i < grains.size(); ++i)
      f[i / 3][i % 3] = force_grain * static_cast<double>(grains[i]);
    return f;
  }
  Queue queue;
  DeviceContact<Real> contact;
  ibm::DeviceMarkers<Real> markers;
};

// A force is K A d^2/rc with d = rc - gap of order 1, from coordinates of size 20 that are rounded some four
// times: 80 roundings, twice that of d^2. Reactions are shared by weights that are ratios of 2 x 2
// determinants of such coordinates' differences, ten times worse for flat triangles, and a vertex has a few
// contacts: 2000 roundings of the largest force. The grain (1.4e-14) is below that even in double.
template <class Real>
void expect_as_on_host(Place place) {
  Crowded<Real> crowd(14, 4);
  auto host = crowd.contact(crowd.law, crowd.domain);
  OnQueue<Real> device(place, crowd);
  std::int64_t contacts = 0, wall_contacts = 0;
  for (int step = 0; step < 6; ++step) {
    const Summary expected = crowd.compute(host);
    const auto force = device.forces(crowd);
    const Summary found = device.contact.summary();
    double largest = 0;
    for (const auto& f : crowd.force)
      largest = std::max({largest, std::abs(double(f.x)), std::abs(double(f.z))});
    const double tolerance = 2000 * std::numeric_limits<Real>::epsilon() * largest + 8 * force_grain;
    for (std::size_t i = 0; i < force.size(); ++i) {
      ASSERT_NEAR(force[i][0], crowd.force[i].x, tolerance) << "slot " << i << " step " << step;
      ASSERT_NEAR(force[i][1], crowd.force[i].y, tolerance) << "slot " << i << " step " << step;
      ASSERT_NEAR(force[i][2], crowd.force[i].z, tolerance) << "slot " << i << " step " << step;
    }
    EXPECT_EQ(found.contacts, expected.contacts);
    EXPECT_EQ(found.wall_contacts, expected.wall_contacts);
    EXPECT_NEAR(found.minimum_gap, expected.minimum_gap, 1e-5);
    EXPECT_NEAR(found.energy, expected.energy, 1e-4 * expected.energy);
    for (int d = 0; d < 3; ++d)
      EXPECT_NEAR(found.wall_force[1][d], expected.wall_force[1][d], expected.wall_contacts * tolerance);
    contacts += expected.contacts, wall_contacts += expected.wall_contacts;
    crowd.shift({0.11, 0.02, 0.05});
  }
  EXPECT_GT(contacts, 300) << "too few contacts to say anything";
  EXPECT_GT(wall_contacts, 10);
  EXPECT_GE(device.contact.searches(), 2);
  EXPECT_LT(device.contact.searches(), 6) << "lists should hold for some steps";
}
TEST_P(DeviceContactTest, ForcesLikeTheHost) { expect_as_on_host<double>(GetParam()); }
TEST_P(DeviceContactTest, ForcesLikeTheHostInSinglePrecision) { expect_as_on_host<float>(GetParam()); }

// What bodies do to each other adds up to nothing: exactly, in grains.
TEST_P(DeviceContactTest, PairForcesCancelToTheLastBit) {
  Crowded<float> crowd(14, 4);
  crowd.domain.walls.geometry = Walls::Geometry::none;
  OnQueue<float> device(GetParam(), crowd);
  const auto f = device.forces(crowd);
  mesh::Vec3 sum{};
  double size = 0;
  for (const auto& v : f)
    for (int d = 0; d < 3; ++d) sum[d] += v[d] / force_grain, size += std::abs(v[d]) / force_grain;
  EXPECT_GT(size, 1e9);
  EXPECT_LT(size, 0x1p53) << "sums in double are exact";
  for (int d = 0; d < 3; ++d) EXPECT_EQ(sum[d], 0);
}

// The impulse is the sum of the steps' forces, also where their grains no longer fit into 64 bits (2^17):
// three steps of more than half of that.
TEST_P(DeviceContactTest, WallImpulseDoesNotOverflow) {
  Crowded<double> crowd(1, 4);  // forces between cells would be too large themselves
  double lowest = 1e9;
  for (std::size_t v = 0; v < crowd.vertices(0); ++v) lowest = std::min(lowest, crowd.at(0, v)[1]);
  crowd.shift({0, 0.5 - lowest, 0});
  double force = 0;
  {
    OnQueue<double> trial(GetParam(), crowd);
    (void)trial.forces(crowd);
    force = std::abs(trial.contact.summary().wall_force[0][1]);
  }
  ASSERT_GT(force, 0);
  crowd.law.stiffness *= 7e4 / force;
  OnQueue<double> device(GetParam(), crowd);
  std::array<double, 3> sum{};
  for (int step = 0; step < 3; ++step) {
    (void)device.forces(crowd);
    const Summary summary = device.contact.summary();
    for (int d = 0; d < 3; ++d) sum[d] += summary.wall_force[0][d];
  }
  EXPECT_GT(std::abs(sum[1]), 0x1p17);
  for (int d = 0; d < 3; ++d)  // three sums of one rounding each
    EXPECT_NEAR(device.contact.wall_impulse()[0][d], sum[d], 4 * 0x1p-53 * std::abs(sum[1]));
}

// The last cell has left for another rank: nothing is in contact, and what happened before stays booked,
// once.
TEST_P(DeviceContactTest, NobodyLeftMeansNoContact) {
  Crowded<float> crowd(14, 4);
  crowd.shift({0, 0.5, 0});
  OnQueue<float> device(GetParam(), crowd);
  (void)device.forces(crowd);
  const auto impulse = device.contact.wall_impulse();
  EXPECT_NE(impulse[0][1], 0);
  EXPECT_GT(device.contact.summary().contacts, 0);
  device.contact.assign({}, 0, {});
  device.contact.compute(nullptr, nullptr, {});
  const Summary none = device.contact.summary();
  EXPECT_EQ(none.contacts, 0);
  EXPECT_EQ(none.wall_contacts, 0);
  EXPECT_EQ(none.energy, 0);
  for (int w = 0; w < 2; ++w)
    for (int d = 0; d < 3; ++d) EXPECT_EQ(none.wall_force[w][d], 0);
  EXPECT_TRUE(device.contact.wall_impulse() == impulse);
  device.contact.assign(OnQueue<float>::shapes_of(crowd), crowd.bodies.size(), {});
  (void)device.forces(crowd);
  for (int w = 0; w < 2; ++w)
    for (int d = 0; d < 3; ++d) EXPECT_EQ(device.contact.wall_impulse()[w][d], 2 * impulse[w][d]);
}

// A blow-up that is still finite: named, wherever its vertices are, instead of looked up among all others.
TEST_P(DeviceContactTest, TornCellsAreAnError) {
  for (const float far : {9.f, 3e5f, 1e12f, 1e30f, std::numeric_limits<float>::infinity()}) {
    Crowded<float> crowd(14, 4);
    OnQueue<float> device(GetParam(), crowd);
    (void)device.forces(crowd);
    EXPECT_NO_THROW((void)device.contact.summary());
    crowd.local[20].x += far;
    (void)device.forces(crowd);
    EXPECT_THROW((void)device.contact.summary(), PhysicsError) << far;
  }
}

TEST_P(DeviceContactTest, OrderOfThreadsChangesNoBit) {
  std::vector<mesh::Vec3> first;
  for (const HostThreads order : {HostThreads::forward, HostThreads::backward}) {
    ThreadOrder now(order);
    Crowded<float> crowd(14, 4);
    OnQueue<float> device(GetParam(), crowd);
    const auto f = device.forces(crowd);
    if (first.empty()) first = f;
    EXPECT_TRUE(first == f);
  }
}

TEST_P(DeviceContactTest, ListsThatAreTooShortAreAnError) {
  Crowded<float> crowd(14, 4);
  OnQueue<float> device(GetParam(), crowd);
  DeviceContact<float> tight(device.queue, crowd.law, crowd.domain, crowd.shapes,
                             OnQueue<float>::shapes_of(crowd), {}, 3);
  (void)device.forces(crowd);
  const auto origin = make_array(GetParam(), crowd.origin);
  const auto local = make_array(GetParam(), crowd.local);
  const auto& b = device.markers.bins();
  tight.compute(
      origin.data(), local.data(),
      {block, true, 0, ibm::bin_edge, b.x, b.y, b.z, device.markers.begin(), device.markers.listed(), 1e-3});
  EXPECT_THROW((void)tight.summary(), PhysicsError);
}

TEST(DeviceContact, RefusesWallsFromASurface) {
  Crowded<float> crowd(2, 4);
  crowd.domain.walls.geometry = Walls::Geometry::surface;
  Queue queue(Place::host);
  EXPECT_THROW(
      DeviceContact<float>(queue, crowd.law, crowd.domain, crowd.shapes, OnQueue<float>::shapes_of(crowd)),
      InputError);
}

TEST(DeviceContact, RefusesBoxesWithTwoImagesInReach) {
  Crowded<float> crowd(2, 4);
  crowd.domain.period[0] = 12;
  Queue queue(Place::host);
  EXPECT_THROW(
      DeviceContact<float>(queue, crowd.law, crowd.domain, crowd.shapes, OnQueue<float>::shapes_of(crowd)),
      InputError);
}

}  // namespace
}  // namespace hemowalk::contact
