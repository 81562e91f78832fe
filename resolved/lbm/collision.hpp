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

#include "resolved/lbm/d3q19.hpp"

namespace hemowalk::lbm {

/// Rates of a collision in the precision of the populations.
template <class Real>
struct Relaxation {
  Real omega_plus, omega_minus;  ///< rates of even and odd parts
  Real keep_plus, keep_minus;    ///< (1 - omega)/2: what is kept of f_i +- f_opposite
  Real shift;                    ///< of the velocity in the force term, see above

  static Relaxation make(double omega_plus, double omega_minus, double shift) {
    return {Real(omega_plus), Real(omega_minus), Real((1 - omega_plus) / 2), Real((1 - omega_minus) / 2),
            Real(shift)};
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
  const N ux = m.x * inverse_density, uy = m.y * inverse_density, uz = m.z * inverse_density;
  const N shift = rate.shift * inverse_density;
  const N vx = ux + shift * fx, vy = uy + shift * fy, vz = uz + shift * fz;
  // The even target is w (isotropic + (c.u)(c.h) + (c.F)(c.s)), the odd one w (c.a).
  const N isotropic = rate.omega_plus * (m.density - Real(1.5) * (ux * m.x + uy * m.y + uz * m.z)) -
                      Real(3) * (vx * fx + vy * fy + vz * fz);
  const Real quadratic = Real(4.5) * rate.omega_plus;
  const N hx = quadratic * m.x + Real(9) * fx, hy = quadratic * m.y + Real(9) * fy,
          hz = quadratic * m.z + Real(9) * fz;
  const N nine_shift = Real(9) * shift;
  const N sx = nine_shift * fx, sy = nine_shift * fy, sz = nine_shift * fz;
  const N ax = Real(3) * (rate.omega_minus * m.x + fx), ay = Real(3) * (rate.omega_minus * m.y + fy),
          az = Real(3) * (rate.omega_minus * m.z + fz);
  f[0] = Real(2) * rate.keep_plus * f[0] + Real(weight(0)) * isotropic;
  unroll<9>([&](auto pair) HEMO_INLINE_LAMBDA {
    constexpr int i = 2 * decltype(pair)::value + 1;
    constexpr Real w = Real(weight(i));
    const N target = (isotropic + along<i>(ux, uy, uz) * along<i>(hx, hy, hz)) +
                     along<i>(fx, fy, fz) * along<i>(sx, sy, sz);
    const N even = rate.keep_plus * f[i] + w * target;
    const N odd = rate.keep_minus * f[i + 1] + w * along<i>(ax, ay, az);
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
