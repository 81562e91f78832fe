#pragma once
/// \file Area normals of many cells side by side, their rates, and the couples of the retracted coupling
/// surface (docs/adr/0008): coupling.hpp, lane by lane. Fields are [vertex][3][lane].

#include <array>

#include "core/block.hpp"
#include "resolved/coupling.hpp"

namespace hemowalk::resolved {

/// Lane l of vertex k in a field [vertex][3][lane].
template <int lanes, class Real>
HEMO_INLINE Vector<Real> at_lane(const Real* field, int k, int l) {
  const Real* p = field + 3 * k * lanes + l;
  return {p[0], p[lanes], p[2 * lanes]};
}
template <int lanes, class Real>
HEMO_INLINE void set_lane(const Vector<Real>& v, Real* field, int k, int l) {
  Real* p = field + 3 * k * lanes + l;
  p[0] = v.x, p[lanes] = v.y, p[2 * lanes] = v.z;
}

/// A triangle's area vector and its rate, added to the three corners. [vertex][3][lane]
template <int lanes, class Real>
HEMO_INLINE void add_normals(const std::array<int, 3>& t, const Real* x, const Real* v, Real* sum,
                             Real* rate) {
#pragma omp simd
  for (int l = 0; l < lanes; ++l) {
    const Vector<Real> x0 = at_lane<lanes>(x, t[0], l), v0 = at_lane<lanes>(v, t[0], l);
    const AreaVector<Real> area =
        area_vector(at_lane<lanes>(x, t[1], l) - x0, at_lane<lanes>(x, t[2], l) - x0,
                    at_lane<lanes>(v, t[1], l) - v0, at_lane<lanes>(v, t[2], l) - v0);
    for (int i = 0; i < 3; ++i) {
      set_lane<lanes>(at_lane<lanes>(sum, t[i], l) + area.normal, sum, t[i], l);
      set_lane<lanes>(at_lane<lanes>(rate, t[i], l) + area.rate, rate, t[i], l);
    }
  }
}

/// From the sum of area vectors round a vertex and its rate: rate <- delta dn/dt, sum <- the vertex's couple.
template <int lanes, class Real>
HEMO_INLINE void to_unit_normal(Real delta, const Node4<Real>* J, Real* sum, Real* rate) {
#pragma omp simd
  for (int l = 0; l < lanes; ++l) {
    const Retraction<Real> r = retraction(delta, at_lane<lanes>(sum, 0, l), at_lane<lanes>(rate, 0, l),
                                          Vector<Real>{J[l].x, J[l].y, J[l].z});
    set_lane<lanes>(r.rate, rate, 0, l);
    set_lane<lanes>(r.couple, sum, 0, l);
  }
}

/// Forces of the couples on the corners of a triangle.
template <int lanes, class Real>
HEMO_INLINE void add_couples(const std::array<int, 3>& t, const Real* x, const Real* g, Real* force) {
#pragma omp simd
  for (int l = 0; l < lanes; ++l) {
    const Vector<Real> sum =
        at_lane<lanes>(g, t[0], l) + at_lane<lanes>(g, t[1], l) + at_lane<lanes>(g, t[2], l);
    const Vector<Real> p[3] = {at_lane<lanes>(x, t[0], l), at_lane<lanes>(x, t[1], l),
                               at_lane<lanes>(x, t[2], l)};
    set_lane<lanes>(at_lane<lanes>(force, t[0], l) + couple_force(sum, p[1], p[2]), force, t[0], l);
    set_lane<lanes>(at_lane<lanes>(force, t[1], l) + couple_force(sum, p[2], p[0]), force, t[1], l);
    set_lane<lanes>(at_lane<lanes>(force, t[2], l) + couple_force(sum, p[0], p[1]), force, t[2], l);
  }
}

}  // namespace hemowalk::resolved
