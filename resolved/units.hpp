#pragma once
/// \file The one crossing between physical quantities (SI) and lattice units (dx = dt = rho_0 = 1).
///
/// `acceleration` s raises every rate at constant capillary number: speeds, forces per area and moduli are s
/// times larger on the lattice, one lattice step stands for s times as much physical time. Geometry, masses
/// and drags per area are untouched. Everything that leaves the solver comes back through this file and is
/// physical again.

#include "core/data/scene.hpp"

namespace hemowalk::resolved {

struct LatticeUnits {
  double dx = 1, dt = 1;  ///< m, s (time of one fluid step at acceleration 1)
  double density = 1;     ///< kg/m3
  double s = 1;           ///< acceleration

  explicit LatticeUnits(const data::Scene& scene)
      : dx(scene.fluid.dx),
        dt(scene.fluid.time_step()),
        density(scene.fluid.density),
        s(scene.acceleration) {}

  // To the lattice.
  double length(double m) const { return m / dx; }
  double area(double m2) const { return m2 / (dx * dx); }
  double volume(double m3) const { return m3 / (dx * dx * dx); }
  double mass(double kg) const { return kg / (density * dx * dx * dx); }
  double velocity(double m_per_s) const { return m_per_s * s * dt / dx; }
  double rate(double per_s) const { return per_s * s * dt; }
  double force(double newton) const { return newton * s * dt * dt / (density * dx * dx * dx * dx); }
  /// Body force per volume (pressure gradient), N/m3.
  double force_density(double n_per_m3) const { return n_per_m3 * s * dt * dt / (density * dx); }
  /// Membrane modulus, N/m.
  double modulus(double n_per_m) const { return n_per_m * s * dt * dt / (density * dx * dx * dx); }
  /// Bending modulus, N m.
  double bending(double n_m) const { return n_m * s * dt * dt / (density * dx * dx * dx * dx * dx); }
  /// Contact stiffness per area, N/m3.
  double stiffness_density(double n_per_m3) const { return n_per_m3 * s * dt * dt / (density * dx); }
  /// Drag per membrane area, kg/(m2 s): not scaled by s (kappa_damping keeps its physical meaning per step).
  double drag_per_area(double kg_per_m2_s) const { return kg_per_m2_s * dt / (density * dx); }
  /// Rayleigh beta, s: divided by s like every time of the user.
  double time(double seconds) const { return seconds / (s * dt); }
  /// Curvature, 1/m.
  double curvature(double per_m) const { return per_m * dx; }
  /// Fluid steps that cover a physical time, rounded to the nearest whole step.
  double steps(double seconds) const { return seconds / (s * dt); }

  // Back to physical values.
  double to_length(double v) const { return v * dx; }
  double to_area(double v) const { return v * dx * dx; }
  double to_volume(double v) const { return v * dx * dx * dx; }
  double to_velocity(double v) const { return v * dx / (dt * s); }
  double to_rate(double v) const { return v / (dt * s); }
  double to_time(double steps) const { return steps * dt * s; }
  double to_stress(double v) const { return v * density * dx * dx / (dt * dt) / s; }
  double to_power(double v) const { return v * density * dx * dx * dx * dx * dx / (dt * dt * dt) / (s * s); }
  double to_force(double v) const { return v * density * dx * dx * dx * dx / (dt * dt) / s; }
};

}  // namespace hemowalk::resolved
