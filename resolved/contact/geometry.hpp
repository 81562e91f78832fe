#pragma once
/// \file Geometry of contact: nearest point of a triangle. Bodies for host, device and SIMD packs.

#include <cmath>
#include <type_traits>

#include "core/portability.hpp"

namespace hemowalk::contact {

template <class T>
struct Point {
  T x, y, z;
};
template <class T>
HEMO_HD constexpr Point<T> operator+(const Point<T>& a, const Point<T>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
HEMO_HD constexpr Point<T> operator-(const Point<T>& a, const Point<T>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
HEMO_HD constexpr Point<T> operator*(const T& s, const Point<T>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class T>
HEMO_HD constexpr T dot(const Point<T>& a, const Point<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
HEMO_HD constexpr Point<T> cross(const Point<T>& a, const Point<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Nearest point q = a + wb (b - a) + wc (c - a) of a triangle to a point p.
template <class T>
struct Nearest {
  T wb, wc;           ///< barycentric weights; that of a is 1 - wb - wc
  Point<T> to_point;  ///< p - q
  T squared;          ///< |p - q|^2
};

/// mask ? yes : no, lane by lane for packs.
template <class Mask, class T>
HEMO_HD HEMO_INLINE T select(const Mask& mask, const T& yes, const T& no) {
  if constexpr (std::is_same_v<Mask, bool>) {
    return mask ? yes : no;
  } else {
    T result = no;
    where(mask, result) = yes;
    return result;
  }
}

/// Parameter in [0, 1] of the point of a segment that is nearest, from t = (p . e) and ee = |e|^2.
template <class T>
HEMO_HD HEMO_INLINE T clamped_ratio(const T& t, const T& ee) {
  const T r = t / ee;
  const T low = select(r < T(0), T(0), r);
  return select(low > T(1), T(1), low);
}

/// Branch-free: the foot of the perpendicular when it falls inside, else the best of the three edges. The
/// final difference vector is formed from coordinates, not from squares, so small gaps keep their accuracy.
template <class T>
HEMO_HD HEMO_INLINE Nearest<T> nearest_on_triangle(const Point<T>& p, const Point<T>& a, const Point<T>& b,
                                                   const Point<T>& c) {
  const Point<T> ab = b - a, ac = c - a, ap = p - a;
  const T bb = dot(ab, ab), bc = dot(ab, ac), cc = dot(ac, ac), pb = dot(ap, ab), pc = dot(ap, ac);
  // Foot of the perpendicular in barycentric weights times det.
  const T det = bb * cc - bc * bc;
  const T fb = cc * pb - bc * pc, fc = bb * pc - bc * pb;
  const auto inside = (fb >= T(0)) && (fc >= T(0)) && (fb + fc <= det) && (det > T(0));
  // Edges ab, ac and bc; squared distances relative to |ap|^2, which they share.
  const T tb = clamped_ratio(pb, bb), tc = clamped_ratio(pc, cc);
  const T ee = bb - T(2) * bc + cc;                   // |c - b|^2
  const T te = clamped_ratio(bb - bc + pc - pb, ee);  // (p - b).(c - b)
  const T sb = tb * (tb * bb - T(2) * pb), sc = tc * (tc * cc - T(2) * pc);
  const T se = bb - T(2) * pb + te * (te * ee - T(2) * (bb - bc + pc - pb));
  T wb = select(sb <= sc, tb, T(0)), wc = select(sb <= sc, T(0), tc);
  const T best = select(sb <= sc, sb, sc);
  wb = select(se < best, T(1) - te, wb);
  wc = select(se < best, te, wc);
  const T inverse = T(1) / select(det > T(0), det, T(1));
  wb = select(inside, fb * inverse, wb);
  wc = select(inside, fc * inverse, wc);
  Nearest<T> result{wb, wc, ap - wb * ab - wc * ac, T(0)};
  result.squared = dot(result.to_point, result.to_point);
  return result;
}

}  // namespace hemowalk::contact
