#pragma once
/// \file Lanes<W>: the number types of W walkers that move together, and the few operations the physics needs
/// beyond arithmetic. Lanes<1>, here, is plain scalars: the reference, and what a device thread runs. Packs
/// of walkers are in lanes.hpp, to be included before anything that uses them; device code does without.

#include <cmath>
#include <cstdint>
#include <type_traits>

#include "core/portability.hpp"

namespace hemowalk::coarse {

template <int W>
struct Lanes;
template <>
struct Lanes<1> {
  static constexpr int width = 1;
  using Real = float;
  using Int = std::int32_t;
  using Bits = std::uint32_t;
  using Flag = bool;
};

/// The same bits as another type of equal size.
template <class To, class From>
HEMO_HD HEMO_INLINE To same_bits(const From& from) {
  if constexpr (std::is_trivially_copyable_v<To> && std::is_trivially_copyable_v<From>) {
    return __builtin_bit_cast(To, from);
  } else {  // packs that are wider than the machine's registers
    static_assert(sizeof(To) == sizeof(From));
    To to;
    __builtin_memcpy(static_cast<void*>(&to), static_cast<const void*>(&from), sizeof(To));
    return to;
  }
}

HEMO_HD HEMO_INLINE float select(bool flag, float a, float b) { return flag ? a : b; }
HEMO_HD HEMO_INLINE std::int32_t select(bool flag, std::int32_t a, std::int32_t b) { return flag ? a : b; }
HEMO_HD HEMO_INLINE bool any(bool flag) { return flag; }
/// A comparison of Reals as a Flag (the mask type of Int).
HEMO_HD HEMO_INLINE bool flag_of(bool comparison) { return comparison; }
HEMO_HD HEMO_INLINE float to_real(std::int32_t x) { return static_cast<float>(x); }
HEMO_HD HEMO_INLINE float to_real(std::uint32_t x) { return static_cast<float>(x); }
/// Truncates; |x| < 2^31.
HEMO_HD HEMO_INLINE std::int32_t to_int(float x) { return static_cast<std::int32_t>(x); }
HEMO_HD HEMO_INLINE std::int32_t as_signed(std::uint32_t x) { return static_cast<std::int32_t>(x); }
HEMO_HD HEMO_INLINE std::uint32_t as_bits(std::int32_t x) { return static_cast<std::uint32_t>(x); }
/// table[i] and table[i + 1].
HEMO_HD HEMO_INLINE void gather_pair(const float* table, std::int32_t i, float& first, float& second) {
  first = table[i];
  second = table[i + 1];
}

}  // namespace hemowalk::coarse
