#pragma once
/// \file The arithmetic of the coupling at a vertex (method 5.2, steps 2-4, and docs/adr/0008), for host and
/// device. The slip correction is slip_correction.hpp.

#include <cmath>
#include <limits>

#include "resolved/mesh/lane_vector.hpp"

namespace hemowalk::resolved {

using mesh::Vector;

/// Area vector (twice the area along the normal) of a triangle and its rate of change.
template <class T>
struct AreaVector {
  Vector<T> normal, rate;
};
/// From the edges \p e1, \p e2 (corner 0 to 1 and 2) and the differences of velocity along them.
template <class T>
HEMO_HD HEMO_INLINE AreaVector<T> area_vector(const Vector<T>& e1, const Vector<T>& e2, const Vector<T>& d1,
                                              const Vector<T>& d2) {
  return {cross(e1, e2), cross(d1, e2) + cross(e1, d2)};
}

/// What the retraction by delta n does at a vertex.
template <class T>
struct Retraction {
  Vector<T> rate;    ///< delta dn/dt: the coupling point's velocity is v minus this
  Vector<T> couple;  ///< delta J_t/|S|, J_t the tangential impulse
};
/// From the sum \p s of area vectors round the vertex, its rate \p r, and the marker's impulse \p J.
template <class T>
HEMO_HD HEMO_INLINE Retraction<T> retraction(const T& delta, const Vector<T>& s, const Vector<T>& r,
                                             const Vector<T>& J) {
  using std::sqrt;
  const T inverse = T(1) / sqrt(dot(s, s) + T(std::numeric_limits<float>::min()));  // 0 for an idle lane
  const Vector<T> n = inverse * s;
  return {(delta * inverse) * (r - dot(n, r) * n), (delta * inverse) * (J - dot(n, J) * n)};
}

/// Force of the couples on one corner of a triangle: the gradient of g . N, g the sum of couples over the
/// corners, \p from and \p to the other two corners in the triangle's order.
template <class T>
HEMO_HD HEMO_INLINE Vector<T> couple_force(const Vector<T>& g, const Vector<T>& from, const Vector<T>& to) {
  return cross(g, to - from);
}

/// L f at a vertex, for a coupling surface that is a linear map of the vertices, x_s = x - L x: a vertex and
/// its mirror image come closer to each other by the share `axial` of their distance, their middle to the
/// centre (the mean of all vertices) by `radial` of its way; given are halves of the shares. L is symmetric:
/// L v is the velocity that the coupling point lacks, L J what the impulse J that it gives the fluid adds to
/// the force on the vertices, - J. Rows sum to zero and entries are numbers: both momenta are kept, and rigid
/// motions are carried along.
template <class T>
HEMO_HD HEMO_INLINE Vector<T> drawn_in(const T& half_axial, const T& half_radial, const Vector<T>& f,
                                       const Vector<T>& mirrored, const Vector<T>& mean) {
  return half_axial * (f - mirrored) + half_radial * ((f + mirrored) - (mean + mean));
}

/// v_pred = (m v + k a w + h F)/(m + k a), written as an increment over w: rounding then touches a small
/// number and momentum does not drift.
template <class T>
HEMO_HD HEMO_INLINE Vector<T> predicted_velocity(const Vector<T>& w, const Vector<T>& v,
                                                 const Vector<T>& force, const T& m, const T& h,
                                                 const T& inverse_metric) {
  return w + inverse_metric * (m * (v - w) + h * force);
}

/// J = a (v - w): what a marker gives the fluid in each fluid step.
template <class T>
HEMO_HD HEMO_INLINE Vector<T> marker_impulse(const T& a, const Vector<T>& v, const Vector<T>& w) {
  return a * (v - w);
}

}  // namespace hemowalk::resolved
