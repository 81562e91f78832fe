#pragma once
/// \file Local area conservation by projection (method 3, item 2).

#include "resolved/npfem/terms/stretch.hpp"

namespace hemowalk::npfem {

/// w = C/2 |F - F*|^2, F* the nearest matrix with s1* s2* = 1.
///
/// With the multiplier l of that constraint s1 - s1* = l s2*, s2 - s2* = l s1*, hence
/// s1* + s2* = t/(1 + l), s1* - s2* = (s1 - s2)/(1 - l) and l solves phi(l) = J (1+l)^2 - (1-l^2)^2 - l t^2 =
/// 0. Newton on this one number replaces Newton on the singular values; nothing cancels as l -> 0.
template <class S>
struct LocalArea {
  S C;
  /// Enough for round-off at area strains within [-0.3, 0.6]; every lane does the same number.
  static constexpr int newton_steps = sizeof(S) == 4 ? 2 : 4;

  template <class T>
  HEMO_HD static T multiplier(const Stretch<T>& s) {
    using std::max;
    using std::min;
    const T bound(0.9f), t2 = s.t * s.t;  // beyond |l| = 1 the nearest point is no longer unique
    const T excess = s.J - 1;
    T l = excess * s.I1 / (s.I1 * s.I1 - (s.J + 2) * excess);  // Halley's first step: right to second order
    l = max(min(l, bound), -bound);
    for (int i = 0; i < newton_steps; ++i) {
      const T plus = 1 + l, both = 1 - l * l;
      // J (1+l)^2 - (1-l^2)^2 - l t^2, arranged so that the small difference J - 1 is formed first
      const T phi = excess * (plus * plus) + l * (2 + 3 * l - l * l * l - t2);
      const T slope = 2 * (s.J * plus) + 4 * (l * both) - t2;
      l = max(min(l - phi / slope, bound), -bound);
    }
    return l;
  }

  template <class T>
  HEMO_HD StretchGradient<T> gradient(const Stretch<T>& s) const {
    const T l = multiplier(s);
    const T common = C * l / (1 - l * l);
    return {T(0), -(common * l * s.t), common * (1 + l)};
  }
};

/// The same energy from the singular values, by Newton on log s1*; for the reference path.
inline double local_area_energy(double C, double s1, double s2) {
  double u = 0.5 * std::log(s1 / s2);
  for (int i = 0; i < 100; ++i) {
    const double a = std::exp(u), b = 1 / a;
    const double curvature = (2 * a - s1) * a + (2 * b - s2) * b;  // negative far from the minimum
    const double change = std::clamp(((s2 - b) * b - (s1 - a) * a) / std::max(curvature, 0.1), -0.5, 0.5);
    u -= change;
    if (std::abs(change) < 1e-15) break;
  }
  const double a = std::exp(u), b = 1 / a;
  return C / 2 * ((s1 - a) * (s1 - a) + (s2 - b) * (s2 - b));
}

}  // namespace hemowalk::npfem
