#pragma once
/// \file The D3Q19 lattice. Directions come in opposite pairs (1, 2), (3, 4), ... (17, 18); 0 is rest.
/// The tables are read in constant expressions only, so device code may use them too.

#include <type_traits>
#include <utility>

#include "core/portability.hpp"

namespace hemowalk::lbm {

inline constexpr int directions = 19;
inline constexpr int c[directions][3] = {{0, 0, 0},                                       //
                                         {1, 0, 0}, {-1, 0, 0},  {0, 1, 0},  {0, -1, 0},  //
                                         {0, 0, 1}, {0, 0, -1},                           //
                                         {1, 1, 0}, {-1, -1, 0}, {1, -1, 0}, {-1, 1, 0},  //
                                         {1, 0, 1}, {-1, 0, -1}, {1, 0, -1}, {-1, 0, 1},  //
                                         {0, 1, 1}, {0, -1, -1}, {0, 1, -1}, {0, -1, 1}};

/// Direction opposite to \p i.
HEMO_HD constexpr int opposite(int i) { return i == 0 ? 0 : ((i - 1) ^ 1) + 1; }
/// Lattice weight of direction \p i.
HEMO_HD constexpr double weight(int i) { return i == 0 ? 1.0 / 3 : i < 7 ? 1.0 / 18 : 1.0 / 36; }

/// body(integral_constant 0) ... body(integral_constant N-1), really unrolled.
template <int N, class Body>
HEMO_HD HEMO_INLINE constexpr void unroll(Body&& body) {
  [&]<int... I>(std::integer_sequence<int, I...>) HEMO_INLINE_LAMBDA {
    (body(std::integral_constant<int, I>{}), ...);
  }
  (std::make_integer_sequence<int, N>{});
}

/// c_I . (x, y, z) for odd I, the first of each pair: at most one addition.
template <int I, class N>
HEMO_HD HEMO_INLINE N along(const N& x, const N& y, const N& z) {
  static_assert(I % 2 == 1, "the second of a pair is minus the first");
  constexpr int a = c[I][0], b = c[I][1], d = c[I][2];
  if constexpr (a != 0 && b != 0) {
    return b > 0 ? x + y : x - y;
  } else if constexpr (a != 0 && d != 0) {
    return d > 0 ? x + z : x - z;
  } else if constexpr (b != 0 && d != 0) {
    return d > 0 ? y + z : y - z;
  } else if constexpr (a != 0) {
    return x;
  } else if constexpr (b != 0) {
    return y;
  } else {
    return z;
  }
}

}  // namespace hemowalk::lbm
