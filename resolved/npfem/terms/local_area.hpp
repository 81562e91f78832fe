#pragma once
/// \file Local area conservation by projection (method 3, item 2).

#include "resolved/npfem/terms/stretch.hpp"

namespace hemowalk::npfem {

/// w = C/2 |F - F*|^2, F* the nearest matrix with s1* s2* = 1.
///
/// With the multiplier l of that constraint s1 - s1* = l s2*, s2 - s2* = l s1*, hence
/// s1* + s2* = t/(1 + l), s1* - s2* = (s1 - s2)/(1 - l) and l solves phi(l) = J (1+l)^2 - (1-l^2)^2 - l t^2 = 0.
/// Newton on this one number replaces Newton on the singular values; nothing cancels as l -> 0.
template <class S>
struct LocalArea {
  S C;
  /// Enough for round-off at area strains within [-0.5, 1.5]; every lane does the same number.
  static constexpr int newton_steps = sizeof(S) == 4 ? 3 : 5;

  template <class T>
  HEMO_HD static T multiplier(const Stretch<T>& s) {
    using std::max;
    using std::min;
    const T bound(0.9f), t2 = s.t * s.t;  // beyond |l| = 1 the nearest point is no longer unique
    T l = max(min((s.J - 1) / s.I1, bound), -bound);
    for (int i = 0; i < newton_steps; ++i) {
      const T plus = 1 + l, both = 1 - l * l;
      // J (1+l)^2 - (1-l^2)^2 - l t^2, arranged so that the small difference J - 1 is formed first
      const T phi = (s.J - 1) * (plus * plus) + l * (2 + 3 * l - l * l * l - t2);
      const T slope = 2 * (s.J * plus) + 4 * (l * both) - t2;
      l = max(min(l - phi / slope, bound), -bound);
    }
    return l;
  }

  template <class T>
  HEMO_HD StretchGradient<T> gradient(const Stretch<T>& s) const {
    const T l = multiplier(s);
    const T common = C * l / (1 - l * l);
    return from_trace<T>(s, -(common * l * s.t), common * (1 + l));
  }
};

/// The same energy from the singular values, by bisection on log s1*; for the reference path.
inline double local_area_energy(double C, double s1, double s2) {
  // d/du of (s1 - e^u)^2 + (s2 - e^-u)^2 is increasing around its minimum for stretches of interest
  double low = std::log(s1) - std::log(s1 * s2) - 1, high = std::log(s1) + 1;
  const auto slope = [&](double u) {
    return -(s1 - std::exp(u)) * std::exp(u) + (s2 - std::exp(-u)) * std::exp(-u);
  };
  for (int i = 0; i < 200; ++i) {
    const double mid = (low + high) / 2;
    (slope(mid) > 0 ? high : low) = mid;
  }
  const double a = std::exp((low + high) / 2), b = 1 / a;
  return C / 2 * ((s1 - a) * (s1 - a) + (s2 - b) * (s2 - b));
}

}  // namespace hemowalk::npfem
