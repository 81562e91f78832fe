#pragma once
/// \file The coupling's one formula: the fluid velocity w that a marker is held to (method 5.2, step 2).

#include "core/portability.hpp"

namespace hemowalk::resolved {

/// A smeared sheet reads its own kick only in part: phi4 returns 3/16 of J/(rho A dx) where a no-slip marker
/// needs all of it. What the last step's kick should have added, c = I[F_prev/(2 rho)] - J_prev/a, is put
/// back, theta_n of it along the normal and theta_t across: w = I[u*] + theta_t c + (theta_n - theta_t) n
/// (n.c). theta < 1 keeps marker modes that the kernel cannot see from growing.
template <class T>
struct SlipCorrection {
  T theta_n, theta_t;

  /// \p u = I[u*], \p f = I[F_prev/2], \p J the marker's last impulse, \p inverse_a = 1/a, \p n its unit
  /// normal; three components each. Writes \p w.
  HEMO_HD void operator()(const T u[3], const T f[3], const T J[3], T inverse_a, const T n[3], T w[3]) const {
    T c[3];
    for (int d = 0; d < 3; ++d) c[d] = f[d] - J[d] * inverse_a;
    const T along = (theta_n - theta_t) * (c[0] * n[0] + c[1] * n[1] + c[2] * n[2]);
    for (int d = 0; d < 3; ++d) w[d] = u[d] + theta_t * c[d] + along * n[d];
  }

  /// The same for theta_n = theta_t when \p u already holds I[u* + theta F_prev/2]: one interpolation less.
  HEMO_HD void combined(const T u[3], const T J[3], T inverse_a, T w[3]) const {
    for (int d = 0; d < 3; ++d) w[d] = u[d] - theta_n * J[d] * inverse_a;
  }
};

}  // namespace hemowalk::resolved
