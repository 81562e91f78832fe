#pragma once
/// \file for_each(place, n, body): the ordinary loop, on the host's threads or on the device.
/// body is a named, trivially copyable functor with HEMO_HD operator()(std::size_t i) const.

#include <cstddef>
#include <type_traits>

#include "core/check.hpp"
#include "core/portability.hpp"

namespace hemowalk {

#if defined(__CUDACC__)
template <class Body>
__global__ void for_each_kernel(std::size_t n, Body body) {
  const std::size_t i = blockIdx.x * static_cast<std::size_t>(blockDim.x) + threadIdx.x;
  if (i < n) body(i);
}
#endif

/// Runs body(i) for i in [0, n). Static partition: the same i meets the same thread in every call.
/// Device bodies can only be launched from files listed under KERNELS.
template <class Body>
void for_each(Place place, std::size_t n, const Body& body) {
  if (place == Place::host) {
#pragma omp parallel for schedule(static)
    for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(n); ++i) body(static_cast<std::size_t>(i));
    return;
  }
#if defined(__CUDACC__)
  static_assert(std::is_trivially_copyable_v<Body>, "device bodies are copied into the kernel");
  if (n) for_each_kernel<<<static_cast<unsigned>((n + 255) / 256), 256>>>(n, body);
#else
  throw Error(Exit::usage,
              "place: device asked for (this binary was built without CUDA) build the cuda preset or use "
              "place: host");
#endif
}

}  // namespace hemowalk
