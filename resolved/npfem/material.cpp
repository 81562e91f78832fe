#include "resolved/npfem/material.hpp"

namespace hemowalk::npfem {

double Material::area_modulus() const {
  switch (law) {
    case Law::paper:
      return C / 2 + B / 4;  // w = C/2 |F - F*|^2 + .. = (C/4 + B/8) (dA/A)^2 at small strain
    case Law::neo_hookean:
      return 3 * Gs;
    case Law::skalak:
      return Gs * (1 + 2 * skalak_C);
  }
  return 0;
}

double Material::standin() const {
  switch (law) {
    case Law::paper:
      return 5.5 * B + C;
    case Law::neo_hookean:
      return 6 * Gs;
    case Law::skalak:
      return 2 * Gs * (1 + 2 * skalak_C);
  }
  return 0;
}

double drag_per_area_of(double kappa) {
  constexpr double h_ref = 0.25, m_ref = 400.3, area_ref = 0.511;  // us, fg, um^2
  return kappa / (1 - kappa) * m_ref / (h_ref * area_ref);
}

double kappa_of(double drag_per_area, double vertex_area, double h, double mass) {
  const double ratio = drag_per_area * vertex_area * h / mass;
  return ratio / (1 + ratio);
}

}  // namespace hemowalk::npfem
