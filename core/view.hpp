#pragma once
/// \file View: pointer and length, trivially copyable, so that functors can carry it into a kernel.

#include <cstddef>
#include <type_traits>

#include "core/portability.hpp"

namespace hemowalk {

/// Non-owning window on \p size elements. Never std::span: its members need flags in device code.
template <class T>
struct View {
  T* data = nullptr;
  std::size_t size = 0;

  HEMO_HD T& operator[](std::size_t i) const { return data[i]; }
  HEMO_HD T* begin() const { return data; }
  HEMO_HD T* end() const { return data + size; }
  HEMO_HD operator View<const T>() const requires(!std::is_const_v<T>) { return {data, size}; }
};

}  // namespace hemowalk
