#pragma once
/// \file The paper's Skalak-like shear law with strain hardening (method 3, item 1).

#include "resolved/npfem/terms/stretch.hpp"

namespace hemowalk::npfem {

/// w = 1/2 sum_k [ D/4 (s_k - 1)^4 + B/8 s_k^4 - B/4 s_k^2 ]; small-strain shear modulus B/4.
template <class S>
struct SkalakHardening {
  S B, D;

  template <class T>
  HEMO_HD StretchGradient<T> gradient(const Stretch<T>& s) const {
    const T trace = s.t - 2;      // sum of s_k - 1
    const T det = s.J - s.t + 1;  // their product
    const T square = trace * trace - 2 * det;
    // sum (s-1)^4 = square^2 - 2 det^2
    const S d8 = D * S(0.125f);
    const T w_t = d8 * (4 * (square * (trace + 1) + det));
    const T w_J = d8 * (-4 * (square + det));
    // sum s^4 = I1^2 - 2 J^2, sum s^2 = I1
    return {(B * S(0.125f)) * (s.I1 - 1), w_t, w_J - (B * S(0.25f)) * s.J};
  }
};

/// The same energy written with the singular values, for the reference path.
inline double skalak_hardening_energy(double B, double D, double s1, double s2) {
  const auto one = [&](double s) {
    const double e = s - 1;
    return D / 4 * e * e * e * e + B / 8 * s * s * s * s - B / 4 * s * s;
  };
  return 0.5 * (one(s1) + one(s2) - 2 * one(1));  // zero at rest
}

}  // namespace hemowalk::npfem
