#pragma once
/// \file Blood in tubes after Pries et al. 1992 (in vitro): fits to the data of many.

#include <cmath>

namespace hemowalk::test {

/// Relative apparent viscosity at the discharge hematocrit \p Hd in a tube of \p d um (method 13).
inline double pries_viscosity(double d, double Hd) {
  const double mu45 = 220 * std::exp(-1.3 * d) + 3.2 - 2.44 * std::exp(-0.06 * std::pow(d, 0.645));
  const double grow = 1 / (1 + 1e-11 * std::pow(d, 12));
  const double C = (0.8 + std::exp(-0.075 * d)) * (-1 + grow) + grow;
  return 1 + (mu45 - 1) * (std::pow(1 - Hd, C) - 1) / (std::pow(1 - 0.45, C) - 1);
}

/// Tube over discharge hematocrit.
inline double pries_fahraeus(double d, double Hd) {
  return Hd + (1 - Hd) * (1 + 1.7 * std::exp(-0.415 * d) - 0.6 * std::exp(-0.011 * d));
}

/// Relative viscosity of blood in wide tubes at high shear rates, d to infinity in Pries et al. 1992 (their
/// mu_0.45 is 3.2 and their C -0.8).
inline double wide_tube_viscosity(double hematocrit) {
  return 1 + 2.2 * (std::pow(1 - hematocrit, -0.8) - 1) / (std::pow(0.55, -0.8) - 1);
}

}  // namespace hemowalk::test
