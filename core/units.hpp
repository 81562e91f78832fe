#pragma once
/// \file Units at the edge of the program: text with units in, SI numbers inside (udunits2 underneath).

#include <optional>
#include <string>

namespace hemowalk {

/// A plain decimal number: sign, digits, point, exponent. Nothing if \p text is anything else, a number with
/// a leading zero (010: octal to some readers), a hexadecimal number, NaN, infinite or out of range.
std::optional<double> parse_number(const std::string& text);

/// What `parse_number` has against \p text, as "problem (why) suggestion"; only for texts it refuses.
std::string why_no_number(const std::string& text);

/// The value of "50 um" in \p si_unit ("m"); for \p si_unit "1" a bare number or per cent.
/// Rounded to 14 significant digits, so that 50 um, 0.05 mm and 5e-5 m are the same number.
/// \p usual is the unit that error messages suggest. \throws InputError as "problem (why) suggestion".
double parse_quantity(const std::string& text, const std::string& si_unit, const std::string& usual = "");

/// The value of one \p unit ("um") in \p si_unit. \throws InputError.
double unit_factor(const std::string& unit, const std::string& si_unit);

/// "length", "rate", ...: what a unit measures; the unit itself in base units if it has no common name.
std::string dimension_name(const std::string& unit);

/// The shortest text that reads back as the same number: "5e-05", "2", "nan".
std::string format_number(double value);
/// "5e-05 m"; no unit for dimensionless "1".
std::string format_quantity(double value, const std::string& si_unit);

}  // namespace hemowalk
