#pragma once
/// \file The energy budget of a coupling step (method 13: "it catches what momentum does not").

#include <limits>

namespace hemowalk::resolved {

/// Powers over one coupling step, lattice units (work per fluid step), sums over the whole system. What is
/// fed in equals what is lost and stored up to `residual()`, which holds what no term names: the error in
/// time of the solid (implicit Euler, unconverged iteration, lag of the retraction's couples: order h), and
/// the cubic terms of the fluid (lbm::EnergyFlows).
struct EnergyBudget {
  // Fed in.
  double walls = 0;       ///< by moving walls: minus velocity times all they receive, kernels' share included
  double body_force = 0;  ///< of the pressure gradient
  double loads = 0;       ///< of point loads
  // Lost.
  double viscous = 0;     ///< 2 mu S:S of the fluid, inside cells too
  double damping = 0;     ///< kappa damping and Rayleigh damping of the membranes
  double slip = 0;        ///< sum J.(v - I[u]): the membranes' slip. Numerical.
  double stressless = 0;  ///< moments of the lattice beyond the stress. Numerical.
  // Stored, per step.
  double membranes = 0;  ///< elastic energy
  double contact = 0;    ///< work against contact, which has a potential
  double inertia = 0;    ///< fluid and cells

  double fed() const { return walls + body_force + loads; }
  double spent() const { return viscous + damping + slip + stressless + membranes + contact + inertia; }
  /// (fed - spent)/fed; not a number where nothing is fed.
  double residual() const {
    return fed() != 0 ? (fed() - spent()) / fed() : std::numeric_limits<double>::quiet_NaN();
  }
};

}  // namespace hemowalk::resolved
