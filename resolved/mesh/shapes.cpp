#include "resolved/mesh/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/check.hpp"
#include "resolved/mesh/vector.hpp"

namespace hemowalk::mesh {
namespace {

/// Ring L of the octahedron |x| + |y| + |z| = n, from the pole +y (L = 0) to -y (L = 2n): 4 min(L, 2n - L)
/// points.
int ring_quarter(int n, int ring) { return std::min(ring, 2 * n - ring); }
int ring_start(int n, int ring) {
  if (ring == 0) return 0;
  const int upper = std::min(ring, n + 1);  // rings 1 .. upper-1 hold 4, 8, ..
  int start = 1 + 2 * upper * (upper - 1);
  for (int r = upper; r < ring; ++r) start += 4 * ring_quarter(n, r);
  return start;
}

/// A point of the octahedron |p0| + |p1| + |p2| = n, in whole numbers.
using Lattice = std::array<int, 3>;

/// Where the lattice point lies on the unit sphere: even subdivisions bisect the edges of n/2 and project the
/// midpoints (the paper's mesh: eight pieces by three bisections), odd ones project the flat lattice.
Vec3 project(const Lattice& p, int n) {
  const auto unit = [](const Vec3& v) { return scale(1 / norm(v), v); };
  if (n % 2 == 1) return unit({double(p[0]), double(p[1]), double(p[2])});
  std::array<int, 2> odd{};  // a lattice point has no or two odd coordinates
  int found = 0;
  for (int d = 0; d < 3; ++d)
    if (p[d] % 2 != 0) odd[found++] = d;
  if (found == 0) return project({p[0] / 2, p[1] / 2, p[2] / 2}, n / 2);
  const auto parent = [&](int longer, int shorter) {
    Lattice q = p;
    q[longer] += p[longer] > 0 ? 1 : -1;
    q[shorter] -= p[shorter] > 0 ? 1 : -1;
    return project({q[0] / 2, q[1] / 2, q[2] / 2}, n / 2);
  };
  return unit(add(parent(odd[0], odd[1]), parent(odd[1], odd[0])));
}

std::vector<std::array<int, 3>> octahedron_triangles(int n) {
  std::vector<std::array<int, 3>> triangles;
  const auto vertex = [n](int ring, int quarter, int i) {
    const int m = ring_quarter(n, ring);
    return ring_start(n, ring) + (m == 0 ? 0 : (quarter * m + i) % (4 * m));
  };
  for (int ring = 0; ring < 2 * n; ++ring) {
    // The shorter ring's point i sees points i and i + 1 of the longer one.
    const int shorter = ring < n ? ring : ring + 1, longer = ring < n ? ring + 1 : ring;
    const bool flip = ring >= n;
    const int m = ring_quarter(n, shorter);
    for (int quarter = 0; quarter < 4; ++quarter)
      for (int i = 0; i <= m; ++i) {
        const int top = vertex(shorter, quarter, i), left = vertex(longer, quarter, i),
                  right = vertex(longer, quarter, i + 1);
        triangles.push_back(flip ? std::array{top, left, right} : std::array{top, right, left});
        if (i == m) continue;
        const int next = vertex(shorter, quarter, i + 1);
        triangles.push_back(flip ? std::array{top, right, next} : std::array{top, next, right});
      }
  }
  return triangles;
}

/// Half thickness of the Evans-Fung red cell at s = 2 rho/diameter, um.
double evans_fung(double s) {
  const double q = s * s;
  return 0.5 * std::sqrt(std::max(0.0, 1 - q)) * (0.81 + 7.83 * q - 4.39 * q * q);
}

}  // namespace

TriangleMesh octahedron_sphere(int n) {
  require(n >= 1, "subdivision must be at least 1 (a mesh has 4 n^2 + 2 vertices) ask for n >= 1");
  TriangleMesh mesh;
  constexpr int direction[5][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 0}};  // x, z
  for (int ring = 0; ring <= 2 * n; ++ring) {
    const int m = ring_quarter(n, ring);
    if (m == 0) mesh.vertices.push_back(project({0, n - ring, 0}, n));
    for (int quarter = 0; quarter < 4; ++quarter)
      for (int i = 0; i < m; ++i) {
        const auto *a = direction[quarter], *b = direction[quarter + 1];
        mesh.vertices.push_back(project({(m - i) * a[0] + i * b[0], n - ring, (m - i) * a[1] + i * b[1]}, n));
      }
  }
  mesh.triangles = octahedron_triangles(n);
  return mesh;
}

TriangleMesh ellipsoid(const Vec3& radii, int n) {
  for (double r : radii) require(r > 0, "radius must be positive (an ellipsoid needs three) give radii > 0");
  auto mesh = octahedron_sphere(n);
  for (auto& v : mesh.vertices)
    for (int d = 0; d < 3; ++d) v[d] *= radii[d];
  return mesh;
}

TriangleMesh sphere(double radius, int n) { return ellipsoid({radius, radius, radius}, n); }

TriangleMesh platelet(double micrometre, int n) {
  return ellipsoid({1.8 * micrometre, 0.55 * micrometre, 1.8 * micrometre}, n);
}

TriangleMesh red_cell(double micrometre, int n) {
  constexpr double radius = 7.82 / 2;
  auto mesh = octahedron_sphere(n);
  for (auto& v : mesh.vertices) {
    // Along the axis onto the profile: keeps x and z of the sphere. The rim (y = 0) stays in its plane.
    const double half = v[1] == 0 ? 0 : std::copysign(evans_fung(std::hypot(v[0], v[2])), v[1]);
    v = {micrometre * radius * v[0], micrometre * half, micrometre * radius * v[2]};
  }
  return mesh;
}

}  // namespace hemowalk::mesh
