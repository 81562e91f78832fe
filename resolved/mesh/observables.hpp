#pragma once
/// \file What is reported of one cell: size, shape, orientation. Computed in double from its vertices.

#include <vector>

#include "resolved/mesh/mesh.hpp"

namespace hemowalk::mesh {

/// Shape of one cell; lengths in the caller's unit, angles in rad. Flow along z, gradient along y.
struct Observables {
  Vec3 centre{};  ///< centroid of the enclosed volume, absolute
  double area = 0, volume = 0;
  /// Semi-axes of the ellipsoid with the cell's tensor of second volume moments, longest first.
  Vec3 semi_axes{};
  std::array<Vec3, 3> principal{};  ///< unit directions that belong to semi_axes
  double taylor_deformation =
      0;                      ///< (L - B)/(L + B) of the section of that ellipsoid's tensor in the y-z plane
  double inclination = 0;     ///< of the long axis of that section against z, in (-pi/2, pi/2]
  double axial_diameter = 0;  ///< extent of the vertices along principal[0]
  double transverse_diameter = 0;  ///< extent along principal[1]
  Vec3 axis{};                     ///< symmetry axis: the y axis of the body frame fitted to the rest shape
  Vec3 short_axis{};               ///< principal[2], signed so that short_axis . axis >= 0
  double tank_treading_angle = 0;  ///< atan2(y, z) of the material marker seen from the centre, (-pi, pi]
};

/// Measures a cell whose vertices are \p x (absolute or not) against the rest shape \p rest (same numbering).
/// \p marker: the vertex followed for tank-treading, see marker_vertex().
Observables observe(const TriangleMesh& rest, const std::vector<Vec3>& x, int marker);

/// The vertex of \p rest farthest along +z (the rim of an RBC).
int marker_vertex(const TriangleMesh& rest);

}  // namespace hemowalk::mesh
