#pragma once
/// \file Messages with numbers, for the parts that build with a compiler alone.

#include <cstdio>
#include <string>

namespace hemowalk {

/// printf into a string.
template <class... Values>
std::string formatted(const char* pattern, Values... values) {
  const int length = std::snprintf(nullptr, 0, pattern, values...);
  std::string text(static_cast<std::size_t>(length > 0 ? length : 0), ' ');
  std::snprintf(text.data(), text.size() + 1, pattern, values...);
  return text;
}

}  // namespace hemowalk
