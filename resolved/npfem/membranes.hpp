#pragma once
/// \file Membranes: all deformable cells of one type, stepped together, 16 (float) or 8 (double) side by
/// side. rigid::RigidBodies has the same members, so that a simulation treats both alike.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/array.hpp"
#include "resolved/mesh/host_fields.hpp"
#include "resolved/mesh/lanes.hpp"
#include "resolved/mesh/observables.hpp"
#include "resolved/mesh/rotation.hpp"
#include "resolved/mesh/step.hpp"
#include "resolved/npfem/cell_type.hpp"

namespace hemowalk::npfem {

using mesh::StepOptions;
using mesh::StepReport;

/// Positions are anchor (double, per cell) + offset (Real) + the offset's rounding residual (kept inside).
/// All vector fields are [batch][vertex][3][lane], see mesh::Layout.
template <class Real>
class Membranes {
 public:
  static constexpr int lanes = mesh::lanes_of<Real>;
  explicit Membranes(std::shared_ptr<const CellType> type);
  /// The same type, no cells.
  Membranes empty() const;
  ~Membranes();
  Membranes(Membranes&&) noexcept;
  Membranes& operator=(Membranes&&) noexcept;

  // --- the common face of cell groups ------------------------------------------------------------------
  int count() const;     ///< cells
  int vertices() const;  ///< per cell
  int batches() const { return (count() + lanes - 1) / lanes; }
  mesh::Layout<Real> layout() const { return {vertices()}; }
  const mesh::TriangleMesh& rest() const;
  const std::vector<double>& vertex_areas() const;  ///< rest areas A_k
  double bounding_radius() const;                   ///< of the rest shape about its centre
  double rest_volume() const;
  double h() const;  ///< solid time step

  void reserve(int cells);
  /// Adds a cell in its rest shape, turned by \p q and moved to \p centre, at rest. \returns its index.
  int add(std::int64_t id, const mesh::Vec3& centre, const mesh::Quaternion& q);
  /// Removes cell \p c; the last cell takes its index.
  void remove(int c);
  std::int64_t id(int c) const;

  View<const double> anchors() const;   ///< [batch][3][lane], absolute
  View<const Real> offsets() const;     ///< vertex - anchor
  View<const Real> velocities() const;  ///< the v that moved the vertices in the last step
  View<const Real> normals() const;     ///< unit, outward, area weighted, at the present positions
  /// v_pred = (m v^n + k a w + h F)/(m + k a), to be written by the caller before each step.
  View<Real> predicted();

  /// Moves every cell by h: solves (metric/h)(v - v_pred) = F_int(x^n + h v) - c (v - V - omega x r), x += h
  /// v, new normals. V, omega is the rigid motion with the momenta of v_pred; c = metric kappa/((1 - kappa)
  /// h) is the drag of the kappa damping (method 3). The paper damps after the solve, v <- v + kappa (V +
  /// omega x r - v), and moves by the damped v: the same drag, but with the forces taken 1/(1 - kappa) steps
  /// ahead; here they are taken where the step ends, so relaxation times do not depend on h. sum metric (v -
  /// v_pred) = 0 and sum r^n x metric (v - v_pred) = 0 hold for every cell to round-off, whatever the
  /// iterations. Threads over batches; bit-identical for any number of threads and neighbours.
  StepReport step(const StepOptions& options = {});

  mesh::Vec3 anchor(int c) const;
  mesh::Vec3 position(int c, int k) const;  ///< anchor + offset + residual
  std::vector<mesh::Vec3> positions(int c) const;
  void translate(int c, const mesh::Vec3& shift);  ///< exact re-imaging of a periodic cell
  mesh::Observables observe(int c) const;
  /// Exact state of a cell: for checkpoints and migration between ranks.
  std::size_t state_bytes() const;
  void save(int c, std::byte* out) const;
  int load(const std::byte* in);             ///< adds the saved cell; \returns its index
  void restore(int c, const std::byte* in);  ///< cell c becomes the saved one
  /// For who takes the step elsewhere and writes its outcome here.
  mesh::HostFields<Real> host_fields();

  // --- membranes only ----------------------------------------------------------------------------------
  const CellType& type() const;
  /// F_int of all cells at the present positions, laid out as predicted().
  void internal_forces(View<Real> out);
  /// Moves every cell by h predicted(), which becomes its velocity: membranes without mass.
  StepReport drift();
  void set_positions(int c, const std::vector<mesh::Vec3>& x);
  void set_velocities(int c, const std::vector<mesh::Vec3>& v);
  /// F_int at the present positions by the fast path, for output and tests.
  std::vector<mesh::Vec3> forces(int c) const;
  double volume(int c) const;
  double area(int c) const;
  double energy(int c) const;  ///< elastic, by the reference path
  /// Power that kappa and Rayleigh damping took in the last step, by the reference path.
  double damping_power(int c) const;
  /// Power that went into elastic energy in the last step, of all cells, by the fast path.
  double stored_power();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

extern template class Membranes<float>;
extern template class Membranes<double>;

}  // namespace hemowalk::npfem
