#pragma once
/// \file Tables: what the inner loops read of a CellType, in their own precision. Shared by host and device.

#include <vector>

#include "resolved/npfem/cell_type.hpp"
#include "resolved/npfem/terms/edge_bending.hpp"
#include "resolved/npfem/terms/local_area.hpp"
#include "resolved/npfem/terms/neo_hookean.hpp"
#include "resolved/npfem/terms/skalak.hpp"
#include "resolved/npfem/terms/skalak_hardening.hpp"
#include "resolved/npfem/terms/volume.hpp"

namespace hemowalk::npfem {

/// The paper's in-plane law: Skalak shear with hardening, plus local area.
template <class S>
struct PaperLaw {
  SkalakHardening<S> shear;
  LocalArea<S> area;
  template <class T>
  HEMO_HD StretchGradient<T> gradient(const Stretch<T>& s) const {
    return shear.gradient(s) + area.gradient(s);
  }
};

/// CellType's tables in the arithmetic of the batch.
template <class Real>
struct Tables {
  struct TriangleRow {
    int v0, v1, v2;
    RestTriangle<Real> rest;
  };
  struct EdgeRow {
    int v0, v1, v2, v3;
    RestEdge<Real> rest;
  };
  explicit Tables(const CellType& type);

  int vertices;
  Material material;
  std::vector<TriangleRow> triangles;
  std::vector<EdgeRow> edges;
  std::vector<Real> metric, mass_rate, kappa,
      kappa_after;  ///< m, m/(h^2 (1 - kappa)), kappas of every vertex
  std::vector<int> order, row_begin, row_index, column_begin, column_index;  ///< SparseFactor
  std::vector<Real> row_value, column_value, inverse_diagonal;
  std::vector<int> lap_begin, lap_index;  ///< full rows of Lap (Rayleigh damping)
  std::vector<Real> lap_value;
  Real h, inverse_h, rest_volume, rest_gradient_square, epsilon2, total_metric;
  bool damped, damp_after;  ///< kappa, kappa_after are not zero
  bool stiff_volume;        ///< k_v exceeds half the mean mass rate: N needs the volume term to converge
};

}  // namespace hemowalk::npfem
