#pragma once
/// \file Elastic and damping parameters of a membrane, in the caller's coherent units.

namespace hemowalk::npfem {

/// In-plane law. paper: Skalak shear with strain hardening plus local area (method 3, items 1 and 2).
enum class Law { paper, neo_hookean, skalak };
/// paper: edge-based, blind to the sign of curvature (method 3, item 3). helfrich: signed mean curvature.
enum class Bending { none, paper, helfrich };
/// gradient: denominator sum |g_j|^2 of the rest shape (a true gradient). paper: of the current shape, as
/// printed.
enum class VolumeForce { gradient, paper };

struct Material {
  Law law = Law::paper;
  double B = 5, C = 5000, D = 35;  ///< force/length, law paper
  double Gs = 5;                   ///< force/length, laws neo_hookean and skalak
  double skalak_C = 1;             ///< dimensionless, law skalak: W = Gs/4 (I1^2 + 2 I1 - 2 I2 + C I2^2)
  Bending bending = Bending::paper;
  double bending_modulus = 1;  ///< force length
  double reference_curvature =
      0;  ///< 1/length, helfrich: H0 of E = 2 k_b int (H - H0)^2 dA, H = 1/R for a sphere
  VolumeForce volume_force = VolumeForce::gradient;
  double volume_modulus = 250;  ///< k_v, force/length
  double rayleigh_beta = 0;     ///< time; stiffness-proportional damping beta Lap v
  double drag_per_area = 0;     ///< c_A, mass/(time area): kappa damping as a drag on the non-rigid velocity

  /// The paper's order: solve without the drag, damp the velocity, move by it (relaxation times depend on h).
  bool damp_after = false;

  /// Small-strain shear modulus of the law: B/4 for the paper's law, else Gs.
  double shear_modulus() const { return law == Law::paper ? B / 4 : Gs; }
  /// Small-strain area dilation modulus.
  double area_modulus() const;
  /// Stiffness of the constant stand-in for the in-plane Hessian (method 3): 5.5 B + C (27.5 + 5000 pN/um)
  /// for the paper's law, else the largest eigenvalue of the rest tangent in the stretches: 6 Gs
  /// (neo-Hookean), 2 Gs (1 + 2 C) (Skalak). The iteration converges while the true tangent stays below twice
  /// this plus the mass.
  double standin() const;
};

/// Drag per membrane area of the paper's kappa: c_A = kappa/(1-kappa) m_ref/(h_ref A_ref), defined at
/// h_ref = 0.25 us, m_ref = 400.3 fg, A_ref = 0.511 um^2 (method 3). \returns fg/(us um^2); 28 200 at kappa
/// 0.9.
double drag_per_area_of(double kappa);
/// kappa of one vertex at step \p h: kappa/(1-kappa) = c_A A_k h/m_k, \p mass the metric the damping is
/// applied in.
double kappa_of(double drag_per_area, double vertex_area, double h, double mass);

}  // namespace hemowalk::npfem
