#pragma once
/// \file Two kernels for tests of the launch layer, compiled for the device where there is one.

#include "core/device.hpp"

namespace hemowalk::test {

/// at[i] += 1 for i in [0, n).
void add_one(Queue& queue, int* at, std::size_t n);

/// More than the 48 KiB of shared memory that a kernel gets unasked, and less than any device has.
inline constexpr int reversed_length = 50 * 1024 / static_cast<int>(sizeof(int));
/// Reverses \p blocks pieces of reversed_length numbers, each through the shared memory of its block: what a
/// thread writes another one reads, behind a barrier.
void reverse_pieces(Queue& queue, int* at, std::size_t blocks);

}  // namespace hemowalk::test
