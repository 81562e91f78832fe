#pragma once
/// \file What happens in one node: moments and the two-relaxation-time collision with force. Written once for
/// any number type N (float, double, a Pack of them), for host and device.
///
/// Populations are handled as deviations g_i = f_i - w_i, so that the small changes of slow flow are not
/// rounded away against w_i in single precision: sum g = rho - 1, sum c g = j = rho u*.
///
/// **Forcing.** Write ' for after collision, + and - for the parts even and odd under c -> -c, Q(u) = 4.5
/// (c.u)^2 - 1.5 u^2 and B(u, v) = 9 (c.u)(c.v) - 3 u.v its polar form. Guo's scheme (relax to the
/// equilibrium of u = u* + F/(2 rho), add (1 - omega/2) times the source, each parity with its own omega)
/// becomes, in terms of u*,
///   odd:  3 w c.F, whatever omega_minus (its halves cancel), so each node gains exactly F;
///   even: omega_plus rho Q(u) + (1 - omega_plus/2) B(u, F) = omega_plus rho Q(u*) + B(v, F),
///         v = u* + (1/2 - omega_plus/8) F/rho.
/// Shan-Chen (relax to the equilibrium of u* + tau F/rho, odd part with tau_minus) is the same with
/// v = u* + tau/2 F/rho. Hence one collision for both: relax to the force-free equilibrium of u* and add
///   w [3 c.F + B(v, F)],   v = u* + shift F/rho.
/// The physical velocity is u = u* + F/(2 rho). They differ in F^2 only (method 5.2, step 5).
///
/// **Cost.** The even targets of both are one quadratic form in c.j and c.F over rho, which factorises:
///   4.5 omega_plus (c.j)^2 + 9 (c.j)(c.F) + 9 shift (c.F)^2 = (c.p)(c.r),
///   p = alpha j + (beta - delta) F,  r = alpha j + (beta + delta) F,
///   alpha^2 = 4.5 omega_plus,  beta = 9/(2 alpha),  delta^2 = beta^2 - 9 shift
/// (delta = 0 for Shan-Chen, delta^2 = 4.5/omega_plus (1 - omega_plus/2)^2 for Guo), and its isotropic part
/// is -p.r/3. So a pair of directions needs c.p, c.r and, for the odd part, c.a; weights are taken into p, a.

#include <cmath>
#include <limits>

#include "resolved/lbm/d3q19.hpp"

namespace hemowalk::lbm {

/// Constants of a collision in the precision of the populations. Vectors p and a carry the weight 1/36 of a
/// diagonal direction.
template <class Real>
struct Relaxation {
  Real omega_plus;             ///< times 1/36
  Real keep_rest;              ///< 1 - omega_plus
  Real keep_plus, keep_minus;  ///< (1 - omega)/2: what is kept of f_i +- f_opposite
  Real p_flux, p_force;        ///< p = p_flux j + p_force F
  Real r_flux, r_force;        ///< r = (r_flux j + r_force F)/rho
  Real a_flux, a_force;        ///< odd target a = a_flux j + a_force F

