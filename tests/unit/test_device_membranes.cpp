// The device's solid step against the host's, cell by cell, whatever the order of threads.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/check.hpp"
#include "resolved/npfem/device_membranes.hpp"
#include "support/cells.hpp"
#include "support/places.hpp"

namespace hemowalk::npfem {
namespace {

using namespace hemowalk::test;
using support::Numbers;

class DeviceMembranesTest : public OnPlace {};
HEMOWALK_ON_BOTH_PLACES(DeviceMembranesTest);

/// The same cells on both sides, deformed, and driven by the same v_pred.
template <class Real>
struct Pair {
  Pair(Place place, int n, const Material& material, int cells)
      : queue(place), host(support::red_cell_type(n, material)) {
    for (int c = 0; c < cells; ++c) {
      host.add(100 + c, {10.0 * c, 450.0, -3.0 * c}, mesh::rotation({1.0, 0.3 * c, 0.5}, 0.7 * c));
      host.set_positions(c, support::shaken(host.positions(c), 0.05, 7 + c));
      std::vector<mesh::Vec3> v(host.vertices());
      for (auto& x : v) x = {0.01, 0.002 * c, 0};
      host.set_velocities(c, support::shaken(v, 0.004, 70 + c));
    }
    device = std::make_unique<DeviceMembranes<Real>>(queue, host);
  }

  /// v_pred: a shear, with noise.
  void predict(std::uint64_t seed) {
    Numbers numbers(seed);
    const auto& f = device->fields();
    Array<Real> predicted(static_cast<std::size_t>(host.count()) * 3 * f.pitch);
    const auto at = host.layout();
    for (int c = 0; c < host.count(); ++c)
      for (int k = 0; k < host.vertices(); ++k)
        for (int d = 0; d < 3; ++d) {
          const double y = host.positions(c)[k][1] - 450;
          const Real v = static_cast<Real>((d == 2 ? 0.02 * y : 0.003 * d) + 0.004 * numbers());
          host.predicted()[at.at(c, k, d)] = v;
          predicted[f.at(c, d, k)] = v;
        }
    queue.copy(f.predicted, predicted.data(), predicted.size());
    queue.wait();
  }

  void step(const StepOptions& options, std::uint64_t seed) {
    predict(seed);
    host_report = host.step(options);
    device->step(options);
    queue.wait();
  }

  /// Largest differences of velocities and positions, relative to the largest velocity and to 1 um.
  void compare(double tolerance, const std::string& what) {
    Membranes<Real> copy = same_cells();
    device->download(copy);
    double speed = 0, v = 0, x = 0, n = 0;
    const auto at = host.layout();
    for (int c = 0; c < host.count(); ++c)
      for (int k = 0; k < host.vertices(); ++k)
        for (int d = 0; d < 3; ++d) {
          const auto i = at.at(c, k, d);
          speed = std::max(speed, std::abs(double(host.velocities()[i])));
          const auto grow = [](double& worst, double e) {
            worst = std::abs(e) <= worst ? worst : std::abs(e);
          };
          grow(v, double(host.velocities()[i]) - double(copy.velocities()[i]));
          grow(n, double(host.normals()[i]) - double(copy.normals()[i]));
          grow(x, host.position(c, k)[d] - copy.position(c, k)[d]);
        }
    EXPECT_GT(speed, 0.01) << what;
    EXPECT_LE(v, tolerance * speed) << what << ": velocities";
    EXPECT_LE(x, tolerance) << what << ": positions";
    EXPECT_LE(n, tolerance) << what << ": normals";
    const auto report = device->report();
    EXPECT_NEAR(report.increment, host_report.increment, tolerance + 1e-3 * host_report.increment) << what;
    EXPECT_EQ(report.bad_cell, -1);
  }
  Membranes<Real> same_cells() const {
    Membranes<Real> copy(std::make_shared<CellType>(host.type()));
    for (int c = 0; c < host.count(); ++c) copy.add(0, {0, 0, 0}, mesh::identity_rotation);
    return copy;
  }

