#pragma once
/// \file Area normals of many cells side by side, their rates, and the couples of the retracted coupling
/// surface (docs/adr/0008). Fields are [vertex][3][lane].

#include <array>
#include <cmath>
#include <limits>

#include "core/block.hpp"
#include "core/portability.hpp"

namespace hemowalk::resolved {

/// Area vector N = (x1 - x0) x (x2 - x0) of a triangle and its rate, added to the three corners.
/// [vertex][3][lane]
template <int lanes, class Real>
HEMO_INLINE void add_normals(const std::array<int, 3>& t, const Real* x, const Real* v, Real* sum,
                             Real* rate) {
  const Real *x0 = x + 3 * t[0] * lanes, *x1 = x + 3 * t[1] * lanes, *x2 = x + 3 * t[2] * lanes;
  const Real *v0 = v + 3 * t[0] * lanes, *v1 = v + 3 * t[1] * lanes, *v2 = v + 3 * t[2] * lanes;
  for (int d = 0; d < 3; ++d) {
    const int p = (d + 1) % 3 * lanes, q = (d + 2) % 3 * lanes;
    alignas(64) Real N[lanes], dN[lanes];
#pragma omp simd
    for (int l = 0; l < lanes; ++l) {
      const Real ap = x1[p + l] - x0[p + l], aq = x1[q + l] - x0[q + l], bp = x2[p + l] - x0[p + l],
                 bq = x2[q + l] - x0[q + l];
      N[l] = ap * bq - aq * bp;
      dN[l] = (v1[p + l] - v0[p + l]) * bq + ap * (v2[q + l] - v0[q + l]) - (v1[q + l] - v0[q + l]) * bp -
              aq * (v2[p + l] - v0[p + l]);
    }
    for (int i = 0; i < 3; ++i) {
      Real *s = sum + (3 * t[i] + d) * lanes, *r = rate + (3 * t[i] + d) * lanes;
#pragma omp simd
      for (int l = 0; l < lanes; ++l) s[l] += N[l], r[l] += dN[l];
    }
  }
}

/// From the sum S of area vectors round a vertex and its rate: rate <- delta dn/dt, sum <- delta J_t/|S|.
template <int lanes, class Real>
HEMO_INLINE void to_unit_normal(Real delta, const Node4<Real>* J, Real* sum, Real* rate) {
#pragma omp simd
  for (int l = 0; l < lanes; ++l) {
    const Real s[3] = {sum[l], sum[lanes + l], sum[2 * lanes + l]},
               r[3] = {rate[l], rate[lanes + l], rate[2 * lanes + l]};
    const Real inverse =
        1 / std::sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + std::numeric_limits<Real>::min());
    const Real n[3] = {s[0] * inverse, s[1] * inverse, s[2] * inverse}, j[3] = {J[l].x, J[l].y, J[l].z};
    const Real nr = n[0] * r[0] + n[1] * r[1] + n[2] * r[2], nj = n[0] * j[0] + n[1] * j[1] + n[2] * j[2];
    for (int d = 0; d < 3; ++d) {
      rate[d * lanes + l] = delta * inverse * (r[d] - nr * n[d]);
      sum[d * lanes + l] = delta * inverse * (j[d] - nj * n[d]);
    }
  }
}

/// Forces of the couples on the corners: the gradient of g . N, g the sum over corners, is g x (opposite
/// edge).
template <int lanes, class Real>
HEMO_INLINE void add_couples(const std::array<int, 3>& t, const Real* x, const Real* g, Real* force) {
  alignas(64) Real sum[3][lanes];
  for (int d = 0; d < 3; ++d) {
    const Real *g0 = g + (3 * t[0] + d) * lanes, *g1 = g + (3 * t[1] + d) * lanes,
               *g2 = g + (3 * t[2] + d) * lanes;
#pragma omp simd
    for (int l = 0; l < lanes; ++l) sum[d][l] = g0[l] + g1[l] + g2[l];
  }
  for (int i = 0; i < 3; ++i) {
    const Real *from = x + 3 * t[(i + 1) % 3] * lanes, *to = x + 3 * t[(i + 2) % 3] * lanes;
    for (int d = 0; d < 3; ++d) {
      const int p = (d + 1) % 3, q = (d + 2) % 3;
      Real* f = force + (3 * t[i] + d) * lanes;
#pragma omp simd
      for (int l = 0; l < lanes; ++l)
        f[l] += sum[p][l] * (to[q * lanes + l] - from[q * lanes + l]) -
                sum[q][l] * (to[p * lanes + l] - from[p * lanes + l]);
    }
  }
}

}  // namespace hemowalk::resolved
