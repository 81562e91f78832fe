#pragma once
/// \file The bodies of the paper and simple shapes, all from one subdivided octahedron: subdivision n gives
/// 4 n^2 + 2 vertices and 8 n^2 triangles. Centred at the origin; the symmetry axis is y.

#include "resolved/mesh/mesh.hpp"

namespace hemowalk::mesh {

/// Unit sphere: octahedron subdivided \p n times along each edge, projected.
TriangleMesh octahedron_sphere(int n);
TriangleMesh sphere(double radius, int n);
TriangleMesh ellipsoid(const Vec3& radii, int n);
/// Platelet: oblate ellipsoid of 3.6 x 1.1 x 3.6 um (method 2). \p micrometre: length of 1 um in the caller's
/// unit.
TriangleMesh platelet(double micrometre, int n = 4);
/// Red blood cell: biconcave Evans-Fung profile, diameter 7.82 um, thickness 0.81 (dimple) to 2.57 um (method
/// 2). n = 8 is the paper's mesh: 258 vertices, its volume reproduces every cell count of the paper's
/// Table 1.
TriangleMesh red_cell(double micrometre, int n = 8);

}  // namespace hemowalk::mesh
