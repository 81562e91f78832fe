#pragma once
/// \file Neo-Hookean membrane (incompressible sheet): surface shear modulus Gs.

#include "resolved/npfem/terms/stretch.hpp"

namespace hemowalk::npfem {

/// w = Gs/2 (s1^2 + s2^2 + 1/(s1 s2)^2 - 3); Young modulus Es = 3 Gs, area modulus 3 Gs.
template <class S>
struct NeoHookean {
  S Gs;

  template <class T>
  HEMO_HD StretchGradient<T> gradient(const Stretch<T>& s) const {
    return {T(Gs * S(0.5f)), T(0), -Gs / (s.J * s.J * s.J)};
  }
};

inline double neo_hookean_energy(double Gs, double s1, double s2) {
  return Gs / 2 * (s1 * s1 + s2 * s2 + 1 / (s1 * s1 * s2 * s2) - 3);
}

}  // namespace hemowalk::npfem
