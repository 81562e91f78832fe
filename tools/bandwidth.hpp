#pragma once
/// \file The bandwidth a benchmark is measured against.

#include <cstddef>

#include "core/device.hpp"

namespace hemowalk {

/// Bytes per second of an update in place of an array of \p bytes (default far beyond any cache), counted as
/// one read and one write; median of \p repetitions.
double measure_bandwidth(Queue& queue, std::size_t bytes = std::size_t{1} << 30, int repetitions = 7);

}  // namespace hemowalk
