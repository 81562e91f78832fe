// Interpolation and spreading: linear fields exact, adjoint, conserving, independent of threads and of the
// sort.
#include <gtest/gtest.h>
#include <omp.h>

#include <array>
#include <cstdio>
#include <limits>
#include <random>
#include <string>

#include "core/check.hpp"
#include "resolved/ibm/markers.hpp"

namespace hemowalk::ibm {
namespace {

const Block block{18, 12, 22};
constexpr Kernel kernels[] = {Kernel::phi2, Kernel::phi3, Kernel::phi4};
const char* name_of(Kernel kernel) {
  return kernel == Kernel::phi2 ? "phi2" : kernel == Kernel::phi3 ? "phi3" : "phi4";
}

struct Cloud {
  std::vector<std::int32_t> body;
  Array<Origin> origin{1};
  Array<Node4<double>> local;
  explicit Cloud(int n, unsigned seed = 7) : body(n, 0), local(n) {
    std::mt19937 gen(seed);
    std::uniform_real_distribution<double> x(0, block.nx), y(0, block.ny), z(0, block.nz);
    for (int m = 0; m < n; ++m) local[m] = {x(gen), y(gen), z(gen), 0};
  }
};

template <class Real>
Array<Node4<Real>> convert(const Array<Node4<double>>& from) {
  Array<Node4<Real>> to(from.size());
  for (std::size_t i = 0; i < from.size(); ++i)
    to[i] = {Real(from[i].x), Real(from[i].y), Real(from[i].z), Real(from[i].w)};
  return to;
}

Array<Node4<double>> random_field(unsigned seed) {
  Array<Node4<double>> f(block.size());
  std::mt19937 gen(seed);
  std::normal_distribution<double> g;
  for (int k = 0; k < block.nz; ++k)
    for (int j = 0; j < block.ny; ++j)
      for (int i = 0; i < block.nx; ++i) f[block.at(i, j, k)] = {g(gen), g(gen), g(gen), g(gen)};
  return f;
}

TEST(Markers, LinearFieldIsReadExactlyAwayFromTheFaces) {
  Cloud cloud(2000);
  Array<Node4<double>> field(block.size()), out(2000);
  for (int k = -3; k < block.nz + 3; ++k)
    for (int j = -3; j < block.ny + 3; ++j)
      for (int i = -3; i < block.nx + 3; ++i)
        field[block.at(i, j, k)] = {i + .5, j + .5, k + .5, 1 + 2 * (i + .5) - (j + .5) + 3 * (k + .5)};
  for (const Kernel kernel : kernels) {
    Markers<double> markers(block, Faces{}, kernel, cloud.body);
    markers.locate(cloud.origin.view(), cloud.local.view());
    markers.interpolate(field.view(), out.view());
    for (int m = 0; m < 2000; ++m) {
      const auto p = cloud.local[m];
      // A marker within half a spacing of a periodic face is looked up at the image on the other side.
      const auto image = [](double c, int n) { return c < 0.5 ? c + n : c; };
      const double x = image(p.x, block.nx), y = p.y, z = image(p.z, block.nz);
      ASSERT_NEAR(out[m].x, x, 1e-12) << m;
      ASSERT_NEAR(out[m].y, y, 1e-12) << m;
      ASSERT_NEAR(out[m].z, z, 1e-12) << m;
      ASSERT_NEAR(out[m].w, 1 + 2 * x - y + 3 * z, 1e-11) << m;
    }
  }
}

TEST(Markers, SpreadingIsTheAdjointOfInterpolationAcrossHaloAndWalls) {
  // <I u, J> = <u, S J> when the walls are at rest: the weight beyond them reads zero and is booked as
  // impulse.
  Cloud cloud(500);
  const Faces faces;
  auto u = random_field(1);
  fill_velocity_halo(block, faces, u.view());
  Array<Node4<double>> value(500);
  std::mt19937 gen(3);
  std::normal_distribution<double> g;
  double total[3] = {0, 0, 0};
  for (auto& v : value) {
    v = {g(gen), g(gen), g(gen), 0};
    total[0] += v.x, total[1] += v.y, total[2] += v.z;
  }
  for (const Kernel kernel : kernels) {
    Markers<double> markers(block, faces, kernel, cloud.body);
    markers.locate(cloud.origin.view(), cloud.local.view());
    Array<Node4<double>> force(block.size()), read(500);
    markers.interpolate(u.view(), read.view());
    markers.spread(value.view(), force.view());
    const auto impulse = fold_force_halo(block, faces, force.view());
    double left = 0, right = 0, sum[3] = {0, 0, 0};
    for (int m = 0; m < 500; ++m)
      left += read[m].x * value[m].x + read[m].y * value[m].y + read[m].z * value[m].z;
    for (int k = 0; k < block.nz; ++k)
      for (int j = 0; j < block.ny; ++j)
        for (int i = 0; i < block.nx; ++i) {
          const auto f = force[block.at(i, j, k)], v = u[block.at(i, j, k)];
          right += f.x * v.x + f.y * v.y + f.z * v.z;
          sum[0] += f.x, sum[1] += f.y, sum[2] += f.z;
        }
    EXPECT_NEAR(left, right, 1e-10) << name_of(kernel);
    for (int d = 0; d < 3; ++d)
      EXPECT_NEAR(sum[d] + impulse[0][d] + impulse[1][d], total[d], 1e-11) << name_of(kernel);
    EXPECT_NE(impulse[0][0], 0) << name_of(kernel);  // some kernels did reach through a wall
  }
}

TEST(Markers, TorqueIsConservedAwayFromTheFaces) {
  Cloud cloud(200);
  for (auto& p : cloud.local) p = {3 + 0.6 * p.x, 3 + 0.5 * p.y, 3 + 0.7 * p.z, 0};
  Array<Node4<double>> value(200);
  std::mt19937 gen(3);
  std::normal_distribution<double> g;
  const auto torque = [](double x, double y, double z, const Node4<double>& f) {
    return std::array<double, 3>{y * f.z - z * f.y, z * f.x - x * f.z, x * f.y - y * f.x};
  };
  std::array<double, 3> want{};
  for (int m = 0; m < 200; ++m) {
    value[m] = {g(gen), g(gen), g(gen), 0};
    const auto of = torque(cloud.local[m].x, cloud.local[m].y, cloud.local[m].z, value[m]);
    for (int d = 0; d < 3; ++d) want[d] += of[d];
  }
  for (const Kernel kernel : kernels) {
    Markers<double> markers(block, Faces{}, kernel, cloud.body);
    markers.locate(cloud.origin.view(), cloud.local.view());
    Array<Node4<double>> force(block.size());
    markers.spread(value.view(), force.view());
    std::array<double, 3> got{};
    for (int k = 0; k < block.nz; ++k)
      for (int j = 0; j < block.ny; ++j)
        for (int i = 0; i < block.nx; ++i) {
          const auto of = torque(i + .5, j + .5, k + .5, force[block.at(i, j, k)]);
          for (int d = 0; d < 3; ++d) got[d] += of[d];
        }
    for (int d = 0; d < 3; ++d) EXPECT_NEAR(got[d], want[d], 1e-10) << name_of(kernel) << " " << d;
  }
}

/// The kernels as they are published, of the distance: the hat, Roma, Peskin and Berger 1999, Peskin 2002.
double published(Kernel kernel, double r) {
  r = std::abs(r);
  switch (kernel) {
    case Kernel::phi2:
      return std::max(0.0, 1 - r);
    case Kernel::phi3:
      if (r <= 0.5) return (1 + std::sqrt(1 - 3 * r * r)) / 3;
      return r < 1.5 ? (5 - 3 * r - std::sqrt(1 - 3 * (1 - r) * (1 - r))) / 6 : 0;
    case Kernel::phi4:
      if (r <= 1) return (3 - 2 * r + std::sqrt(1 + 4 * r - 4 * r * r)) / 8;
      return r < 2 ? (5 - 2 * r - std::sqrt(-7 + 12 * r - 4 * r * r)) / 8 : 0;
  }
  return 0;
}

// Kernels keep the first moment, so torque is kept where all of a kernel is counted: what lies beyond a wall
// at the nodes there. What is booked to the wall is a force without a place: taken at the wall's plane, where
// the wall is, it lacks the lever from there to the nodes beyond. A force F along a wall at the distance d
// then turns the fluid as if it acted at d + sum of phi(d - y_j) |y_j| over nodes y_j < 0. Of phi2 the only
// node beyond counts up to d = 1/2, of phi3 up to 1, of phi4 two up to 3/2.
TEST(Markers, TorqueAtAWallLacksTheLeverOfTheNodesBeyondIt) {
  std::printf("kernel   d, dx   share beyond the wall   missing lever, dx\n");
  for (const Kernel kernel : kernels)
    for (const double d : {0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5}) {
      double beyond = 0, lever = 0;
      for (const double y : {0.5, 1.5}) {
        beyond += published(kernel, d + y);
        lever += published(kernel, d + y) * y;
      }
      std::printf("%s     %.2f    %.4f                  %.4f\n", name_of(kernel), d, beyond, lever);
      for (const bool upper : {false, true}) {
        Cloud cloud(1);
        const double wall = upper ? block.ny : 0;
        cloud.local[0] = {9.3, upper ? wall - d : d, 11.1, 0};
        Markers<double> markers(block, Faces{}, kernel, cloud.body);
        markers.locate(cloud.origin.view(), cloud.local.view());
        Array<Node4<double>> value(1), force(block.size());
        value[0] = {0.3, -0.2, 1, 0};
        markers.spread(value.view(), force.view());
        const auto torque = [&](int from, int to) {  // about the x axis through the wall
          double sum = 0;
          for (int k = -3; k < block.nz + 3; ++k)
            for (int j = from; j < to; ++j)
              for (int i = -3; i < block.nx + 3; ++i) {
                const auto f = force[block.at(i, j, k)];
                sum += (j + .5 - wall) * f.z - (k + .5) * f.y;
              }
          return sum;
        };
        const double given = (cloud.local[0].y - wall) * value[0].z - cloud.local[0].z * value[0].y;
        const std::string where = name_of(kernel) + (" at " + std::to_string(d));
        EXPECT_NEAR(torque(-3, block.ny + 3), given, 1e-13) << "of the whole kernel, " << where;
        const double fluid = torque(0, block.ny);
        const auto impulse = fold_force_halo(block, Faces{}, force.view());
        EXPECT_NEAR(impulse[upper][2], beyond * value[0].z, 1e-13) << where;
        const double at_wall = -cloud.local[0].z * impulse[upper][1];
        EXPECT_NEAR(fluid + at_wall - given, (upper ? -1 : 1) * lever * value[0].z, 1e-13) << where;
      }
    }
}

TEST(Markers, SameSumsForAnyNumberOfThreads) {
  Cloud cloud(20000);
  const auto local = convert<float>(cloud.local);
  Array<Node4<float>> value(20000), first;
  for (int m = 0; m < 20000; ++m) value[m] = {std::sin(1.f * m), std::cos(2.f * m), 1.f, 0};
  for (const int threads : {1, 2, 3, 7}) {
    omp_set_num_threads(threads);
    Markers<float> markers(block, Faces{}, Kernel::phi4, cloud.body);
    markers.locate(cloud.origin.view(), local.view());
    Array<Node4<float>> force(block.size());
    markers.spread(value.view(), force.view());
    if (first.size() == 0) {
      first = std::move(force);
    } else {
      EXPECT_EQ(0, std::memcmp(first.data(), force.data(), force.size() * sizeof(Node4<float>)))
          << threads << " threads";
    }
  }
  omp_set_num_threads(omp_get_num_procs());
}

TEST(Markers, WanderingMarkersAgreeWithFreshlySortedOnes) {
  // The sort is kept while markers travel; the result must be that of a new sort at every step.
  Cloud cloud(400);
  Markers<double> kept(block, Faces{}, Kernel::phi4, cloud.body);
  auto u = random_field(5);
  fill_velocity_halo(block, Faces{}, u.view());
  Array<Node4<double>> a(400), b(400), value(400);
  for (auto& v : value) v = {1, 2, 3, 0};
  for (int step = 0; step < 120; ++step) {
    for (int m = 0; m < 400; ++m) {
      cloud.local[m].x += 0.08 * std::sin(m), cloud.local[m].z += 0.09 * std::cos(m);
      cloud.local[m].y =
          std::min(block.ny - .01, std::max(.01, cloud.local[m].y + 0.05 * std::sin(3. * m + step)));
    }
    kept.locate(cloud.origin.view(), cloud.local.view());
    kept.interpolate(u.view(), a.view());
    Markers<double> fresh(block, Faces{}, Kernel::phi4, cloud.body);
    fresh.locate(cloud.origin.view(), cloud.local.view());
    fresh.interpolate(u.view(), b.view());
    for (int m = 0; m < 400; ++m) ASSERT_NEAR(a[m].x, b[m].x, 1e-12) << step << " " << m;
    Array<Node4<double>> fa(block.size()), fb(block.size());
    kept.spread(value.view(), fa.view()), fresh.spread(value.view(), fb.view());
    fold_force_halo(block, Faces{}, fa.view()), fold_force_halo(block, Faces{}, fb.view());
    for (int k = 0; k < block.nz; ++k)
      for (int i = 0; i < block.nx; ++i) ASSERT_NEAR(fa[block.at(i, 5, k)].z, fb[block.at(i, 5, k)].z, 1e-10);
  }
  EXPECT_LT(kept.sorts(), 60);  // the point of keeping the sort
  EXPECT_GT(kept.sorts(), 3);   // and it is renewed when needed
}

TEST(Markers, IdleLanesAreSkippedAndNanIsNamed) {
  Cloud cloud(64);
  cloud.body[5] = -1;
  cloud.local[5] = {1e30, 0, 0, 0};
  Markers<double> markers(block, Faces{}, Kernel::phi4, cloud.body);
  markers.locate(cloud.origin.view(), cloud.local.view());
  EXPECT_EQ(markers.active(), 63u);
  cloud.local[9].y = std::numeric_limits<double>::quiet_NaN();
  try {
    markers.locate(cloud.origin.view(), cloud.local.view());
    FAIL() << "NaN accepted";
  } catch (const PhysicsError& error) {
    EXPECT_NE(std::string(error.what()).find("marker 9"), std::string::npos);
  }
}

}  // namespace
}  // namespace hemowalk::ibm
