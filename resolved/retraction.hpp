#pragma once
/// \file Area normals of many cells side by side, their rates, and the couples of the retracted coupling
/// surface (docs/adr/0008): coupling.hpp with a pack per number. Fields are [vertex][3][lane].

#include <array>

#include "core/block.hpp"
#include "core/simd.hpp"
#include "resolved/coupling.hpp"
#include "resolved/mirror_surface.hpp"

namespace hemowalk::resolved {

/// Vertex k of a field, all lanes.
template <int lanes, class Real>
HEMO_INLINE Vector<Pack<Real, lanes>> all_lanes(const Real* field, int k) {
  const Real* p = field + 3 * k * lanes;
  return {load<Real, lanes>(p), load<Real, lanes>(p + lanes), load<Real, lanes>(p + 2 * lanes)};
}
template <int lanes, class Real>
HEMO_INLINE void set_lanes(const Vector<Pack<Real, lanes>>& v, Real* field, int k) {
  Real* p = field + 3 * k * lanes;
  store<Real, lanes>(v.x, p), store<Real, lanes>(v.y, p + lanes), store<Real, lanes>(v.z, p + 2 * lanes);
}

/// A triangle's area vector and its rate, added to the three corners.
template <int lanes, class Real>
HEMO_INLINE void add_normals(const std::array<int, 3>& t, const Real* x, const Real* v, Real* sum,
                             Real* rate) {
  const auto x0 = all_lanes<lanes>(x, t[0]), v0 = all_lanes<lanes>(v, t[0]);
  const auto area = area_vector(all_lanes<lanes>(x, t[1]) - x0, all_lanes<lanes>(x, t[2]) - x0,
                                all_lanes<lanes>(v, t[1]) - v0, all_lanes<lanes>(v, t[2]) - v0);
  for (int i = 0; i < 3; ++i) {
    set_lanes<lanes, Real>(all_lanes<lanes>(sum, t[i]) + area.normal, sum, t[i]);
    set_lanes<lanes, Real>(all_lanes<lanes>(rate, t[i]) + area.rate, rate, t[i]);
  }
}

/// The impulses of one vertex.
template <int lanes, class Real>
HEMO_INLINE Vector<Pack<Real, lanes>> all_lanes(const Node4<Real>* J) {
  using P = Pack<Real, lanes>;
  return {P([&](auto l) { return J[l].x; }), P([&](auto l) { return J[l].y; }),
          P([&](auto l) { return J[l].z; })};
}

/// From the sum of area vectors round a vertex and its rate: rate <- delta dn/dt, sum <- the vertex's couple.
template <int lanes, class Real>
HEMO_INLINE void to_unit_normal(Real delta, const Node4<Real>* J, Real* sum, Real* rate) {
  using P = Pack<Real, lanes>;
  const auto impulse = all_lanes<lanes>(J);
  const auto r = retraction(P(delta), all_lanes<lanes>(sum, 0), all_lanes<lanes>(rate, 0), impulse);
  set_lanes<lanes, Real>(r.rate, rate, 0);
  set_lanes<lanes, Real>(r.couple, sum, 0);
}

/// The mean over all vertices.
template <int lanes, class Real, class Field>
HEMO_INLINE Vector<Pack<Real, lanes>> mean_of(int vertices, const Field& field) {
  auto sum = field(0);
  for (int k = 1; k < vertices; ++k) sum = sum + field(k);
  return Pack<Real, lanes>(Real(1) / static_cast<Real>(vertices)) * sum;
}
/// drawn_in() of \p field(k), all vertices.
template <int lanes, class Real, class Field>
HEMO_INLINE void draw_in(const MirrorSurface& s, const Field& field, Real* out) {
  using P = Pack<Real, lanes>;
  const int vertices = static_cast<int>(s.mirror.size());
  const P axial(static_cast<Real>(s.axial / 2)), radial(static_cast<Real>(s.radial / 2));
  const auto mean = mean_of<lanes, Real>(vertices, field);
  for (int k = 0; k < vertices; ++k)
    set_lanes<lanes, Real>(drawn_in(axial, radial, field(k), field(s.mirror[k]), mean), out, k);
}

/// Forces of the couples on the corners of a triangle.
template <int lanes, class Real>
HEMO_INLINE void add_couples(const std::array<int, 3>& t, const Real* x, const Real* g, Real* force) {
  const auto sum = all_lanes<lanes>(g, t[0]) + all_lanes<lanes>(g, t[1]) + all_lanes<lanes>(g, t[2]);
  for (int i = 0; i < 3; ++i) {
    const auto from = all_lanes<lanes>(x, t[(i + 1) % 3]), to = all_lanes<lanes>(x, t[(i + 2) % 3]);
    set_lanes<lanes, Real>(all_lanes<lanes>(force, t[i]) + couple_force(sum, from, to), force, t[i]);
  }
}

}  // namespace hemowalk::resolved
