// Nearest points on triangles and the inside test, against their definitions.
#include <gtest/gtest.h>

#include "core/check.hpp"
#include "core/random.hpp"
#include "core/simd.hpp"
#include "resolved/contact/topology.hpp"
#include "tests/support/contact_bodies.hpp"

using namespace hemowalk;
using namespace hemowalk::contact;

namespace {

Point<double> random_point(std::uint64_t id, std::uint64_t step, double scale) {
  const RandomBits a = random_bits(7, Stream::test, id, 2 * step),
                   b = random_bits(7, Stream::test, id, 2 * step + 1);
  return {scale * (2 * uniform_double(a.word[0], a.word[1]) - 1),
          scale * (2 * uniform_double(a.word[2], a.word[3]) - 1),
          scale * (2 * uniform_double(b.word[0], b.word[1]) - 1)};
}

}  // namespace

// q is the nearest point of a convex set if and only if it lies in the set and (p - q).(v - q) <= 0 for all
// its corners v.
TEST(ContactGeometry, NearestPointSatisfiesItsDefinition) {
  int interior = 0, edge = 0, corner = 0;
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const Point<double> v[3] = {random_point(i, 0, 1), random_point(i, 1, 1), random_point(i, 2, 1)};
    const Point<double> p = random_point(i, 3, 2);
    const Nearest<double> n = nearest_on_triangle(p, v[0], v[1], v[2]);
    const double weight[3] = {1 - n.wb - n.wc, n.wb, n.wc};
    Point<double> q{0, 0, 0};
    int zeros = 0;
    for (int k = 0; k < 3; ++k) {
      ASSERT_GE(weight[k], -1e-12);
      zeros += weight[k] < 1e-12;
      q = q + weight[k] * v[k];
    }
    ++(zeros == 0 ? interior : zeros == 1 ? edge : corner);
    for (int k = 0; k < 3; ++k) ASSERT_LE(dot(p - q, v[k] - q), 1e-11) << i;
    const Point<double> difference = n.to_point - (p - q);
    ASSERT_LE(dot(difference, difference), 1e-24);
    ASSERT_NEAR(n.squared, dot(p - q, p - q), 1e-12);
  }
  // All three kinds of feature were met.
  EXPECT_GT(interior, 500);
  EXPECT_GT(edge, 500);
  EXPECT_GT(corner, 500);
}

TEST(ContactGeometry, KnownCases) {
  const Point<double> a{0, 0, 0}, b{2, 0, 0}, c{0, 2, 0};
  auto n = nearest_on_triangle<double>({0.5, 0.5, 3}, a, b, c);  // above the face
  EXPECT_DOUBLE_EQ(n.squared, 9);
  EXPECT_DOUBLE_EQ(n.wb, 0.25);
  EXPECT_DOUBLE_EQ(n.wc, 0.25);
  n = nearest_on_triangle<double>({2, 2, 1}, a, b, c);  // beyond the long edge
  EXPECT_DOUBLE_EQ(n.wb, 0.5);
  EXPECT_DOUBLE_EQ(n.wc, 0.5);
  EXPECT_DOUBLE_EQ(n.squared, 3);
  n = nearest_on_triangle<double>({-1, -1, 0}, a, b, c);  // beyond a corner
  EXPECT_EQ(n.wb, 0);
  EXPECT_EQ(n.wc, 0);
  EXPECT_DOUBLE_EQ(n.squared, 2);
  n = nearest_on_triangle<double>({5, -1, 0}, a, b, c);
  EXPECT_EQ(n.wb, 1);
  EXPECT_DOUBLE_EQ(n.squared, 10);
}

TEST(ContactGeometry, PacksAgreeWithScalars) {
  using P = Pack<double, 8>;
  for (std::uint64_t i = 0; i < 500; ++i) {
    Point<P> x[4];
    Point<double> s[4][8];
    for (int k = 0; k < 4; ++k)
      for (std::size_t l = 0; l < 8; ++l) {
        s[k][l] = random_point(8 * i + l, k, k ? 1 : 2);
        x[k].x[l] = s[k][l].x, x[k].y[l] = s[k][l].y, x[k].z[l] = s[k][l].z;
      }
    const Nearest<P> packed = nearest_on_triangle(x[0], x[1], x[2], x[3]);
    for (std::size_t l = 0; l < 8; ++l) {
      const Nearest<double> scalar = nearest_on_triangle(s[0][l], s[1][l], s[2][l], s[3][l]);
      ASSERT_NEAR(packed.squared[l], scalar.squared, 1e-12);
    }
  }
}

// The sign from pseudo-normals against the winding number, which needs no nearest point: near a biconcave
// surface of coarse triangles, where face normals alone fail at edges and corners.
TEST(ContactGeometry, SideAgreesWithWindingNumber) {
  const mesh::TriangleMesh mesh = mesh::red_cell(2, 4);
  const Topology shape(test::contact_shape(mesh));
  std::vector<Point<double>> x;
  for (const auto& v : mesh.vertices) x.push_back({v[0], v[1], v[2]});
  int inside = 0, at_corner = 0;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    const Point<double> r = random_point(i, 0, 1);
    const Point<double> p{9 * r.x, 4 * r.y, 9 * r.z};
    double angle = 0, best = 1e300;
    Nearest<double> nearest{};
    std::uint32_t where = 0;
    for (std::uint32_t t = 0; t < shape.triangles.size(); ++t) {
      const Corners& c = shape.triangles[t];
      const Point<double> a = x[c[0]] - p, b = x[c[1]] - p, d = x[c[2]] - p;
      const double la = std::sqrt(dot(a, a)), lb = std::sqrt(dot(b, b)), ld = std::sqrt(dot(d, d));
      angle += 2 * std::atan2(dot(a, cross(b, d)),
                              la * lb * ld + dot(a, b) * ld + dot(b, d) * la + dot(d, a) * lb);
      const auto n = nearest_on_triangle(p, x[c[0]], x[c[1]], x[c[2]]);
      if (n.squared < best) best = n.squared, nearest = n, where = t;
    }
    const bool truth = angle > 2 * 3.14159265358979;
    const bool found =
        dot(nearest.to_point, pseudo_normal(shape, x.data(), where, nearest.wb, nearest.wc)) < 0;
    ASSERT_EQ(truth, found) << p.x << " " << p.y << " " << p.z;
    inside += truth;
    at_corner += nearest.wb == 1 || nearest.wc == 1 || (nearest.wb == 0 && nearest.wc == 0);
  }
  EXPECT_GT(inside, 500);
  EXPECT_GT(at_corner, 100);
}

TEST(ContactGeometry, OpenOrTwistedMeshesAreRefused) {
  contact::Shape shape = test::contact_shape(mesh::octahedron_sphere(2));
  contact::Shape open = shape, twisted = shape;
  open.triangles.resize(open.triangles.size() - 3);
  std::swap(twisted.triangles[0], twisted.triangles[1]);
  EXPECT_THROW(Topology{open}, InputError);
  EXPECT_THROW(Topology{twisted}, InputError);
  EXPECT_NO_THROW(Topology{shape});
}