  /// Rates of the even and odd parts; \p shift of the velocity in the force term, see above.
  static Relaxation make(double omega_plus, double omega_minus, double shift) {
    constexpr double w = 1.0 / 36;
    const double alpha = std::sqrt(4.5 * omega_plus), beta = 4.5 / alpha;
    const double square = beta * beta - 9 * shift, delta = square > 0 ? std::sqrt(square) : 0;
    // Momentum after a collision is (2 keep_minus + 12 a_flux) times before. Rounded one by one the two miss
    // 1 by 1e-8, which adds up over steps; a_flux on a grid of epsilon/8 makes both exact. The rate moves by
    // no more than its rounding.
    const double grain = static_cast<double>(std::numeric_limits<Real>::epsilon()) / 8;
    const double a_flux = std::round(3 * w * omega_minus / grain) * grain;
    return {Real(w * omega_plus),
            Real(1 - omega_plus),
            Real((1 - omega_plus) / 2),
            Real((1 - 12 * a_flux) / 2),
            Real(w * alpha),
            Real(w * (beta - delta)),
            Real(alpha),
            Real(beta + delta),
            Real(a_flux),
            Real(3 * w)};
  }
};

/// rho - 1 and j = sum c_i f_i.
template <class N>
struct Moments {
  N density, x, y, z;
};

/// Even and odd parts of every pair: f_i + f_opposite takes the place of the first, f_i - f_opposite of the
/// second.
template <class N>
HEMO_HD HEMO_INLINE void split_parities(N (&f)[directions]) {
  unroll<9>([&](auto pair) HEMO_INLINE_LAMBDA {
    constexpr int i = 2 * decltype(pair)::value + 1;
    const N first = f[i], second = f[i + 1];
    f[i] = first + second;
    f[i + 1] = first - second;
  });
}

/// Moments of populations that went through split_parities().
template <class N>
HEMO_HD HEMO_INLINE Moments<N> moments_of_parities(const N (&f)[directions]) {
  return {f[0] + (((f[1] + f[3]) + (f[5] + f[7])) + ((f[9] + f[11]) + (f[13] + (f[15] + f[17])))),
          (f[2] + (f[8] + f[10])) + (f[12] + f[14]), (f[4] + (f[8] - f[10])) + (f[16] + f[18]),
          (f[6] + (f[12] - f[14])) + (f[16] - f[18])};
}

/// Collision in place of \p f (deviations) with the force (fx, fy, fz) on the node.
template <class N, class Real>
HEMO_HD HEMO_INLINE void collide(N (&f)[directions], const N& fx, const N& fy, const N& fz,
                                 const Relaxation<Real>& rate) {
  split_parities(f);
  const Moments<N> m = moments_of_parities(f);
  const N inverse_density = Real(1) / (Real(1) + m.density);
  const N px = rate.p_flux * m.x + rate.p_force * fx, py = rate.p_flux * m.y + rate.p_force * fy,
          pz = rate.p_flux * m.z + rate.p_force * fz;
  const N rx = (rate.r_flux * m.x + rate.r_force * fx) * inverse_density,
          ry = (rate.r_flux * m.y + rate.r_force * fy) * inverse_density,
          rz = (rate.r_flux * m.z + rate.r_force * fz) * inverse_density;
  const N ax = rate.a_flux * m.x + rate.a_force * fx, ay = rate.a_flux * m.y + rate.a_force * fy,
          az = rate.a_flux * m.z + rate.a_force * fz;
  const N isotropic = rate.omega_plus * m.density - Real(1.0 / 3) * (px * rx + py * ry + pz * rz);
  const N isotropic2 = isotropic + isotropic;
  f[0] = rate.keep_rest * f[0] + Real(12) * isotropic;  // weight 1/3 = 12/36
  unroll<9>([&](auto pair) HEMO_INLINE_LAMBDA {
    constexpr int i = 2 * decltype(pair)::value + 1;
    constexpr bool axis = i < 7;  // weight 1/18 = 2/36
    N even = along<i>(px, py, pz), odd = along<i>(ax, ay, az);
    if constexpr (axis) {
      even = even + even;
      odd = odd + odd;
    }
    even = rate.keep_plus * f[i] + (even * along<i>(rx, ry, rz) + (axis ? isotropic2 : isotropic));
    odd = rate.keep_minus * f[i + 1] + odd;
    f[i] = even + odd;
    f[i + 1] = even - odd;
  });
}

/// Equilibrium deviation of direction \p i at density \p rho and velocity \p u (set-up and tests).
inline double equilibrium(int i, double rho, const double (&u)[3]) {
  const double cu = c[i][0] * u[0] + c[i][1] * u[1] + c[i][2] * u[2];
  const double uu = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
  return weight(i) * ((rho - 1) + rho * (3 * cu + 4.5 * cu * cu - 1.5 * uu));
}

}  // namespace hemowalk::lbm
