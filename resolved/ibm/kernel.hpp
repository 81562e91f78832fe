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

/// 0 or 1: which of the nodes at 0 and 1 a marker at fraction f is nearest to.
template <class T>
HEMO_HD inline T nearest_node(const T& f) {
  using std::floor;
  return floor(f + T(0.5f));
}

/// Three-point function: phi(r) = (1 + sqrt(1 - 3 r^2))/3 for |r| <= 1/2; the outer two weights follow from
/// zeroth and first moment.
template <class T>
HEMO_HD inline Weights<T> phi3(const T& f) {
  using std::sqrt;
  const T right = nearest_node(f), left = T(1) - right;  // one of them is 1
  const T r = f - right;                                 // marker relative to it
  const T centre = (T(1) + sqrt(T(1) - T(3) * r * r)) / T(3);
  const T upper = (T(1) - centre + r) * T(0.5f), lower = (T(1) - centre - r) * T(0.5f);
  return {left * lower, left * centre + right * lower, left * upper + right * centre, right * upper};
}

}  // namespace hemowalk::ibm
