#pragma once
/// \file Volume conservation (method 3, item 4).

#include "resolved/npfem/terms/stretch.hpp"

namespace hemowalk::npfem {

/// E = k_v/2 (V - V0)^2/sum_j |g_j|^2 with g_i = dV/dx_i. With the *rest* value of the sum this is an energy;
/// with the present one (as printed in the paper) the force is no gradient.
/// \returns the pressure-like factor p of the forces f_i = -p g_i.
template <class S, class T>
HEMO_HD HEMO_INLINE T volume_factor(const S& modulus, const S& rest_volume, const T& volume,
                                    const T& gradient_square) {
  return modulus * (volume - rest_volume) / gradient_square;
}

/// dV/dx of each corner of a triangle is a sixth of its area normal e1 x e2 (closed surface);
/// its share of the volume is x0 . (e1 x e2)/6.
template <class T>
HEMO_HD HEMO_INLINE T volume_share(const Vector<T>& x0, const Vector<T>& area_normal) {
  return dot(x0, area_normal);
}

}  // namespace hemowalk::npfem
