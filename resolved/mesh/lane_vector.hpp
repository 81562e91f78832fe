#pragma once
/// \file Three components of a number type T: float, double or a pack of them (one body per lane).

#include <algorithm>
#include <cmath>

#include "core/portability.hpp"

namespace hemowalk::mesh {

template <class T>
struct Vector {
  T x, y, z;
};
template <class T>
HEMO_HD HEMO_INLINE Vector<T> operator+(const Vector<T>& a, const Vector<T>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
HEMO_HD HEMO_INLINE Vector<T> operator-(const Vector<T>& a, const Vector<T>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class S, class T>
HEMO_HD HEMO_INLINE Vector<T> operator*(const S& s, const Vector<T>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class T>
HEMO_HD HEMO_INLINE T dot(const Vector<T>& a, const Vector<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
HEMO_HD HEMO_INLINE Vector<T> cross(const Vector<T>& a, const Vector<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// \p v, shortened to \p limit (finite, positive) if it is longer.
template <class S, class T>
HEMO_HD HEMO_INLINE Vector<T> shortened(const Vector<T>& v, const S& limit) {
  using std::max;
  using std::sqrt;
  return (limit / max(sqrt(dot(v, v)), T(limit))) * v;
}

}  // namespace hemowalk::mesh
