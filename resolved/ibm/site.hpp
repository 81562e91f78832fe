#pragma once
/// \file Where a marker is on the lattice: the node left of it and the fraction to it.

#include <cmath>

#include "core/portability.hpp"
#include "resolved/ibm/kernel.hpp"

namespace hemowalk::ibm {

/// Node left of a coordinate and the fraction to it; nodes sit at i + 1/2.
template <class Real>
struct Coordinate {
  int node;
  Real fraction;
};
/// The coordinate is \p origin + \p local.
template <class Real>
HEMO_HD HEMO_INLINE Coordinate<Real> split(int origin, Real local) {
  using std::floor;
  const Real shifted = local - Real(0.5), whole = floor(shifted);
  return {origin + static_cast<int>(whole), shifted - whole};
}

/// The four weights of \p kernel at fraction \p f.
template <class T>
HEMO_HD HEMO_INLINE Weights<T> weights(Kernel kernel, const T& f) {
  return kernel == Kernel::phi4 ? phi4(f) : kernel == Kernel::phi2 ? phi2(f) : phi3(f);
}

}  // namespace hemowalk::ibm
