#pragma once
/// \file Closed triangle surfaces: geometry and connectivity. Lengths are in whatever unit the caller uses.

#include <array>
#include <vector>

namespace hemowalk::mesh {

using Vec3 = std::array<double, 3>;  ///< x, y, z

/// A closed, consistently oriented (normals outward) triangle surface.
struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> triangles;  ///< counter-clockwise seen from outside

  int vertex_count() const { return static_cast<int>(vertices.size()); }
  int triangle_count() const { return static_cast<int>(triangles.size()); }
};

/// An edge shared by two triangles: (v0, v1, v2) left of it and (v1, v0, v3) right of it.
struct Edge {
  int v0, v1;  ///< its ends
  int v2, v3;  ///< opposite vertices
  int t0, t1;  ///< the triangles that hold v2 and v3
};

/// Enclosed volume (divergence theorem; positive for outward normals).
double volume(const TriangleMesh& mesh);
double area(const TriangleMesh& mesh);
/// Centroid of the enclosed volume.
Vec3 centroid(const TriangleMesh& mesh);
/// One third of the area of the adjacent triangles, per vertex; sums to area().
std::vector<double> vertex_areas(const TriangleMesh& mesh);
/// Area-weighted unit normals, outward, per vertex.
std::vector<Vec3> vertex_normals(const TriangleMesh& mesh);
/// Every edge once, with its opposite vertices; ordered by (smaller end, larger end).
std::vector<Edge> edges(const TriangleMesh& mesh);
/// Mean edge length.
double mean_edge(const TriangleMesh& mesh);
/// Largest distance of a vertex from \p centre.
double bounding_radius(const TriangleMesh& mesh, const Vec3& centre = {0, 0, 0});

/// Checks that \p mesh is a closed, 2-manifold, connected, non-degenerate surface; makes its orientation
/// consistent and outward (flipping triangles where needed).
/// \throws InputError naming the first offending vertex, edge or triangle.
void make_valid(TriangleMesh& mesh);

}  // namespace hemowalk::mesh
