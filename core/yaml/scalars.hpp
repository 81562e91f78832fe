#pragma once
/// \file One text and its meaning: numbers with units, whole numbers, truth values, words. Internal to the
/// schema layer.

#include <string>

#include "core/yaml/schema.hpp"

namespace hemowalk::yaml {

/// The value of \p text. \throws InputError as "problem (why) suggestion".
Value read_scalar(const std::string& text, const Field& field);

/// True if \p text begins like a number: what follows may still be wrong.
bool looks_like_number(const std::string& text);

/// \p text between backquotes, long ones shortened.
std::string quoted(const std::string& text);

}  // namespace hemowalk::yaml
