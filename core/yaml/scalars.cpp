#include "core/yaml/scalars.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "core/units.hpp"

namespace hemowalk::yaml {
namespace {

/// Messages repeat the text they refuse; nobody reads a megabyte of it.
std::string shortened_message(const std::string& text) {
  if (text.size() <= 300) return text;
  const auto why = text.rfind(" (");
  return why == std::string::npos ? text.substr(0, 300) : text.substr(0, 60) + "...`" + text.substr(why);
}

void require_range(const std::string& text, const Field& field, double x) {
  const bool low = field.low_open ? x > field.low : x >= field.low;
  const bool high = field.high_open ? x < field.high : x <= field.high;
  require(low && high, [&] {
    return quoted(text) + " is out of range (expected: " + describe(field) + ") choose a value in the range";
  });
}

Value number(const std::string& text, const Field& field) {
  Value result;
  try {
    const bool unit_alone = field.type == Field::Type::unit && !looks_like_number(text);
    result.real = unit_alone ? unit_factor(text, field.unit) : parse_quantity(text, field.unit, field.usual);
  } catch (const InputError& error) {
    throw InputError(shortened_message(error.what()));
  }
  require_range(text, field, result.real);
  result.type = Value::Type::number;
  result.unit = field.unit == "1" ? "" : field.unit;
  return result;
}

Value integer(const std::string& text, const Field& field) {
  const auto x = parse_number(text);
  require(x.has_value(), [&] { return shortened_message(why_no_number(text)); });
  Value result;
  // Long integers do not survive a double: read digits as they stand, 1e6 through the double.
  const char* end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, result.whole);
  if (parsed.ec != std::errc{} || parsed.ptr != end) {
    require(*x == std::floor(*x) && std::abs(*x) <= 9007199254740992.0, [&] {
      return quoted(text) + " is not a whole number (" + describe(field) +
             " is expected) write it without a fraction";
    });
    result.whole = static_cast<std::int64_t>(*x);
  }
  require_range(text, field, *x);
  result.type = Value::Type::integer;
  return result;
}

Value boolean(const std::string& text) {
  Value result;
  result.type = Value::Type::boolean;
  result.flag = text == "true";
  if (text == "true" || text == "false") return result;
  std::string lower;
  for (const char c : text) lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const auto is_one_of = [&](std::initializer_list<const char*> words) {
    return std::any_of(words.begin(), words.end(), [&](const char* w) { return lower == w; });
  };
  const std::string meant = is_one_of({"yes", "on", "y", "1", "true"})    ? "true"
                            : is_one_of({"no", "off", "n", "0", "false"}) ? "false"
                                                                          : "true or false";
  throw InputError(quoted(text) +
                   " is not a truth value (some readers take it as one, others as text) write " + meant);
}

}  // namespace

Value read_scalar(const std::string& text, const Field& field) {
  switch (field.type) {
    case Field::Type::number:
    case Field::Type::unit:
      return number(text, field);
    case Field::Type::integer:
      return integer(text, field);
    case Field::Type::boolean:
      return boolean(text);
    default:
      break;
  }
  Value result;
  result.type = Value::Type::text;
  result.word = text;
  const auto word = std::find(field.words.begin(), field.words.end(), text);
  result.index = static_cast<std::size_t>(word - field.words.begin());
  return result;
}

bool looks_like_number(const std::string& text) {
  if (text.empty()) return false;
  const auto digit = [](char x) { return x >= '0' && x <= '9'; };
  const char c = text[0], d = text.size() > 1 ? text[1] : ' ';
  return digit(c) || ((c == '-' || c == '+' || c == '.') && (digit(d) || d == '.'));
}

std::string quoted(const std::string& text) {
  return "`" + (text.size() > 60 ? text.substr(0, 57) + "..." : text) + "`";
}

}  // namespace hemowalk::yaml