  Queue queue;
  Membranes<Real> host;
  std::unique_ptr<DeviceMembranes<Real>> device;
  StepReport host_report;
};

Material material_of(Law law, bool stiff_volume) {
  Material m;
  m.law = law;
  m.drag_per_area = drag_per_area_of(0.7);
  m.rayleigh_beta = 0.01;
  // N takes the volume term where k_v exceeds half the mean m/h^2 = 6400 pN/um
  m.volume_modulus = stiff_volume ? 8000 : 250;
  return m;
}

// Both do the same arithmetic in another order. Forces up to C x area x strain = 150 pN are rounded and
// divided by m/h^2 = 6400 pN/um: 0.02 roundings of 1 um per force, some ten forces per vertex, and 0.02 um/us
// of speed is the scale: of the order of 50 roundings a step, up to five iterations and three steps, each fed
// with the error of the last.
template <class Real>
constexpr double tolerance = 2e3 * std::numeric_limits<Real>::epsilon();

TEST_P(DeviceMembranesTest, StepLikeTheHost) {
  for (const Law law : {Law::paper, Law::neo_hookean, Law::skalak})
    for (const bool stiff : {false, true})
      for (const int iterations : {1, 4}) {
        Pair<double> pair(GetParam(), 4, material_of(law, stiff), 10);  // more than one batch on the host
        StepOptions options;
        options.iterations = iterations;
        for (int i = 0; i < 3; ++i) pair.step(options, 5 + i);
        pair.compare(tolerance<double>, "law " + std::to_string(int(law)) + (stiff ? ", stiff volume" : ""));
      }
}
TEST_P(DeviceMembranesTest, StepLikeTheHostWithoutDamping) {
  Pair<double> pair(GetParam(), 3, material_of(Law::paper, false), 3);
  StepOptions options;
  options.damping = false;
  pair.step(options, 3);
  pair.compare(tolerance<double>, "no damping");
}
TEST_P(DeviceMembranesTest, StepLikeTheHostInSinglePrecision) {
  Pair<float> pair(GetParam(), 8, material_of(Law::paper, false), 17);
  for (int i = 0; i < 3; ++i) pair.step({}, 5 + i);
  pair.compare(tolerance<float>, "single precision");
}
// More vertices than threads in a block.
TEST_P(DeviceMembranesTest, LargeCellsToo) {
  Pair<double> pair(GetParam(), 10, material_of(Law::paper, true), 2);
  ASSERT_GT(pair.host.vertices(), DeviceMembranes<double>::Step::threads);
  pair.step({}, 3);
  pair.compare(tolerance<double>, "402 vertices");
}

TEST_P(DeviceMembranesTest, OrderOfThreadsChangesNoBit) {
  std::vector<std::byte> first;
  for (const HostThreads order : {HostThreads::forward, HostThreads::backward, HostThreads::scattered}) {
    ThreadOrder now(order);
    Pair<float> pair(GetParam(), 4, material_of(Law::paper, true), 5);
    StepOptions options;
    options.iterations = 2;
    for (int i = 0; i < 2; ++i) pair.step(options, 3 + i);
    Membranes<float> copy = pair.same_cells();
    pair.device->download(copy);
    std::vector<std::byte> state(5 * copy.state_bytes());
    for (int c = 0; c < 5; ++c) copy.save(c, state.data() + c * copy.state_bytes());
    if (first.empty()) first = state;
    EXPECT_TRUE(first == state);
  }
}

// Linear and angular momentum of v are those of v_pred, whatever the iterations: to the rounding of 66 terms.
TEST_P(DeviceMembranesTest, InternalForcesChangeNoMomentum) {
  Pair<double> pair(GetParam(), 4, material_of(Law::paper, false), 2);
  pair.predict(11);
  const auto arms = pair.host.positions(1);
  const auto anchor = pair.host.anchor(1);
  pair.device->step({});
  Membranes<double> copy = pair.same_cells();
  pair.device->download(copy);
  mesh::Vec3 linear{}, angular{}, size{};
  const auto at = copy.layout();
  for (int k = 0; k < copy.vertices(); ++k) {
    const double m = copy.type().metric()[k];
    mesh::Vec3 p{};
    for (int d = 0; d < 3; ++d)
      p[d] = m * (copy.velocities()[at.at(1, k, d)] - pair.host.predicted()[at.at(1, k, d)]);
    const auto torque = mesh::cross(mesh::subtract(arms[k], anchor), p);
    for (int d = 0; d < 3; ++d) linear[d] += p[d], angular[d] += torque[d], size[d] += std::abs(p[d]) * 4;
  }
  for (int d = 0; d < 3; ++d) {
    EXPECT_GT(size[d], 1);
    EXPECT_NEAR(linear[d], 0, 1e-13 * size[d]);
    EXPECT_NEAR(angular[d], 0, 1e-12 * (size[0] + size[1] + size[2]));
  }
}

TEST_P(DeviceMembranesTest, ACellThatBlewUpIsNamed) {
  Pair<float> pair(GetParam(), 2, material_of(Law::paper, false), 3);
  pair.predict(3);
  std::vector<mesh::Vec3> v(pair.host.vertices(), mesh::Vec3{0, 0, 0});
  v[4][1] = std::numeric_limits<double>::quiet_NaN();
  pair.host.set_velocities(1, v);
  pair.device->upload(pair.host);
  pair.device->step({});
  EXPECT_EQ(pair.device->report().bad_cell, 1);
}

TEST(DeviceMembranes, RefuseLawsTheyDoNotHave) {
  Material m;
  m.bending = Bending::helfrich;
  Membranes<float> host(support::red_cell_type(2, m));
  Queue queue(Place::host);
  EXPECT_THROW(DeviceMembranes<float>(queue, host), InputError);
}

}  // namespace
}  // namespace hemowalk::npfem
