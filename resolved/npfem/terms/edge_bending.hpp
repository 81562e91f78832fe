#pragma once
/// \file The paper's bending energy per edge (method 3, item 3); blind to the sign of curvature.

#include "resolved/npfem/terms/stretch.hpp"

namespace hemowalk::npfem {

/// Rest data of an edge (v0, v1) with opposite vertices v2, v3: cotangent weights of v1, v2, v3 (v0 takes
/// minus their sum), stiffness 3 k_b/(A0 + A1), |e| at rest.
template <class S>
struct RestEdge {
  S w1, w2, w3, stiffness, length;
};

/// E = stiffness/2 (|e| - |e_rest|)^2, e = sum w_k x_k, which vanishes where the two triangles are coplanar.
/// |e| means sqrt(e.e + epsilon^2), also at rest: the derivative is finite when an edge flattens.
/// \returns the factor c of the forces f_k = -c w_k e; they sum to zero and, with x, to no torque.
template <class S, class T>
HEMO_HD HEMO_INLINE T edge_bending_factor(const RestEdge<S>& rest, const S& epsilon2, const Vector<T>& e) {
  using std::sqrt;
  return rest.stiffness - (rest.stiffness * rest.length) / sqrt(dot(e, e) + epsilon2);
}

/// e from the edge vectors x_k - x_0.
template <class S, class T>
HEMO_HD HEMO_INLINE Vector<T> edge_vector(const RestEdge<S>& rest, const Vector<T>& d1, const Vector<T>& d2,
                                          const Vector<T>& d3) {
  return {rest.w1 * d1.x + rest.w2 * d2.x + rest.w3 * d3.x, rest.w1 * d1.y + rest.w2 * d2.y + rest.w3 * d3.y,
          rest.w1 * d1.z + rest.w2 * d2.z + rest.w3 * d3.z};
}

}  // namespace hemowalk::npfem
