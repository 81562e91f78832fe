#pragma once
/// \file The work on one batch: as many cells as a register has lanes, each in its own lane, no lane looking
/// at another. Fields are [vertex][component][lane]; the tables are shared by all batches of a type.

#include <vector>

#include "core/array.hpp"
#include "core/simd.hpp"
#include "resolved/mesh/lanes.hpp"
#include "resolved/mesh/rigid_motion.hpp"
#include "resolved/mesh/step.hpp"
#include "resolved/npfem/tables.hpp"
#include "resolved/npfem/terms/helfrich.hpp"

namespace hemowalk::npfem {

/// Scratch fields of one thread; sized once.
template <class Real>
struct Scratch {
  explicit Scratch(int vertices)
      : moved(3 * size(vertices)),
        increment(3 * size(vertices)),
        force(3 * size(vertices)),
        gradient(3 * size(vertices)),
        response(3 * size(vertices)),
        curvature(size(vertices)),
        area(size(vertices)) {}
  static std::size_t size(int vertices) { return static_cast<std::size_t>(vertices) * mesh::lanes_of<Real>; }
  Array<Real> moved, increment, force, gradient, response, curvature, area;
};

/// Pointers to the fields of one batch.
template <class Real>
struct BatchFields {
  double* anchor;           ///< [3][lane]
  Real *offset, *residual;  ///< position = anchor + offset + residual
  Real* velocity;           ///< that moved the vertices
  Real* normal;
  const Real* predicted;
};

template <class Real>
class BatchKernel {
 public:
  static constexpr int W = mesh::lanes_of<Real>;
  using P = Pack<Real, W>;
  using V = Vector<P>;

  BatchKernel(const Tables<Real>& tables, Scratch<Real>& scratch) : t_(tables), s_(scratch) {}

  /// What one batch reports, per lane.
  struct Report {
    P increment, residual;  ///< squares of the ratios of mesh::StepReport
    P probe;                ///< not finite where any vertex is not
  };
  Report step(const BatchFields<Real>& b, const mesh::StepOptions& options);
  /// A step of a body without mass or forces: v = v_pred, x += h v.
  Report drift(const BatchFields<Real>& b);
  /// F_int at the present positions, into scratch.force.
  void forces(const BatchFields<Real>& b);
  /// -F_int.v per lane with F_int at x - h v/2, x the positions that the last step of h v led to: the rate at
  /// which that step stored elastic energy, up to h^2.
  P stored_power(const BatchFields<Real>& b);
  void update_normals(const BatchFields<Real>& b);

 private:
  static V load3(const Real* field, int k) {
    const Real* p = field + static_cast<std::size_t>(k) * 3 * W;
    return {load<Real, W>(p), load<Real, W>(p + W), load<Real, W>(p + 2 * W)};
  }
  static void store3(const V& v, Real* field, int k) {
    Real* p = field + static_cast<std::size_t>(k) * 3 * W;
    store<Real, W>(v.x, p), store<Real, W>(v.y, p + W), store<Real, W>(v.z, p + 2 * W);
  }
  static void add3(const V& v, Real* field, int k) { store3(load3(field, k) + v, field, k); }

  /// x_j - x_i, each position being offset + moved: the small parts are subtracted among themselves.
  V between(const Real* offset, int i, int j) const {
    return (load3(offset, j) - load3(offset, i)) + (load3(s_.moved.data(), j) - load3(s_.moved.data(), i));
  }
  /// All but the volume force into scratch.force. \returns the factor p of the volume force -p sum of area
  /// normals.
  P membrane_forces(const Real* offset);
  template <class LawType>
  P stretch_pass(const Real* offset, const LawType& law);
  void edge_pass(const Real* offset);
  void helfrich_pass(const Real* offset);
  /// The rigid motion that carries the momenta of v_pred, which no internal force or damping can change.
  struct Frame {
    mesh::Body<P> body;
    mesh::RigidMotion<P> motion;
    V at(const V& r) const { return motion.velocity + cross(motion.spin, r - body.centre()); }
  };
  Frame find_frame(const BatchFields<Real>& b);
  /// What the velocity of a vertex tends to without forces, v', and how stiffly, m/(h^2 (1 - kappa)).
  struct Aim {
    V velocity;
    Real rate;
  };
  Aim aim(const BatchFields<Real>& b, const Frame& frame, bool damping, int k) const;
  /// F_int - m/(h^2 (1 - kappa)) (d - h v') into scratch.force, v' = v_pred damped towards the rigid motion.
  /// \returns sum of squares of the inertial part, for scale.
  P unbalance(const BatchFields<Real>& b, const Frame& frame, bool damping);
  void add_rayleigh();
  /// The increment of x' = v'(x), v' the velocity at which inertia, damping and the forces at x balance, over
  /// h.
  void runge_kutta(const BatchFields<Real>& b, const Frame& frame, bool damping);
  void solve(Real* x);
  /// The same for N + (k_v/sum |g|^2) g g^T (Woodbury), where the volume term is too stiff for N alone.
  void solve_with_volume();
  /// d += correction; \returns |correction|^2/|d|^2.
  P correct(const BatchFields<Real>& b);
  void damp(const BatchFields<Real>& b, const Frame& frame);
  void project(const BatchFields<Real>& b, const Frame& frame);
  void cap(const BatchFields<Real>& b, Real limit);
  P move(const BatchFields<Real>& b);

  const Tables<Real>& t_;
  Scratch<Real>& s_;
};

}  // namespace hemowalk::npfem
