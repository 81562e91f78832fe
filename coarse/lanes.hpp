#pragma once
/// \file Lanes<W> as packs of W walkers. Host only.

#include "coarse/scalar_lanes.hpp"
#include "core/simd.hpp"

namespace hemowalk::coarse {

template <int W>
struct Lanes {
  static constexpr int width = W;
  using Real = Pack<float, W>;
  using Int = Pack<std::int32_t, W>;
  using Bits = Pack<std::uint32_t, W>;
  using Wide = Pack<std::uint64_t, W / 2>;  ///< half of the lanes, for 32 x 32 -> 64 bit products
  using Flag = typename Int::mask_type;
};

template <class T, class A>
HEMO_INLINE stdx::simd<T, A> select(const stdx::simd_mask<T, A>& flag, const stdx::simd<T, A>& a,
                                    const stdx::simd<T, A>& b) {
  stdx::simd<T, A> result = b;
  stdx::where(flag, result) = a;
  return result;
}
/// Reals chosen by a Flag: a blend moves bits and does no arithmetic.
template <class A>
HEMO_INLINE stdx::simd<float, A> select(const stdx::simd_mask<std::int32_t, A>& flag,
                                        const stdx::simd<float, A>& a, const stdx::simd<float, A>& b) {
  using Int = stdx::simd<std::int32_t, A>;
  return same_bits<stdx::simd<float, A>>(select(flag, same_bits<Int>(a), same_bits<Int>(b)));
}
template <class T, class A>
HEMO_INLINE bool any(const stdx::simd_mask<T, A>& flag) {
  return stdx::any_of(flag);
}
template <class A>
HEMO_INLINE stdx::simd_mask<std::int32_t, A> flag_of(const stdx::simd_mask<float, A>& comparison) {
  using Real = stdx::simd<float, A>;
  return same_bits<stdx::simd<std::int32_t, A>>(select(comparison, Real(1), Real(0))) != 0;
}
template <class T, class A>
HEMO_INLINE stdx::simd<float, A> to_real(const stdx::simd<T, A>& x) {
  return stdx::static_simd_cast<stdx::simd<float, A>>(x);
}
template <class A>
HEMO_INLINE stdx::simd<std::int32_t, A> to_int(const stdx::simd<float, A>& x) {
  return stdx::static_simd_cast<stdx::simd<std::int32_t, A>>(x);
}
template <class A>
HEMO_INLINE stdx::simd<std::int32_t, A> as_signed(const stdx::simd<std::uint32_t, A>& x) {
  return same_bits<stdx::simd<std::int32_t, A>>(x);
}
template <class A>
HEMO_INLINE stdx::simd<std::uint32_t, A> as_bits(const stdx::simd<std::int32_t, A>& x) {
  return same_bits<stdx::simd<std::uint32_t, A>>(x);
}
/// Even and odd lanes in the lower halves of 64-bit lanes, and back. Upper halves are ignored on the way
/// back.
template <class A>
HEMO_INLINE void part_lanes(const stdx::simd<std::uint32_t, A>& x,
                            Pack<std::uint64_t, stdx::simd<float, A>::size() / 2>& even,
                            Pack<std::uint64_t, stdx::simd<float, A>::size() / 2>& odd) {
  const auto both = same_bits<Pack<std::uint64_t, stdx::simd<float, A>::size() / 2>>(x);
  even = both & 0xffffffffu;
  odd = both >> 32;
}
template <class To, class Wide>
HEMO_INLINE To join_lanes(const Wide& even, const Wide& odd) {
  return same_bits<To>((even & 0xffffffffu) | (odd << 32));
}
/// One 64-bit load per lane fetches both neighbours, indices leave their register two by two: half the time
/// of two gathers of single floats here (loads, not arithmetic, bound a step with a tabulated D).
template <class A>
HEMO_INLINE void gather_pair(const float* table, const stdx::simd<std::int32_t, A>& i,
                             stdx::simd<float, A>& first, stdx::simd<float, A>& second) {
  constexpr int half = static_cast<int>(stdx::simd<float, A>::size()) / 2;
  using Wide = Pack<std::uint64_t, half>;
  using Pairs = Pack<double, half>;
  const Wide two = same_bits<Wide>(i);
  const auto load_pair = [&](std::uint64_t at) {
    double pair;
    __builtin_memcpy(&pair, table + at, sizeof pair);
    return pair;
  };
  std::uint64_t index[half];
  for (int l = 0; l < half; ++l) index[l] = two[l];
  const Wide even =
      same_bits<Wide>(Pairs([&](auto l) { return load_pair(static_cast<std::uint32_t>(index[l])); }));
  const Wide odd = same_bits<Wide>(Pairs([&](auto l) { return load_pair(index[l] >> 32); }));
  first = join_lanes<stdx::simd<float, A>>(even, odd);
  second = same_bits<stdx::simd<float, A>>((even >> 32) | (odd & 0xffffffff00000000u));
}

}  // namespace hemowalk::coarse
