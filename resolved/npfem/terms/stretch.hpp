#pragma once
/// \file In-plane stretch of a triangle and the nodal forces of an isotropic membrane law.
///
/// F = P^T [e1 e2] R is the 2x2 deformation gradient with principal stretches s1, s2. Only the rest metric's
/// inverse B = R R^T and the metric g_ij = e_i . e_j enter, so no singular value decomposition is needed:
/// I1 = s1^2 + s2^2 = tr(B g), J = s1 s2 = sqrt(det B det g), t = s1 + s2 = sqrt(I1 + 2 J).
/// T is float, double or a pack of them.

#include <algorithm>
#include <cmath>

#include "core/portability.hpp"
#include "resolved/mesh/lane_vector.hpp"

namespace hemowalk::npfem {

using mesh::Vector;

/// Invariants of the stretches.
template <class T>
struct Stretch {
  T I1, J, t;
};

/// Derivative of the energy per rest area, written as w(I1, t, J): each law uses the invariants that suit it.
template <class T>
struct StretchGradient {
  T I1, t, J;
};
template <class T>
HEMO_HD HEMO_INLINE StretchGradient<T> operator+(const StretchGradient<T>& a, const StretchGradient<T>& b) {
  return {a.I1 + b.I1, a.t + b.t, a.J + b.J};
}

/// Rest data of a triangle: B = inverse metric of its edge vectors, its determinant, and the area.
template <class S>
struct RestTriangle {
  S b11, b12, b22, det, area;
};

/// The triangle as it is now: edge vectors from vertex 0, their metric, and the area normal e1 x e2.
template <class T>
struct Triangle {
  Vector<T> e1, e2, normal;
  T g11, g12, g22;
};
template <class T>
HEMO_HD HEMO_INLINE Triangle<T> make_triangle(const Vector<T>& e1, const Vector<T>& e2) {
  return {e1, e2, cross(e1, e2), dot(e1, e1), dot(e1, e2), dot(e2, e2)};
}

template <class S, class T>
HEMO_HD HEMO_INLINE Stretch<T> stretch_of(const RestTriangle<S>& rest, const Triangle<T>& now) {
  using std::max;
  using std::sqrt;
  const T I1 = rest.b11 * now.g11 + 2 * (rest.b12 * now.g12) + rest.b22 * now.g22;
  // |normal|^2 is det g without cancellation. The floor keeps a collapsed triangle finite.
  const T J = sqrt(max(rest.det * dot(now.normal, now.normal), T(1e-12f)));
  return {I1, J, sqrt(I1 + 2 * J)};
}

/// Forces on vertices 1 and 2; vertex 0 takes minus their sum. With t^2 = I1 + 2 J, the forces are
/// -A (2 w_1 B + (w_J/J) det B adj g) [e1 e2], w_1 = w_I1 + w_t/(2t), w_J + w_t/t. The 2x2 matrix is
/// symmetric, so the triangle's own force and torque vanish to round-off.
template <class S, class T>
HEMO_HD HEMO_INLINE void stretch_forces(const RestTriangle<S>& rest, const Triangle<T>& now,
                                        const Stretch<T>& s, const StretchGradient<T>& w, Vector<T>& f1,
                                        Vector<T>& f2) {
  const T both = 1 / (s.t * s.J);  // one division for 1/t and 1/J
  const T per_t = w.t * (both * s.J);
  const T a = rest.area * (2 * w.I1 + per_t);
  const T b = (rest.area * rest.det) * ((w.J + per_t) * (both * s.t));
  const T k11 = a * rest.b11 + b * now.g22;
  const T k12 = a * rest.b12 - b * now.g12;
  const T k22 = a * rest.b22 + b * now.g11;
  f1 = {-(k11 * now.e1.x + k12 * now.e2.x), -(k11 * now.e1.y + k12 * now.e2.y),
        -(k11 * now.e1.z + k12 * now.e2.z)};
  f2 = {-(k12 * now.e1.x + k22 * now.e2.x), -(k12 * now.e1.y + k22 * now.e2.y),
        -(k12 * now.e1.z + k22 * now.e2.z)};
}

}  // namespace hemowalk::npfem
