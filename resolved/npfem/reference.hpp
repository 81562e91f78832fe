#pragma once
/// \file The solid in plain double arithmetic, one cell at a time: the definition of right for the fast path.

#include <functional>
#include <vector>

#include "resolved/npfem/cell_type.hpp"

namespace hemowalk::npfem {

/// Elastic energy by term.
struct Energy {
  double stretch = 0, area = 0, bending = 0, volume = 0;
  double total() const { return stretch + area + bending + volume; }
};

/// Energy of a cell with vertices \p x. Written from the printed formulas with singular values, angles and
/// distances, independently of the force code, so that finite differences of it test the forces.
/// The volume term printed in the paper has no energy; VolumeForce::gradient is meant.
Energy energy(const CellType& type, const std::vector<mesh::Vec3>& x);

/// F_int at \p x: the same term functions as the fast path, with T = double.
std::vector<mesh::Vec3> forces(const CellType& type, const std::vector<mesh::Vec3>& x);

/// Power lost to kappa damping, sum c_k |v - v_rigid|^2 with c_k = c_A A_k and the rigid motion of the step's
/// metric, and to Rayleigh damping, beta v.Lap v; at \p x with velocities \p v.
double damping_power(const CellType& type, const std::vector<mesh::Vec3>& x,
                     const std::vector<mesh::Vec3>& v);

/// State of one cell.
struct State {
  std::vector<mesh::Vec3> x, v;
};

struct SolveReport {
  int iterations = 0;
  double residual = 0;  ///< |F - metric (v - v_pred)/h|, relative to its largest force
};

/// Implicit step to convergence: (metric/h)(v - v_pred) = F_int(x + h v) by L-BFGS on the incremental
/// potential with H0 = N^{-1} and backtracking, until the relative residual is below \p tolerance. Then kappa
/// damping and the momentum projection of the fast path (both only if \p project), x += h v.
SolveReport step_implicit(const CellType& type, State& s, const std::vector<mesh::Vec3>& v_pred,
                          double tolerance = 1e-10, int max_iterations = 1000, bool project = true);

/// y = N^{-1} b with the type's factorisation.
std::vector<mesh::Vec3> apply_inverse(const CellType& type, std::vector<mesh::Vec3> b);

/// External force on every vertex at (t, x, v).
using ExternalForce = std::function<void(double t, const std::vector<mesh::Vec3>& x,
                                         const std::vector<mesh::Vec3>& v, std::vector<mesh::Vec3>& force)>;

/// Classical Runge-Kutta of metric dv/dt = F_int(x) + F_ext: the explicit high-accuracy reference.
void step_rk4(const CellType& type, State& s, double t, double dt, const ExternalForce& external);

}  // namespace hemowalk::npfem
