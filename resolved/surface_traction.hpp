#pragma once
/// \file What the fluid outside a cell does to its surface (method 5.1 and 12, coupling: paper): the lattice
/// node that speaks for a vertex, the traction there, and what is done to tractions before the solid gets
/// them. One cell at a time, double precision, lattice units.

#include <array>
#include <functional>
#include <vector>

#include "resolved/lbm/fluid.hpp"
#include "resolved/mesh/mesh.hpp"

namespace hemowalk::resolved {

using Node3 = std::array<int, 3>;  ///< i, j, k of a lattice node; its place is (i + 1/2, j + 1/2, k + 1/2)

/// Of the 4 x 4 x 4 nodes of the kernel at \p x the fluid node farthest along the outward \p normal; of
/// equals the one nearest to x. Not wrapped into the period. \p is_fluid says which nodes have populations.
/// \returns false if none of them is fluid.
bool exterior_node(const mesh::Vec3& x, const mesh::Vec3& normal,
                   const std::function<bool(const Node3&)>& is_fluid, Node3& node);

/// Force on a vertex of area \p area: area (sigma_viscous n - pressure n).
mesh::Vec3 surface_force(double area, const mesh::Vec3& normal, double pressure,
                         const std::array<double, 6>& viscous);

/// Takes the mean over the surface, weighted by area, off the pressures: an interior at rest carries it.
void subtract_mean(const std::vector<double>& area, std::vector<double>& pressure);

/// Every vertex with its neighbours along edges.
class OneRings {
 public:
  explicit OneRings(const mesh::TriangleMesh& mesh);
  /// Each component of each vertex becomes the median over the vertex and its one-ring (the mean of the two
  /// in the middle where their number is even). \p scratch takes the old values.
  void median(std::vector<mesh::Vec3>& force, std::vector<mesh::Vec3>& scratch) const;

 private:
  std::vector<int> begin_, vertex_;
};

}  // namespace hemowalk::resolved
