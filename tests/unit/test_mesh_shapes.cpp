#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "core/check.hpp"
#include "resolved/mesh/shapes.hpp"
#include "resolved/mesh/vector.hpp"

namespace hemowalk::mesh {
namespace {

TEST(Shapes, SubdividedOctahedronHasTheCountsOfAClosedSurface) {
  for (int n : {1, 2, 3, 4, 5, 8, 12}) {
    auto mesh = octahedron_sphere(n);
    EXPECT_EQ(mesh.vertex_count(), 4 * n * n + 2);
    EXPECT_EQ(mesh.triangle_count(), 8 * n * n);
    const auto before = mesh.triangles;
    EXPECT_NO_THROW(make_valid(mesh)) << n;
    EXPECT_EQ(mesh.triangles, before) << "triangles were not oriented outward";
    EXPECT_EQ(static_cast<int>(edges(mesh).size()), 12 * n * n);  // Euler: V - E + F = 2
    for (const auto& v : mesh.vertices) EXPECT_NEAR(norm(v), 1, 1e-15);
  }
}

/// The cell numbers of the paper's Table 1 confine the RBC's volume to (91.798463, 91.799266] um^3.
TEST(Shapes, RedCellReproducesTheCensusOfThePaper) {
  const double v = volume(red_cell(1, 8));
  const double boxes[] = {50. * 50 * 50, 50. * 100 * 50, 50. * 500 * 50, 50. * 1000 * 50, 100. * 1000 * 100};
  const int rbc35[] = {476, 953, 4765, 9531, 38126}, rbc45[] = {612, 1225, 6127, 12255, 49020};
  const int plt35[] = {95, 190, 953, 1906, 7625}, plt45[] = {122, 245, 1225, 2451, 9804};
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(static_cast<int>(0.35 * boxes[i] / v), rbc35[i]);
    EXPECT_EQ(static_cast<int>(0.45 * boxes[i] / v), rbc45[i]);
    EXPECT_EQ(rbc35[i] / 5, plt35[i]);
    EXPECT_EQ(rbc45[i] / 5, plt45[i]);
  }
  EXPECT_NEAR(v, 91.8, 0.05);  // three digits of method 2
  EXPECT_NEAR(area(red_cell(1, 8)), 131.9, 0.05);
  EXPECT_NEAR(volume(platelet(1, 4)), 6.8, 0.05);
}

TEST(Shapes, RedCellHasItsDiameterAndThickness) {
  const auto mesh = red_cell(2, 16);
  double x = 0, y = 0, dimple = 1e9;
  for (const auto& v : mesh.vertices) {
    x = std::max(x, std::abs(v[0]));
    y = std::max(y, std::abs(v[1]));
    if (std::hypot(v[0], v[2]) < 1e-12) dimple = std::min(dimple, std::abs(v[1]));
  }
  EXPECT_NEAR(2 * x, 2 * 7.82, 1e-12);
  EXPECT_NEAR(2 * y, 2 * 2.57, 0.02);
  EXPECT_NEAR(2 * dimple, 2 * 0.81, 1e-12);
}

/// Inscribed surfaces converge with the square of the edge length, each shape to one limit.
TEST(Shapes, VolumeAndAreaConvergeAtSecondOrder) {
  const auto order = [](const auto& measure) {
    const double a = measure(8), b = measure(16), c = measure(32);
    return std::log2((b - a) / (c - b));
  };
  EXPECT_NEAR(order([](int n) { return volume(red_cell(1, n)); }), 2, 0.1);
  EXPECT_NEAR(order([](int n) { return area(red_cell(1, n)); }), 2, 0.15);
  EXPECT_NEAR(order([](int n) { return volume(sphere(1, n)); }), 2, 0.05);
  const double v16 = volume(sphere(1, 16)), v32 = volume(sphere(1, 32)), exact = 4 * std::numbers::pi / 3;
  EXPECT_LT(std::abs(v32 + (v32 - v16) / 3 - exact),
            0.01 * std::abs(v32 - exact));  // Richardson finds the limit
}

TEST(Shapes, VertexAreasSumToTheAreaAndNormalsPointOutward) {
  const auto mesh = ellipsoid({1, 2, 3}, 6);
  const auto a = vertex_areas(mesh);
  EXPECT_NEAR(std::accumulate(a.begin(), a.end(), 0.0), area(mesh), 1e-12 * area(mesh));
  const auto n = vertex_normals(mesh);
  for (int k = 0; k < mesh.vertex_count(); ++k) {
    const auto& v = mesh.vertices[k];
    const Vec3 exact{v[0], v[1] / 4, v[2] / 9};
    EXPECT_NEAR(norm(n[k]), 1, 1e-14);
    EXPECT_GT(dot(n[k], exact) / norm(exact), 0.97);  // discretisation of n = 6
  }
}

TEST(Shapes, EdgesKnowTheirOppositeVertices) {
  const auto mesh = octahedron_sphere(3);
  for (const auto& e : edges(mesh)) {
    const auto holds = [&](int t, int v) {
      const auto& tri = mesh.triangles[t];
      return tri[0] == v || tri[1] == v || tri[2] == v;
    };
    for (int v : {e.v0, e.v1}) EXPECT_TRUE(holds(e.t0, v) && holds(e.t1, v));
    EXPECT_TRUE(holds(e.t0, e.v2) && holds(e.t1, e.v3));
    // (v0, v1, v2) is counter-clockwise from outside
    const auto& x = mesh.vertices;
    const auto n = cross(subtract(x[e.v1], x[e.v0]), subtract(x[e.v2], x[e.v0]));
    EXPECT_GT(dot(n, x[e.v0]), 0);
  }
}

std::string complaint(TriangleMesh mesh) {
  try {
    make_valid(mesh);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(Validity, NamesWhatIsWrong) {
  const auto good = octahedron_sphere(2);
  auto open = good;
  open.triangles.pop_back();
  EXPECT_NE(complaint(open).find("open at edge"), std::string::npos);
  auto doubled = good;
  doubled.triangles.push_back(good.triangles[0]);
  EXPECT_NE(complaint(doubled).find("not a 2-manifold at edge"), std::string::npos);
  auto flat = good;
  flat.vertices[flat.triangles[0][0]] = flat.vertices[flat.triangles[0][1]];
  EXPECT_NE(complaint(flat).find("degenerate"), std::string::npos);
  auto stray = good;
  stray.vertices.push_back({9, 9, 9});
  EXPECT_NE(complaint(stray).find("belongs to no triangle"), std::string::npos);
  auto two = good;
  for (const auto& v : good.vertices) two.vertices.push_back(add(v, {5, 0, 0}));
  for (auto t : good.triangles) {
    for (int& v : t) v += good.vertex_count();
    two.triangles.push_back(t);
  }
  EXPECT_NE(complaint(two).find("more than one piece"), std::string::npos);
  auto missing = good;
  missing.triangles[3][1] = 999;
  EXPECT_NE(complaint(missing).find("999"), std::string::npos);
}

TEST(Validity, TwoSheetsTouchingInOnePointAreFound) {
  // Two octahedra glued at one vertex.
  auto mesh = octahedron_sphere(1);
  const int n = mesh.vertex_count();
  const auto first = mesh.triangles;
  int touch = 0;
  for (int k = 0; k < n; ++k)
    if (mesh.vertices[k][0] > 0.9) touch = k;
  std::vector<int> name(n);
  const auto old = mesh.vertices;
  for (int k = 0; k < n; ++k) {
    if (old[k][0] < -0.9) {
      name[k] = touch;
      continue;
    }
    name[k] = mesh.vertex_count();
    mesh.vertices.push_back(add(old[k], {2, 0, 0}));
  }
  for (auto t : first) mesh.triangles.push_back({name[t[0]], name[t[1]], name[t[2]]});
  const auto text = complaint(mesh);
  EXPECT_TRUE(text.find("touch in one point") != std::string::npos ||
              text.find("more than one piece") != std::string::npos)
      << text;
  EXPECT_FALSE(text.empty());
}

TEST(Validity, OrientationIsRepaired) {
  auto mesh = octahedron_sphere(3);
  const double v = volume(mesh);
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3)
    std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  make_valid(mesh);
  EXPECT_NEAR(volume(mesh), v, 1e-14);
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);  // all inward
  make_valid(mesh);
  EXPECT_NEAR(volume(mesh), v, 1e-14);
}

}  // namespace
}  // namespace hemowalk::mesh
