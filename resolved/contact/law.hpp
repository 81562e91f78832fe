#pragma once
/// \file The contact potential per vertex. Bodies for host, device and SIMD packs.

#include "core/portability.hpp"

namespace hemowalk::contact {

/// E(g) = s (rc - g)^3/(3 rc) for g < rc, else 0, with s = stiffness times area: twice continuously
/// differentiable where it starts, and still growing inside the other body.
template <class T>
struct Potential {
  T range;  ///< rc
  T scale;  ///< s

  /// -dE/dg, towards larger gaps.
  HEMO_HD T force(const T& gap) const {
    const T depth = range - gap;
    return depth > T(0) ? scale * depth * depth / range : T(0);
  }
  HEMO_HD T energy(const T& gap) const {
    const T depth = range - gap;
    return depth > T(0) ? scale * depth * depth * depth / (T(3) * range) : T(0);
  }
};

}  // namespace hemowalk::contact
