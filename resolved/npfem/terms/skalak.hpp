#pragma once
/// \file Skalak's law for biological membranes.

#include "resolved/npfem/terms/stretch.hpp"

namespace hemowalk::npfem {

/// w = Gs/4 (i1^2 + 2 i1 - 2 i2 + C i2^2) with i1 = s1^2 + s2^2 - 2, i2 = (s1 s2)^2 - 1; area modulus Gs (1 +
/// 2 C).
template <class S>
struct Skalak {
  S Gs, C;

  template <class T>
  HEMO_HD StretchGradient<T> gradient(const Stretch<T>& s) const {
    // The derivative with respect to i2 is written with i2 = (J - 1)(J + 1): nothing cancels near rest.
    const T i2 = (s.J - 1) * (s.J + 1);
    return {(Gs * S(0.5f)) * (s.I1 - 1), T(0), Gs * (s.J * (C * i2 - 1))};
  }
};

inline double skalak_energy(double Gs, double C, double s1, double s2) {
  const double i1 = s1 * s1 + s2 * s2 - 2, i2 = s1 * s1 * s2 * s2 - 1;
  return Gs / 4 * (i1 * i1 + 2 * i1 - 2 * i2 + C * i2 * i2);
}

}  // namespace hemowalk::npfem
