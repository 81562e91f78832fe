#include "core/units.hpp"

#include <udunits2.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "core/check.hpp"

namespace hemowalk {
namespace {

struct FreeUnit {
  void operator()(ut_unit* u) const { ut_free(u); }
};
using Unit = std::unique_ptr<ut_unit, FreeUnit>;

/// The unit system, read once. udunits2 is not thread-safe: every use holds the lock.
class UnitSystem {
 public:
  static UnitSystem& get() {
    static UnitSystem system;
    return system;
  }
  /// nullptr when \p text is no unit.
  Unit parse(const std::string& text) { return Unit(ut_parse(system_, text.c_str(), UT_UTF8)); }
  std::mutex mutex;

 private:
  UnitSystem() {
    ut_set_error_message_handler(ut_ignore);
    system_ = ut_read_xml(nullptr);
    if (!system_)
      throw Error(Exit::internal, "the unit database cannot be read (udunits2) install libudunits2-data");
    if (const Unit degree = parse("degree")) ut_map_name_to_unit("deg", UT_ASCII, degree.get());
  }
  ut_system* system_ = nullptr;
};

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// Length of the decimal number at the start of \p text: [+-] digits [. digits] [e [+-] digits].
std::size_t number_length(std::string_view text) {
  std::size_t i = 0;
  const auto digits = [&] {
    const std::size_t start = i;
    while (i < text.size() && text[i] >= '0' && text[i] <= '9') ++i;
    return i - start;
  };
  if (i < text.size() && (text[i] == '+' || text[i] == '-')) ++i;
  std::size_t count = digits();
  if (i < text.size() && text[i] == '.') {
    ++i;
    count += digits();
  }
  if (count == 0) return 0;
  const std::size_t mantissa = i;
  if (i < text.size() && (text[i] == 'e' || text[i] == 'E')) {
    ++i;
    if (i < text.size() && (text[i] == '+' || text[i] == '-')) ++i;
    if (digits() == 0) return mantissa;
  }
  return i;
}

bool has_leading_zero(std::string_view number) {
  if (!number.empty() && (number[0] == '+' || number[0] == '-')) number.remove_prefix(1);
  return number.size() > 1 && number[0] == '0' && number[1] >= '0' && number[1] <= '9';
}

/// udunits2 accepts factors, origins and logarithms inside a unit ("10 um", "m @ 5", "lg(re 1 mW)"); files
/// must not.
bool has_stray_number_or_operator(std::string_view unit) {
  char before = ' ';
  for (std::size_t i = 0; i < unit.size(); ++i) {
    const char c = unit[i];
    const bool is_digit = c >= '0' && c <= '9';
    const bool starts_token =
        before == ' ' || before == '/' || before == '*' || before == '.' || before == '(';
    if (is_digit && starts_token) {
      const bool one = c == '1' && (i + 1 == unit.size() || unit[i + 1] == '/' || unit[i + 1] == ' ');
      if (!one) return true;
    }
    if (c == '@' || c == '#' || c == '\'' || c == '"') return true;
    before = c;
  }
  return false;
}

struct Dimension {
  const char *unit, *name;
};
constexpr std::array<Dimension, 20> dimensions{{{"1", "dimensionless number"},
                                                {"m", "length"},
                                                {"m2", "area"},
                                                {"m3", "volume"},
                                                {"s", "time"},
                                                {"kg", "mass"},
                                                {"1/s", "rate"},
                                                {"1/m", "curvature"},
                                                {"m/s", "velocity"},
                                                {"m/s2", "acceleration"},
                                                {"m2/s", "diffusivity or kinematic viscosity"},
                                                {"m3/s", "flow rate"},
                                                {"kg/m3", "density"},
                                                {"N", "force"},
                                                {"N/m", "force per length"},
                                                {"Pa", "pressure"},
                                                {"Pa s", "dynamic viscosity"},
                                                {"Pa/m", "pressure gradient"},
                                                {"J", "energy or bending modulus"},
                                                {"N s/m", "drag coefficient"}}};

bool measures_angle(const std::string& unit) {
  static const std::array<const char*, 7> words{"rad", "radian", "radians", "deg", "degree", "degrees", "°"};
  for (const char* w : words)
    if (unit == w) return true;
  return false;
}

/// Same dimension, reciprocals excluded (udunits2 alone would convert s to Hz by taking 1/x).
bool same_dimension(ut_unit* a, ut_unit* b) {
  const Unit quotient(ut_divide(a, b));
  return quotient && ut_is_dimensionless(quotient.get());
}

std::string dimension_of(UnitSystem& system, const std::string& text) {
  if (measures_angle(text)) return "angle";
  const Unit unit = system.parse(text);
  if (!unit) return "`" + text + "`";
  for (const Dimension& d : dimensions)
    if (same_dimension(unit.get(), system.parse(d.unit).get())) return d.name;
  char buffer[128];
  const int n = ut_format(unit.get(), buffer, sizeof buffer, UT_ASCII | UT_DEFINITION);
  return n > 0 && n < static_cast<int>(sizeof buffer) ? std::string(buffer) : text;
}

/// 14 significant digits: below them, the way a value was written shows, not its physics.
double round_to_14_digits(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.13e", value);
  return std::strtod(buffer, nullptr);
}

std::string a(const std::string& noun) {
  return (std::string("aeiou").find(noun[0]) != std::string::npos ? "an " : "a ") + noun;
}

std::string example(const std::string& number, const std::string& si_unit, const std::string& usual) {
  return number + " " + (usual.empty() ? si_unit : usual);
}

}  // namespace

std::optional<double> parse_number(const std::string& raw) {
  const std::string_view text = trim(raw);
  if (text.empty() || number_length(text) != text.size() || has_leading_zero(text)) return {};
  double value = 0;
  const char* first = text.data() + (text[0] == '+' ? 1 : 0);
  const auto result = std::from_chars(first, text.data() + text.size(), value);
  if (result.ec != std::errc{} || result.ptr != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

std::string why_no_number(const std::string& raw) {
  const std::string text(trim(raw));
  const std::string shown = text.empty() ? "an empty value" : "`" + text + "`";
  std::string lower;
  for (const char c : text) lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (has_leading_zero(text))
    return shown + " has a leading zero (some readers take it as octal) write the decimal number without it";
  if (lower.rfind("0x", 0) == 0 || lower.rfind("0o", 0) == 0)
    return shown + " is not decimal (numbers are decimal here) write it with digits 0-9";
  if (lower.find("nan") != std::string::npos || lower.find("inf") != std::string::npos)
    return shown + " is not finite (physics needs a finite number) write a number";
  if (const auto comma = text.find(','); comma != std::string::npos) {
    std::string with_point = text;
    with_point[comma] = '.';
    if (number_length(with_point) == with_point.size())
      return shown + " has a decimal comma (a point is expected) write " + with_point;
  }
  if (!text.empty() && number_length(text) == text.size())
    return shown + " is out of range (it does not fit a double) write a representable number";
  if (lower == "yes" || lower == "no" || lower == "on" || lower == "off" || lower == "true" ||
      lower == "false")
    return shown + " is a truth value (a number is expected) write a number";
  return shown + " is not a number (digits, point and exponent) write it like 0.5 or 1e-3";
}

double unit_factor(const std::string& unit, const std::string& si_unit) {
  if (unit == si_unit) return 1;
  UnitSystem& system = UnitSystem::get();
  const std::lock_guard lock(system.mutex);
  const std::string text = !unit.empty() && unit[0] == '/' ? "1" + unit : unit;
  const Unit from = has_stray_number_or_operator(text) ? nullptr : system.parse(text);
  const std::string wanted = dimension_of(system, si_unit);
  require(from != nullptr, [&] {
    return "`" + unit + "` is not a unit (" + a(wanted) + " is expected) write it like " + si_unit;
  });
  const Unit to = system.parse(si_unit);
  const bool angles_agree = measures_angle(unit) == measures_angle(si_unit);
  require(angles_agree && same_dimension(from.get(), to.get()), [&] {
    return "`" + unit + "` measures " + a(dimension_of(system, text)) + " (" + a(wanted) + " is expected) " +
           (si_unit == "1" ? "write it without a unit" : "use a unit like " + si_unit);
  });
  const std::unique_ptr<cv_converter, void (*)(cv_converter*)> converter(
      ut_get_converter(from.get(), to.get()), cv_free);
  const double zero = converter ? cv_convert_double(converter.get(), 0) : 1;
  require(zero == 0, [&] {
    return "`" + unit + "` has an offset or a logarithm (a plain factor is expected) use " + si_unit;
  });
  return cv_convert_double(converter.get(), 1);
}

double parse_quantity(const std::string& raw, const std::string& si_unit, const std::string& usual) {
  const std::string text(trim(raw));
  const std::size_t length = number_length(text);
  const std::string number = text.substr(0, length), unit(trim(std::string_view(text).substr(length)));
  const auto value = parse_number(number);
  if (!value) {
    const std::string plain = why_no_number(length ? number : text);
    if (si_unit == "1" || length) throw InputError(plain);
    throw InputError(plain.substr(0, plain.find(" (")) + " (" + a(dimension_name(si_unit)) +
                     " is expected) write it like " + example("1", si_unit, usual));
  }
  if (unit.empty()) {
    require(si_unit == "1", [&] {
      return "`" + text + "` has no unit (" + a(dimension_name(si_unit)) + " is expected) write " +
             example(number, si_unit, usual);
    });
    return *value;
  }
  if (unit[0] == ',' && number_length(unit.substr(1)) > 0)
    throw InputError("`" + text + "` has a decimal comma (a point is expected) write " + number + "." +
                     unit.substr(1));
  double factor = 0;
  try {
    if (const auto again = number_length(unit); again && si_unit == "1" && again == unit.size())
      throw InputError("`" + text + "` holds two numbers (one is expected) separate list items with a comma");
    factor = unit_factor(unit, si_unit);
  } catch (const InputError& e) {
    if (si_unit == "1" && std::string(e.what()).find("is not a unit") != std::string::npos)
      throw InputError("`" + text + "` is not a number (a dimensionless number is expected) write " + number);
    throw;
  }
  const double result = round_to_14_digits(*value * factor);
  require(std::isfinite(result),
          [&] { return "`" + text + "` is out of range (it does not fit a double in " + si_unit + ")"; });
  return result;
}

std::string dimension_name(const std::string& unit) {
  UnitSystem& system = UnitSystem::get();
  const std::lock_guard lock(system.mutex);
  return dimension_of(system, unit);
}

std::string format_number(double value) {
  if (value == 0) return "0";  // one text for both zeros
  char buffer[40];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  return {buffer, result.ptr};
}

std::string format_quantity(double value, const std::string& si_unit) {
  return si_unit == "1" || si_unit.empty() ? format_number(value) : format_number(value) + " " + si_unit;
}

}  // namespace hemowalk
