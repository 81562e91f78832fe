#include "resolved/mesh/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "core/check.hpp"
#include "resolved/mesh/vector.hpp"

namespace hemowalk::mesh {
namespace {

/// Twice the area times the unit normal.
Vec3 area_normal(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  const auto& a = mesh.vertices[t[0]];
  return cross(subtract(mesh.vertices[t[1]], a), subtract(mesh.vertices[t[2]], a));
}

std::string text(const std::array<int, 3>& t) {
  return "(" + std::to_string(t[0]) + ", " + std::to_string(t[1]) + ", " + std::to_string(t[2]) + ")";
}

/// Undirected edge -> the (at most two) triangles that hold it.
using EdgeMap = std::map<std::pair<int, int>, std::vector<int>>;

EdgeMap edge_map(const TriangleMesh& mesh) {
  EdgeMap map;
  for (int t = 0; t < mesh.triangle_count(); ++t)
    for (int i = 0; i < 3; ++i) {
      const int a = mesh.triangles[t][i], b = mesh.triangles[t][(i + 1) % 3];
      map[std::minmax(a, b)].push_back(t);
    }
  return map;
}

bool holds_directed(const std::array<int, 3>& t, int a, int b) {
  return (t[0] == a && t[1] == b) || (t[1] == a && t[2] == b) || (t[2] == a && t[0] == b);
}

void check_triangles(const TriangleMesh& mesh) {
  require(mesh.triangle_count() >= 4, "surface has fewer than 4 triangles (not closed) check the file");
  Vec3 low = mesh.vertices[0], high = low;
  for (const auto& v : mesh.vertices)
    for (int d = 0; d < 3; ++d) {
      require(std::isfinite(v[d]),
              "vertex with a coordinate that is not finite (damaged file) check the file");
      low[d] = std::min(low[d], v[d]), high[d] = std::max(high[d], v[d]);
    }
  const double size = norm(subtract(high, low));
  for (int t = 0; t < mesh.triangle_count(); ++t) {
    const auto& v = mesh.triangles[t];
    for (int i : v)
      require(i >= 0 && i < mesh.vertex_count(), [&] {
        return "triangle " + std::to_string(t) + " " + text(v) +
               " names a vertex that is not there (the mesh has " + std::to_string(mesh.vertex_count()) +
               ") check the file";
      });
    require(norm(area_normal(mesh, v)) > 1e-12 * size * size, [&] {
      return "triangle " + std::to_string(t) + " " + text(v) +
             " is degenerate (no area: repeated or aligned vertices) clean the mesh";
    });
  }
}

void check_edges(const EdgeMap& map) {
  for (const auto& [edge, triangles] : map) {
    const auto name = std::to_string(edge.first) + "-" + std::to_string(edge.second);
    require(triangles.size() != 1, [&] {
      return "surface is open at edge " + name + " (only triangle " + std::to_string(triangles[0]) +
             " holds it) close the hole";
    });
    require(triangles.size() == 2, [&] {
      return "surface is not a 2-manifold at edge " + name + " (" + std::to_string(triangles.size()) +
             " triangles share it) remove the extra sheets";
    });
  }
}

/// Flips triangles so that neighbours agree, by flooding from triangle 0.
void make_consistent(TriangleMesh& mesh, const EdgeMap& map) {
  std::vector<char> seen(mesh.triangle_count(), 0);
  std::vector<int> stack{0};
  seen[0] = 1;
  int reached = 1;
  while (!stack.empty()) {
    const int t = stack.back();
    stack.pop_back();
    const auto tri = mesh.triangles[t];
    for (int i = 0; i < 3; ++i) {
      const int a = tri[i], b = tri[(i + 1) % 3];
      const auto& pair = map.at(std::minmax(a, b));
      const int other = pair[0] == t ? pair[1] : pair[0];
      const bool agrees = holds_directed(mesh.triangles[other], b, a);
      if (seen[other]) {
        require(agrees, [&] {
          return "surface cannot be oriented (a one-sided sheet through edge " + std::to_string(a) + "-" +
                 std::to_string(b) + ") use an orientable closed surface";
        });
        continue;
      }
      if (!agrees) std::swap(mesh.triangles[other][1], mesh.triangles[other][2]);
      seen[other] = 1;
      ++reached;
      stack.push_back(other);
    }
  }
  require(reached == mesh.triangle_count(), [&] {
    return "surface has more than one piece (" + std::to_string(reached) + " of " +
           std::to_string(mesh.triangle_count()) +
           " triangles hang together) give one closed surface per file";
  });
}

/// Every vertex is used and its triangles form one fan.
void check_vertices(const TriangleMesh& mesh) {
  std::vector<int> degree(mesh.vertex_count(), 0);
  std::vector<std::map<int, int>> next(mesh.vertex_count());  // ring: neighbour -> following neighbour
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      ++degree[t[i]];
      next[t[i]][t[(i + 1) % 3]] = t[(i + 2) % 3];
    }
  for (int v = 0; v < mesh.vertex_count(); ++v) {
    require(degree[v] > 0, [&] {
      return "vertex " + std::to_string(v) + " belongs to no triangle (stray point) remove it";
    });
    int length = 0;
    const int start = next[v].begin()->first;
    for (int at = start; length == 0 || at != start; at = next[v].at(at)) ++length;
    require(length == degree[v], [&] {
      return "surface is not a 2-manifold at vertex " + std::to_string(v) +
             " (two sheets touch in one point) split the vertex";
    });
  }
}

}  // namespace

