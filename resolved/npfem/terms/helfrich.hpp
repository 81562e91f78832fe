#pragma once
/// \file Helfrich bending with a reference curvature, discretised after Juelicher (J. Phys. II 6, 1797,
/// 1996).
///
/// E = 2 k_b sum_i (M_i - A_i H0)^2/A_i, M_i = 1/4 sum_(edges at i) l theta the integrated mean curvature of
/// vertex i (theta the signed angle between the face normals, > 0 where convex), A_i a third of the adjacent
/// areas.

#include "resolved/npfem/terms/stretch.hpp"

namespace hemowalk::npfem {

/// arctan(y/x) for |y/x| of any size with x^2 + y^2 = 1: halves the angle three times, then a series; no
/// branches.
template <class T>
HEMO_HD HEMO_INLINE T angle_of(const T& cosine, const T& sine) {
  using std::max;
  using std::sqrt;
  T u = sine / max(1 + cosine, T(1e-6f));  // tan(theta/2)
  u = u / (1 + sqrt(1 + u * u));           // tan(theta/4)
  u = u / (1 + sqrt(1 + u * u));           // tan(theta/8) < 0.42
  u = u / (1 + sqrt(1 + u * u));           // tan(theta/16) < 0.2
  const T z = u * u;
  T series(0);
  for (int n = 25; n >= 3; n -= 2) series = ((n % 4 == 1 ? T(1) : T(-1)) / T(n)) + z * series;
  return 16 * (u + u * (z * series));
}

/// Geometry of one edge (x0, x1) with opposite vertices x2 (left) and x3 (right).
template <class T>
struct Dihedral {
  T length, theta;
  Vector<T> d0, d1, d2, d3;  ///< d theta/d x_k
  Vector<T> tangent;         ///< unit vector from x0 to x1
};

/// \p e1, \p e2, \p e3: x1 - x0, x2 - x0, x3 - x0.
template <class T>
HEMO_HD HEMO_INLINE Dihedral<T> dihedral(const Vector<T>& e1, const Vector<T>& e2, const Vector<T>& e3) {
  using std::sqrt;
  Dihedral<T> d;
  const Vector<T> left = cross(e1, e2), right = cross(e3, e1);  // area normals, both outward
  const T l2 = dot(e1, e1);
  d.length = sqrt(l2);
  const T per_length = 1 / d.length;
  d.tangent = per_length * e1;
  const T left2 = dot(left, left), right2 = dot(right, right);
  const T per_norms = 1 / sqrt(left2 * right2);
  const T cosine = dot(left, right) * per_norms;
  // positive where the surface is convex
  const T sine = dot(cross(left, right), d.tangent) * per_norms;
  d.theta = angle_of(cosine, sine);
  const Vector<T> a = (1 / left2) * left, b = (1 / right2) * right;
  // Raising an opposite vertex along its face's normal flattens a convex edge.
  d.d2 = -d.length * a;
  d.d3 = -d.length * b;
  const T s2 = dot(e2, e1) * per_length, s3 = dot(e3, e1) * per_length;  // feet of x2, x3 along the edge
  d.d0 = (d.length - s2) * a + (d.length - s3) * b;
  d.d1 = s2 * a + s3 * b;
  return d;
}

}  // namespace hemowalk::npfem
