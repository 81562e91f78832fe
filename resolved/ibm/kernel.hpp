#pragma once
/// \file Discrete delta functions of the immersed boundary method, one dimension, as four weights.
/// Host, device and SIMD packs share these bodies (T = float, double or a Pack). Constants are written as
/// floats that are exact in binary: a pack accepts those for every T.

#include <cmath>

#include "core/portability.hpp"

namespace hemowalk::ibm {

/// phi2: hat function. phi3: Roma, Peskin & Berger (1999). phi4: Peskin (2002), Acta Numerica 11, eq. 6.27.
enum class Kernel { phi2, phi3, phi4 };

/// Weights of the nodes at -1, 0, 1, 2 from the node left of a marker at fraction f in [0, 1).
/// They sum to one and reproduce linear functions; for phi4 the sum of squares is 3/8 at any f.
template <class T>
struct Weights {
  T w0, w1, w2, w3;
};

template <class T>
HEMO_HD inline Weights<T> phi4(const T& f) {
  using std::sqrt;
  const T root = sqrt(T(1) + T(4) * f * (T(1) - f));
  const T left = T(3) - T(2) * f, right = T(1) + T(2) * f;
  return {T(0.125f) * (left - root), T(0.125f) * (left + root), T(0.125f) * (right + root),
          T(0.125f) * (right - root)};
}

template <class T>
HEMO_HD inline Weights<T> phi2(const T& f) {
  return {T(0) * f, T(1) - f, f, T(0) * f};
}

/// Three-point function: phi(r) = (1 + sqrt(1 - 3 r^2))/3 for |r| <= 1/2,
/// (5 - 3|r| - sqrt(1 - 3 (1 - |r|)^2))/6 for 1/2 <= |r| <= 3/2.
template <class T>
HEMO_HD inline T phi3_near(const T& r) {
  using std::sqrt;
  return (T(1) + sqrt(T(1) - T(3) * r * r)) / T(3);
}
template <class T>
HEMO_HD inline Weights<T> phi3(const T& f) {
  // Scalar only: the nearest node changes at f = 1/2. The outer weights follow from zeroth and first moment.
  const bool left = f < T(0.5);
  const T r = left ? f : f - T(1);  // marker relative to its nearest node
  const T centre = phi3_near(r);
  const T upper = (T(1) - centre + r) / T(2), lower = (T(1) - centre - r) / T(2);
  return left ? Weights<T>{lower, centre, upper, T(0)} : Weights<T>{T(0), lower, centre, upper};
}

}  // namespace hemowalk::ibm