double volume(const TriangleMesh& mesh) {
  const auto& origin = mesh.vertices.front();  // any origin: the nearer the less round-off
  double sum = 0;
  for (const auto& t : mesh.triangles)
    sum += dot(subtract(mesh.vertices[t[0]], origin),
               cross(subtract(mesh.vertices[t[1]], origin), subtract(mesh.vertices[t[2]], origin)));
  return sum / 6;
}

double area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) sum += norm(area_normal(mesh, t));
  return sum / 2;
}

Vec3 centroid(const TriangleMesh& mesh) {
  const auto& origin = mesh.vertices.front();
  Vec3 sum{};
  double total = 0;
  for (const auto& t : mesh.triangles) {
    const auto a = subtract(mesh.vertices[t[0]], origin), b = subtract(mesh.vertices[t[1]], origin),
               c = subtract(mesh.vertices[t[2]], origin);
    const double v = dot(a, cross(b, c));
    accumulate(sum, v / 4, add(a, add(b, c)));
    total += v;
  }
  return add(origin, scale(1 / total, sum));
}

std::vector<double> vertex_areas(const TriangleMesh& mesh) {
  std::vector<double> areas(mesh.vertex_count(), 0.0);
  for (const auto& t : mesh.triangles) {
    const double third = norm(area_normal(mesh, t)) / 6;
    for (int v : t) areas[v] += third;
  }
  return areas;
}

std::vector<Vec3> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Vec3> normals(mesh.vertex_count(), Vec3{});
  for (const auto& t : mesh.triangles) {
    const auto n = area_normal(mesh, t);
    for (int v : t) accumulate(normals[v], 1, n);
  }
  for (auto& n : normals) n = scale(1 / norm(n), n);
  return normals;
}

std::vector<Edge> edges(const TriangleMesh& mesh) {
  std::vector<Edge> result;
  for (const auto& [ends, triangles] : edge_map(mesh)) {
    Edge e{ends.first, ends.second, -1, -1, triangles.at(0), triangles.at(1)};
    if (!holds_directed(mesh.triangles[e.t0], e.v0, e.v1)) std::swap(e.t0, e.t1);
    for (int v : mesh.triangles[e.t0])
      if (v != e.v0 && v != e.v1) e.v2 = v;
    for (int v : mesh.triangles[e.t1])
      if (v != e.v0 && v != e.v1) e.v3 = v;
    result.push_back(e);
  }
  return result;
}

double mean_edge(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) sum += norm(subtract(mesh.vertices[t[(i + 1) % 3]], mesh.vertices[t[i]]));
  return sum / (3.0 * mesh.triangle_count());
}

double bounding_radius(const TriangleMesh& mesh, const Vec3& centre) {
  double radius = 0;
  for (const auto& v : mesh.vertices) radius = std::max(radius, norm(subtract(v, centre)));
  return radius;
}

void make_valid(TriangleMesh& mesh) {
  require(!mesh.vertices.empty(), "surface without vertices (empty file) check the file");
  check_triangles(mesh);
  const auto map = edge_map(mesh);
  check_edges(map);
  make_consistent(mesh, map);
  check_vertices(mesh);
  if (volume(mesh) < 0)
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
}

}  // namespace hemowalk::mesh
