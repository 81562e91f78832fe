#pragma once
/// \file Philox 4x32-10 for all lanes at once; bit for bit the numbers of core/random.hpp (random_bits).
///
/// A 32-bit word is kept in a 64-bit lane: its upper half holds whatever the last product left there and is
/// masked where the next product reads it. That saves the shuffles that merge even and odd 32-bit lanes.

#include <cstdint>

#include "coarse/scalar_lanes.hpp"
#include "core/random.hpp"

namespace hemowalk::coarse {

/// Four words per lane.
template <class L>
struct Words {
  typename L::Bits word[4];
};

namespace detail {

inline constexpr std::uint64_t philox_multiplier[2] = {0xD2511F53u, 0xCD9E8D57u};
inline constexpr std::uint32_t philox_weyl[2] = {0x9E3779B9u, 0xBB67AE85u};

/// Ten rounds on H independent halves; the rounds of different halves overlap in the pipeline.
template <int H, class Wide>
HEMO_HD HEMO_INLINE void philox_rounds(Wide (&c)[4][H], std::uint64_t seed) {
  const Wide low = 0xffffffffu;
  auto k0 = static_cast<std::uint32_t>(seed), k1 = static_cast<std::uint32_t>(seed >> 32);
#pragma GCC unroll 10
  for (int round = 0; round < 10; ++round) {
#pragma GCC unroll 4
    for (int h = 0; h < H; ++h) {
      const Wide p0 = (c[0][h] & low) * Wide(philox_multiplier[0]);
      const Wide p1 = (c[2][h] & low) * Wide(philox_multiplier[1]);
      c[0][h] = (p1 >> 32) ^ c[1][h] ^ Wide(k0);
      c[2][h] = (p0 >> 32) ^ c[3][h] ^ Wide(k1);
      c[1][h] = p1;
      c[3][h] = p0;
    }
    k0 += philox_weyl[0];
    k1 += philox_weyl[1];
  }
}

}  // namespace detail

/// The 128 bits of (seed, stream, first_id + offset, step) for every lane. \p offset < 2^32 - first_id.
template <class L>
HEMO_HD HEMO_INLINE Words<L> lane_bits(std::uint64_t seed, Stream stream, std::uint64_t first_id,
                                       const typename L::Bits& offset, std::uint64_t step) {
  if constexpr (L::width == 1) {
    const RandomBits b = random_bits(seed, stream, first_id + offset, step);
    return {{b.word[0], b.word[1], b.word[2], b.word[3]}};
  } else {
    using Wide = typename L::Wide;
    Wide c[4][2];
    part_lanes(offset, c[0][0], c[0][1]);
    for (int h = 0; h < 2; ++h) {
      c[0][h] += first_id;
      c[1][h] = c[0][h] >> 32;
      c[2][h] = Wide(step & 0xffffffffu);
      c[3][h] = Wide(((step >> 32) & 0xffffffu) | (static_cast<std::uint64_t>(stream) << 24));
    }
    detail::philox_rounds<2>(c, seed);
    Words<L> out;
    for (int w = 0; w < 4; ++w) out.word[w] = join_lanes<typename L::Bits>(c[w][0], c[w][1]);
    return out;
  }
}

}  // namespace hemowalk::coarse
