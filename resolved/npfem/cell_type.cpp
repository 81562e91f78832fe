#include "resolved/npfem/cell_type.hpp"

#include <Eigen/SparseCholesky>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "core/check.hpp"
#include "resolved/mesh/observables.hpp"
#include "resolved/mesh/vector.hpp"

namespace hemowalk::npfem {
namespace {

using mesh::cross;
using mesh::dot;
using mesh::norm;
using mesh::subtract;

CellType::TriangleRest rest_of(const mesh::TriangleMesh& m, const std::array<int, 3>& t) {
  const auto e1 = subtract(m.vertices[t[1]], m.vertices[t[0]]),
             e2 = subtract(m.vertices[t[2]], m.vertices[t[0]]);
  const double g11 = dot(e1, e1), g12 = dot(e1, e2), g22 = dot(e2, e2),
               det = dot(cross(e1, e2), cross(e1, e2));
  return {g22 / det, -g12 / det, g11 / det, std::sqrt(det) / 2};
}

/// Cotangent weights (method 12): e = sum w_k x_k vanishes where the two triangles are coplanar.
CellType::EdgeRest rest_of(const mesh::TriangleMesh& m, const mesh::Edge& e, double modulus, double epsilon) {
  const auto& x = m.vertices;
  const auto square = [&](int i, int j) { return dot(subtract(x[j], x[i]), subtract(x[j], x[i])); };
  const auto triangle_area = [&](int i) {
    return norm(cross(subtract(x[e.v1], x[e.v0]), subtract(x[i], x[e.v0]))) / 2;
  };
  const double l01 = square(e.v0, e.v1), l02 = square(e.v0, e.v2), l12 = square(e.v1, e.v2);
  const double l03 = square(e.v0, e.v3), l13 = square(e.v1, e.v3);
  const double a0 = triangle_area(e.v2), a1 = triangle_area(e.v3);
  const double cot02 = (l01 - l02 + l12) / (4 * a0), cot12 = (l01 + l02 - l12) / (4 * a0);
  const double cot03 = (l01 - l03 + l13) / (4 * a1), cot13 = (l01 + l03 - l13) / (4 * a1);
  CellType::EdgeRest r{cot02 + cot03,    cot12 + cot13,           -(cot02 + cot12),
                       -(cot03 + cot13), 3 * modulus / (a0 + a1), 0};
  mesh::Vec3 vector{};
  for (auto [k, w] : {std::pair{e.v0, r.w0}, {e.v1, r.w1}, {e.v2, r.w2}, {e.v3, r.w3}})
    mesh::accumulate(vector, w, x[k]);
  r.length = std::sqrt(dot(vector, vector) + epsilon * epsilon);
  return r;
}

/// Symmetric matrix as a map of its lower triangle.
class Accumulator {
 public:
  void add(int i, int j, double value) {
    if (i >= j) entries_[{i, j}] += value;
  }
  /// + scale w w^T
  void add_square(const std::map<int, double>& w, double scale) {
    for (auto [i, a] : w)
      for (auto [j, b] : w) add(i, j, scale * a * b);
  }
  void add(const Accumulator& other) {
    for (const auto& [at, value] : other.entries_) entries_[at] += value;
  }
  std::vector<CellType::Entry> entries() const {
    std::vector<CellType::Entry> list;
    for (const auto& [at, value] : entries_) list.push_back({at.first, at.second, value});
    return list;
  }

