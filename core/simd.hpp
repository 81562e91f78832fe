#pragma once
/// \file Pack<T, W>: W numbers of type T handled by one instruction. Host-only; device code uses plain T.
/// Physics bodies are templates on their number type and run with float, double or a Pack.

#include <cstddef>
#include <experimental/simd>

namespace hemowalk {

namespace stdx = std::experimental;

/// The register type that best holds \p W numbers on this machine.
template <class T, int W>
using Pack = stdx::simd<T, stdx::simd_abi::deduce_t<T, W>>;

template <class T, int W>
inline Pack<T, W> load(const T* aligned) {
  return Pack<T, W>(aligned, stdx::element_aligned);
}
template <class T, int W>
inline void store(const Pack<T, W>& value, T* out) {
  value.copy_to(out, stdx::element_aligned);
}

}  // namespace hemowalk
