#pragma once
/// \file How a fluid's state is laid out in a checkpoint: a header, then [nz][ny][direction][nx] populations.

#include <cstdint>

namespace hemowalk::lbm {

inline constexpr std::uint64_t state_magic = 0x31'4d42'4c2d'4d48;  // "HM-LBM1"

struct StateHeader {
  std::uint64_t magic = state_magic;
  std::uint32_t real_size = 0, swapped = 0;
  std::int32_t nx = 0, ny = 0, nz = 0, reserved = 0;
  std::int64_t steps = 0;
};

}  // namespace hemowalk::lbm
