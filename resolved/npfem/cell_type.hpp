#pragma once
/// \file CellType: everything cells with one rest shape share, above all one sparse Cholesky factorisation.

#include <memory>
#include <vector>

#include "resolved/mesh/mesh.hpp"
#include "resolved/npfem/material.hpp"

namespace hemowalk::npfem {

/// L D L^T = P N P^T of a sparse symmetric positive definite matrix, flat, with row and column lists of the
/// unit lower factor for gather-only triangular solves. Indices are vertex numbers: no permutation is
/// applied.
struct SparseFactor {
  std::vector<int> order;                 ///< elimination order: vertex numbers
  std::vector<int> row_begin, row_index;  ///< forward sweep: position in order -> earlier vertices
  std::vector<double> row_value;
  std::vector<int> column_begin, column_index;  ///< backward sweep: position in order -> later vertices
  std::vector<double> column_value;
  std::vector<double> inverse_diagonal;  ///< by position in order
};

/// Rest shape, material, mass metric and time step of one kind of cell, and the matrix they make:
/// N = diag(metric/h^2 + c/h) + Lap, c the drag of the kappa damping, Lap >= the elastic Hessian (method 3).
class CellType {
 public:
  /// \p rest valid and centred where the body's frame is; \p metric m_k + k a_k per vertex (the mass of the
  /// implicit step); \p h the solid time step. The in-plane stand-in is Material::standin().
  CellType(mesh::TriangleMesh rest, Material material, std::vector<double> metric, double h);

  const mesh::TriangleMesh& rest() const { return rest_; }
  const Material& material() const { return material_; }
  const std::vector<double>& metric() const { return metric_; }
  double h() const { return h_; }
  const std::vector<mesh::Edge>& edges() const { return edges_; }
  const std::vector<double>& vertex_areas() const { return vertex_areas_; }
  double rest_area() const { return rest_area_; }
  double rest_volume() const { return rest_volume_; }
  double rest_gradient_square() const { return rest_gradient_square_; }  ///< sum_j |g_j|^2 of the rest shape
  double bounding_radius() const { return bounding_radius_; }
  int marker() const { return marker_; }
  const SparseFactor& factor() const { return factor_; }

  /// Rest data of a triangle: inverse of the rest metric of (x1 - x0, x2 - x0) and area.
  struct TriangleRest {
    double b11, b12, b22, area;
  };
  const std::vector<TriangleRest>& triangle_rest() const { return triangle_rest_; }
  /// Rest data of an edge: weights of v0..v3 (they sum to zero), 3 k_b/(A0 + A1), |e| at rest.
  struct EdgeRest {
    double w0, w1, w2, w3, stiffness, length;
  };
  const std::vector<EdgeRest>& edge_rest() const { return edge_rest_; }
  /// Length below which |e| of the bending term is rounded off (keeps its derivative finite).
  double bending_epsilon() const { return bending_epsilon_; }
  /// Lap as (row, column, value) of its lower triangle, for the reference path and Rayleigh damping.
  struct Entry {
    int row, column;
    double value;
  };
  const std::vector<Entry>& laplacian() const { return laplacian_; }
  /// kappa of each vertex at this h and metric: kappa_k/(1 - kappa_k) = c_A A_k h/metric_k (method 3).
  /// Zero with Material::damp_after: then it is kappa_after() that acts, on the solved velocity.
  const std::vector<double>& kappa() const { return kappa_; }
  const std::vector<double>& kappa_after() const { return kappa_after_; }

 private:
  mesh::TriangleMesh rest_;
  Material material_;
  std::vector<double> metric_;
  double h_;
  std::vector<mesh::Edge> edges_;
  std::vector<double> vertex_areas_;
  std::vector<TriangleRest> triangle_rest_;
  std::vector<EdgeRest> edge_rest_;
  std::vector<Entry> laplacian_;
  std::vector<double> kappa_, kappa_after_;
  SparseFactor factor_;
  double rest_area_ = 0, rest_volume_ = 0, rest_gradient_square_ = 0, bounding_radius_ = 0;
  double bending_epsilon_ = 0;
  int marker_ = 0;
};

}  // namespace hemowalk::npfem