 private:
  std::map<std::pair<int, int>, double> entries_;
};

/// In-plane stand-in: Hessian of stiffness A/2 |[e1 e2] R|^2 per coordinate.
void add_stretch(Accumulator& lap, const std::array<int, 3>& t, const CellType::TriangleRest& r,
                 double stiffness) {
  const double k11 = stiffness * r.area * r.b11, k12 = stiffness * r.area * r.b12,
               k22 = stiffness * r.area * r.b22;
  const double k[3][3] = {
      {k11 + 2 * k12 + k22, -k11 - k12, -k12 - k22}, {-k11 - k12, k11, k12}, {-k12 - k22, k12, k22}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) lap.add(t[i], t[j], k[i][j]);
}

std::map<int, double> edge_weights(const mesh::Edge& e, const CellType::EdgeRest& r) {
  return {{e.v0, r.w0}, {e.v1, r.w1}, {e.v2, r.w2}, {e.v3, r.w3}};
}

/// Bending stand-in. paper: the edge energy's own bound. helfrich: 4 k_b/A_i m_i m_i^T with m_i = 1/4 sum of
/// the edge weights around vertex i, the linearised integrated mean curvature.
void add_bending(Accumulator& lap, const CellType& type) {
  const auto& edges = type.edges();
  const auto& rest = type.edge_rest();
  if (type.material().bending == Bending::paper)
    for (std::size_t i = 0; i < edges.size(); ++i)
      lap.add_square(edge_weights(edges[i], rest[i]), rest[i].stiffness);
  if (type.material().bending != Bending::helfrich) return;
  std::vector<std::map<int, double>> curvature(type.rest().vertex_count());
  for (std::size_t i = 0; i < edges.size(); ++i)
    for (int end : {edges[i].v0, edges[i].v1})
      for (auto [k, w] : edge_weights(edges[i], rest[i])) curvature[end][k] += w / 4;
  for (int k = 0; k < type.rest().vertex_count(); ++k)
    lap.add_square(curvature[k], 4 * type.material().bending_modulus / type.vertex_areas()[k]);
}

/// Whether the bending stand-in is worth its fill-in (its stencil is twice as wide, the factor four times as
/// long): only if it can be felt beside mass and in-plane stand-in, by the largest row sum over the diagonal.
bool matters(const std::vector<CellType::Entry>& bending, const std::vector<CellType::Entry>& stretch,
             const std::vector<double>& metric, double h) {
  std::vector<double> row(metric.size(), 0.0), diagonal(metric.size());
  for (std::size_t k = 0; k < metric.size(); ++k) diagonal[k] = metric[k] / (h * h);
  for (const auto& e : stretch)
    if (e.row == e.column) diagonal[e.row] += e.value;
  for (const auto& e : bending) {
    row[e.row] += std::abs(e.value);
    if (e.row != e.column) row[e.column] += std::abs(e.value);
  }
  for (std::size_t k = 0; k < metric.size(); ++k)
    if (row[k] > 0.1 * diagonal[k]) return true;
  return false;
}

SparseFactor factorise(int n, const std::vector<CellType::Entry>& entries) {
  using Matrix = Eigen::SparseMatrix<double>;
  std::vector<Eigen::Triplet<double>> triplets;
  for (const auto& e : entries) triplets.emplace_back(e.row, e.column, e.value);
  Matrix lower(n, n);
  lower.setFromTriplets(triplets.begin(), triplets.end());
  Eigen::SimplicialLDLT<Matrix, Eigen::Lower> ldlt(lower);  // AMD ordering
  require(ldlt.info() == Eigen::Success && (ldlt.vectorD().array() > 0).all(),
          "matrix of the solid solver is not positive definite (masses or moduli of a cell type are not "
          "positive) "
          "check its metric, moduli and mesh");
  SparseFactor f;
  f.order.resize(n);
  for (int v = 0; v < n; ++v) f.order[ldlt.permutationP().indices()(v)] = v;
  const Matrix column = ldlt.matrixL().nestedExpression();
  const Eigen::SparseMatrix<double, Eigen::RowMajor> row = column;
  const auto flatten = [&](const auto& matrix, auto& begin, auto& index, auto& value) {
    begin.push_back(0);
    for (int p = 0; p < n; ++p) {
      for (typename std::decay_t<decltype(matrix)>::InnerIterator it(matrix, p); it; ++it)
        if (it.row() > it.col()) {
          index.push_back(f.order[&begin == &f.row_begin ? it.col() : it.row()]);
          value.push_back(it.value());
        }
      begin.push_back(static_cast<int>(index.size()));
    }
  };
  flatten(row, f.row_begin, f.row_index, f.row_value);
  flatten(column, f.column_begin, f.column_index, f.column_value);
  for (int p = 0; p < n; ++p) f.inverse_diagonal.push_back(1 / ldlt.vectorD()(p));
  return f;
}

}  // namespace

CellType::CellType(mesh::TriangleMesh rest, Material material, std::vector<double> metric, double h)
    : rest_(std::move(rest)), material_(material), metric_(std::move(metric)), h_(h) {
  const int n = rest_.vertex_count();
  require(h_ > 0, "solid time step must be positive (a step moves by h v) give h > 0");
  require(static_cast<int>(metric_.size()) == n, "metric needs one mass per vertex (" + std::to_string(n) +
                                                     " vertices, " + std::to_string(metric_.size()) +
                                                     " masses) pass m_k + k a_k for every vertex");
  for (double m : metric_)
    require(m > 0, "metric must be positive (m_k + k a_k) give the vertices mass or coupling");
  edges_ = mesh::edges(rest_);
  vertex_areas_ = mesh::vertex_areas(rest_);
  rest_area_ = mesh::area(rest_);
  rest_volume_ = mesh::volume(rest_);
  bounding_radius_ = mesh::bounding_radius(rest_);
  marker_ = mesh::marker_vertex(rest_);
  bending_epsilon_ = 1e-4 * mesh::mean_edge(rest_);

  std::vector<mesh::Vec3> gradient(n, mesh::Vec3{});
  Accumulator lap;
  for (const auto& t : rest_.triangles) {
    triangle_rest_.push_back(rest_of(rest_, t));
    add_stretch(lap, t, triangle_rest_.back(), material_.standin());
    const auto& x = rest_.vertices;
    const auto normal = cross(subtract(x[t[1]], x[t[0]]), subtract(x[t[2]], x[t[0]]));
    for (int v : t) mesh::accumulate(gradient[v], 1.0 / 6, normal);
  }
  for (const auto& g : gradient) rest_gradient_square_ += dot(g, g);
  for (const auto& e : edges_)
    edge_rest_.push_back(rest_of(rest_, e, material_.bending_modulus, bending_epsilon_));
  Accumulator bending;
  add_bending(bending, *this);
  if (matters(bending.entries(), lap.entries(), metric_, h_)) lap.add(bending);
  laplacian_ = lap.entries();

  const double stiffness_scale = 1 + material_.rayleigh_beta / h_;
  std::vector<Entry> matrix = laplacian_;
  for (auto& e : matrix) e.value *= stiffness_scale;
  for (int k = 0; k < n; ++k) {
    const double kappa = kappa_of(material_.drag_per_area, vertex_areas_[k], h_, metric_[k]);
    kappa_.push_back(material_.damp_after ? 0 : kappa);
    kappa_after_.push_back(material_.damp_after ? kappa : 0);
    matrix.push_back({k, k, metric_[k] / (h_ * h_ * (1 - kappa_[k]))});  // m/h^2 + c/h
  }
  factor_ = factorise(n, matrix);
}

}  // namespace hemowalk::npfem
