#include <gtest/gtest.h>

#include <cmath>

#include "core/check.hpp"
#include "core/units.hpp"

using namespace hemowalk;

namespace {

std::string refusal(const std::string& text, const std::string& unit, const std::string& usual = "") {
  try {
    parse_quantity(text, unit, usual);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST(Units, ValuesInSi) {
  // Every value is the double nearest to its decimal text: what the same value in SI would be read as.
  EXPECT_EQ(parse_quantity("50 um", "m"), 5e-5);
  EXPECT_EQ(parse_quantity("1 mm2/s", "m2/s"), 1e-6);
  EXPECT_EQ(parse_quantity("5 pN/um", "N/m"), 5e-6);
  EXPECT_EQ(parse_quantity("1 pN um", "N m"), 1e-18);
  EXPECT_EQ(parse_quantity("100 1/s", "1/s"), 100);
  EXPECT_EQ(parse_quantity("100/s", "1/s"), 100);
  EXPECT_EQ(parse_quantity("1025 kg/m3", "kg/m3"), 1025);
  EXPECT_EQ(parse_quantity("0 deg", "rad"), 0);
  EXPECT_NEAR(parse_quantity("180 deg", "rad"), std::acos(-1.0), 1e-13);
  EXPECT_EQ(parse_quantity("10 min", "s"), 600);
  EXPECT_EQ(parse_quantity("300ms", "s"), 0.3);
  EXPECT_EQ(parse_quantity("-2.5e1 pN", "N"), -2.5e-11);
  EXPECT_EQ(parse_quantity("1.2 mPa s", "Pa s"), 1.2e-3);
  EXPECT_EQ(parse_quantity("3 µm", "m"), 3e-6);
  EXPECT_EQ(parse_quantity("35 %", "1"), 0.35);
  EXPECT_EQ(parse_quantity("0.35", "1"), 0.35);
}

TEST(Units, TheSameValueInAnyUnitIsTheSameNumber) {
  for (const double value : {0.1, 0.7, 3.3, 7.82, 12.345678, 50.0, 81.7, 1e3 / 3}) {
    const double um = parse_quantity(format_number(value) + " um", "m");
    EXPECT_EQ(um, parse_quantity(format_number(value) + "e-3 mm", "m")) << value;
    EXPECT_EQ(um, parse_quantity(format_number(value) + "e3 nm", "m")) << value;
    EXPECT_EQ(um, parse_quantity(format_quantity(um, "m"), "m")) << value;  // writing and reading again
  }
  EXPECT_NE(parse_quantity("50 um", "m"), parse_quantity("50.0000000001 um", "m"));
}

TEST(Units, BareNumbersAreRefusedWithASuggestion) {
  const std::string text = refusal("50", "m", "um");
  EXPECT_TRUE(contains(text, "`50` has no unit (a length is expected) write 50 um")) << text;
}

TEST(Units, AWrongDimensionNamesBoth) {
  const std::string text = refusal("5 s", "m");
  EXPECT_TRUE(contains(text, "time") && contains(text, "length")) << text;
  // 1/s and s are reciprocals: udunits2 alone would convert one into the other.
  EXPECT_TRUE(contains(refusal("5 s", "1/s"), "measures a time (a rate is expected)"));
  // An angle is dimensionless to udunits2; not to a reader.
  EXPECT_TRUE(contains(refusal("5 deg", "1"), "measures an angle"));
  EXPECT_NE(refusal("5 %", "rad"), "accepted");
  EXPECT_NE(refusal("5 um", "1"), "accepted");
}

TEST(Units, ThingsThatAreNoQuantities) {
  for (const char* text :
       {"",       " ",           "um",          "abc",           "50 xyz",   "50 10 um", "5 um 3",
        "010 um", "0x10 um",     "nan um",      "inf s",         "1e999 m",  "--5 um",   "5 m @ 3",
        "1,5 um", "5 um from 3", "lg(re 1 um)", "5 lg(re 1 um)", "1_000 um", "1:30 s",   "5 um; rm"})
    EXPECT_NE(refusal(text, "m"), "accepted") << text;
  EXPECT_NE(refusal("5 degC", "K"), "accepted");  // an offset is no factor
  EXPECT_TRUE(contains(refusal("1,5 um", "m"), "1.5 um"));
  EXPECT_TRUE(contains(refusal("010", "1"), "leading zero"));
  EXPECT_TRUE(contains(refusal("inf", "1"), "not finite"));
}

TEST(Units, DecimalNumbers) {
  EXPECT_EQ(parse_number("1e6"), 1e6);
  EXPECT_EQ(parse_number("+2.5"), 2.5);
  EXPECT_EQ(parse_number(".5"), 0.5);
  EXPECT_EQ(parse_number("0"), 0.0);
  EXPECT_EQ(parse_number("0.010"), 0.01);
  for (const char* text :
       {"010", "-010", "00", "0x1", "1e", "e5", "nan", "inf", "1e400", "", "1 2", "1_0", "1,0", "+-1"})
    EXPECT_FALSE(parse_number(text)) << text;
}

TEST(Units, ShortestTextReadsBackExactly) {
  for (const double x : {1.0 / 3, 2.0 / 3, 1e-10, 6.02214076e23, -0.1, 5e-324, 1.7976931348623157e308})
    EXPECT_EQ(parse_number(format_number(x)), x);
  EXPECT_EQ(format_number(-0.0), "0");
}

TEST(Units, FactorsOfUnits) {
  EXPECT_EQ(unit_factor("um", "m"), 1e-6);
  EXPECT_EQ(unit_factor("m", "m"), 1);
  EXPECT_THROW(unit_factor("s", "m"), InputError);
  EXPECT_THROW(unit_factor("", "m"), InputError);
  EXPECT_EQ(dimension_name("pN/um"), "force per length");
  EXPECT_EQ(dimension_name("deg"), "angle");
}
