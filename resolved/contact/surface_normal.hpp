#pragma once
/// \file Outward direction at a surface point, such that its sign against p - q tells on which side p is: the
/// normal of the face, the sum of both normals on an edge, the angle-weighted sum at a vertex (Baerentzen &
/// Aanaes 2005). Bodies for host and device.
///
/// A Surface has triangles[t][0..2] (counter-clockwise seen from outside), ring_begin[v] and ring[i]
/// (triangles round a vertex); \p at(v) gives the position of a vertex.

#include <cmath>
#include <cstdint>

#include "resolved/contact/geometry.hpp"

namespace hemowalk::contact {

/// Unit normal of a triangle, outwards for counter-clockwise corners.
template <class T>
HEMO_HD inline Point<T> unit_normal(const Point<T>& a, const Point<T>& b, const Point<T>& c) {
  const Point<T> n = cross(b - a, c - a);
  const T length = std::sqrt(dot(n, n));
  return (length > 0 ? T(1) / length : T(0)) * n;
}

template <class T, class Surface, class Position>
HEMO_HD Point<T> face_normal(const Surface& s, const Position& at, std::uint32_t t) {
  const auto& c = s.triangles[t];
  return unit_normal<T>(at(c[0]), at(c[1]), at(c[2]));
}

template <class T, class Surface, class Position>
HEMO_HD Point<T> vertex_normal(const Surface& s, const Position& at, std::uint32_t v) {
  Point<T> sum{0, 0, 0};
  const Point<T> x = at(v);
  for (std::uint32_t i = s.ring_begin[v]; i < s.ring_begin[v + 1]; ++i) {
    const auto& c = s.triangles[s.ring[i]];
    const int k = c[0] == v ? 0 : c[1] == v ? 1 : 2;
    const Point<T> e = at(c[(k + 1) % 3]) - x, f = at(c[(k + 2) % 3]) - x;
    const Point<T> n = cross(e, f);
    const T sine = std::sqrt(dot(n, n));
    if (sine > 0) sum = sum + (std::atan2(sine, dot(e, f)) / sine) * n;
  }
  return sum;
}

template <class T, class Surface, class Position>
HEMO_HD Point<T> edge_normal(const Surface& s, const Position& at, std::uint32_t t, std::uint32_t v,
                             std::uint32_t w) {
  Point<T> sum = face_normal<T>(s, at, t);
  for (std::uint32_t i = s.ring_begin[v]; i < s.ring_begin[v + 1]; ++i) {
    const std::uint32_t other = s.ring[i];
    const auto& c = s.triangles[other];
    if (other != t && (c[0] == w || c[1] == w || c[2] == w)) sum = sum + face_normal<T>(s, at, other);
  }
  return sum;
}

/// At the point of triangle \p t with barycentric weights \p wb, \p wc. Not of unit length.
template <class T, class Surface, class Position>
HEMO_HD Point<T> surface_normal(const Surface& s, const Position& at, std::uint32_t t, T wb, T wc) {
  const T zero = sizeof(T) == 4 ? T(1e-6) : T(1e-13);
  const T weight[3] = {T(1) - wb - wc, wb, wc};
  const auto& c = s.triangles[t];
  for (int k = 0; k < 3; ++k)
    if (weight[k] >= T(1) - zero) return vertex_normal<T>(s, at, c[k]);
  for (int k = 0; k < 3; ++k)
    if (weight[k] <= zero) return edge_normal<T>(s, at, t, c[(k + 1) % 3], c[(k + 2) % 3]);
  return face_normal<T>(s, at, t);
}

}  // namespace hemowalk::contact
