#pragma once
/// \file A field of Node4 seen as packs: W nodes in, one pack per component out, and back. Host only.

#include <utility>

#include "core/block.hpp"
#include "core/simd.hpp"
#include "resolved/lbm/d3q19.hpp"

namespace hemowalk::lbm {

/// Numbers per pack: what one register of this machine holds.
template <class Real>
inline constexpr int lanes = static_cast<int>(stdx::native_simd<Real>::size());

namespace detail {

/// Four vectors of W lanes <-> W nodes of 4 numbers, by two-source shuffles.
template <class Real, int W>
struct Transpose {
  typedef Real Vector __attribute__((vector_size(W * sizeof(Real))));
  static constexpr int quarter = W / 4, half = W / 2;

  static HEMO_INLINE Vector read(const Real* p) {
    Vector v;
    __builtin_memcpy(&v, p, sizeof v);
    return v;
  }
  template <int... I>
  static HEMO_INLINE void load(const Real* p, Vector& x, Vector& y, Vector& z,
                               std::integer_sequence<int, I...>) {
    const Vector a = read(p), b = read(p + W), d = read(p + 2 * W), e = read(p + 3 * W);
    // [x of W/2 nodes | y of W/2 nodes]; a lane beyond W comes from the second vector.
    const Vector xy0 = __builtin_shufflevector(a, b, (4 * (I % half) + I / half)...);
    const Vector xy1 = __builtin_shufflevector(d, e, (4 * (I % half) + I / half)...);
    const Vector z0 = __builtin_shufflevector(a, b, (4 * (I % half) + 2)...);
    const Vector z1 = __builtin_shufflevector(d, e, (4 * (I % half) + 2)...);
    x = __builtin_shufflevector(xy0, xy1, (I < half ? I : W + I - half)...);
    y = __builtin_shufflevector(xy0, xy1, (I < half ? half + I : W + I)...);
    z = __builtin_shufflevector(z0, z1, (I < half ? I : W + I - half)...);
  }
  template <int... I>
  static HEMO_INLINE void store(const Vector& x, const Vector& y, const Vector& z, const Vector& w, Real* p,
                                std::integer_sequence<int, I...>) {
    const Vector low[2] = {__builtin_shufflevector(x, y, (I < half ? I : W + I - half)...),
                           __builtin_shufflevector(x, y, (I < half ? half + I : W + I)...)};
    const Vector high[2] = {__builtin_shufflevector(z, w, (I < half ? I : W + I - half)...),
                            __builtin_shufflevector(z, w, (I < half ? half + I : W + I)...)};
    unroll<4>([&](auto part) HEMO_INLINE_LAMBDA {
      constexpr int first = (decltype(part)::value % 2) * quarter;  // node within the half
      const Vector v =
          __builtin_shufflevector(low[decltype(part)::value / 2], high[decltype(part)::value / 2],
                                  (first + I / 4 + (I % 2) * half + (I % 4 / 2) * W)...);
      __builtin_memcpy(p + decltype(part)::value * W, &v, sizeof v);
    });
  }
};

}  // namespace detail

/// x, y, z of W nodes.
template <class Real, int W>
HEMO_INLINE void load_nodes(const Node4<Real>* nodes, Pack<Real, W>& x, Pack<Real, W>& y, Pack<Real, W>& z) {
  if constexpr (W >= 4) {
    typename detail::Transpose<Real, W>::Vector vx, vy, vz;
    detail::Transpose<Real, W>::load(&nodes->x, vx, vy, vz, std::make_integer_sequence<int, W>{});
    x = load<Real, W>(reinterpret_cast<const Real*>(&vx));
    y = load<Real, W>(reinterpret_cast<const Real*>(&vy));
    z = load<Real, W>(reinterpret_cast<const Real*>(&vz));
  } else {
    x = Pack<Real, W>([&](auto l) HEMO_INLINE_LAMBDA { return nodes[l].x; });
    y = Pack<Real, W>([&](auto l) HEMO_INLINE_LAMBDA { return nodes[l].y; });
    z = Pack<Real, W>([&](auto l) HEMO_INLINE_LAMBDA { return nodes[l].z; });
  }
}

/// Writes W nodes.
template <class Real, int W>
HEMO_INLINE void store_nodes(const Pack<Real, W>& x, const Pack<Real, W>& y, const Pack<Real, W>& z,
                             const Pack<Real, W>& w, Node4<Real>* nodes) {
  if constexpr (W >= 4) {
    typename detail::Transpose<Real, W>::Vector vx, vy, vz, vw;
    store<Real, W>(x, reinterpret_cast<Real*>(&vx));
    store<Real, W>(y, reinterpret_cast<Real*>(&vy));
    store<Real, W>(z, reinterpret_cast<Real*>(&vz));
    store<Real, W>(w, reinterpret_cast<Real*>(&vw));
    detail::Transpose<Real, W>::store(vx, vy, vz, vw, &nodes->x, std::make_integer_sequence<int, W>{});
  } else {
    for (int l = 0; l < W; ++l) nodes[l] = {x[l], y[l], z[l], w[l]};
  }
}

}  // namespace hemowalk::lbm
