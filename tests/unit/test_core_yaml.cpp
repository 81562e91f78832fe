#include <gtest/gtest.h>

#include <cmath>

#include "core/yaml/schema.hpp"

using namespace hemowalk;
using namespace hemowalk::yaml;

namespace {

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const auto& line : lines) text += line + "\n";
  return text;
}

/// A small format with one of everything.
const Field& format() {
  static const Field f = map_of({
      format_key("test/1"),
      with_default("length", quantity("m", "um").above(0), "1 um", "a length"),
      with_default("count", integer().at_least(1), "3", "a count"),
      with_default("flag", boolean(), "false", "a flag"),
      with_default("law", choice({"paper", "skalak"}), "paper", "a law"),
      with_default("C", quantity("N/m", "pN/um"), "5 pN/um", "tension").when("law", {"paper"}),
      with_default("C", number(), "1", "ratio").when("law", {"skalak"}),
      with_default("Gs", quantity("N/m", "pN/um"), "2 pN/um", "shear").when("law", {"skalak"}),
      with_default("cap", any_of({choice({"off"}), number().above(0)}), "off", "a cap"),
      with_default("size", list_of(quantity("m", "um"), 3, 3), "[1 um, 2 um, 3 um]", "a size"),
      optional("note", text(), "a text").not_physical(),
      with_default("inner", map_of({with_default("tau", number(), "2", "tau")}), "{}", "inside"),
      with_default("kinds", dictionary(map_of({required("shape", text(), "a shape")})), "{}", "names"),
  });
  return f;
}

struct Outcome {
  Value value;
  std::string errors, warnings;
};

Outcome run(const std::string& body, const std::vector<std::string>& overrides = {}) {
  Problems problems;
  Outcome out;
  try {
    Node root = parse("format: test/1\n" + body, "f.yaml", problems);
    apply_overrides(root, format(), overrides, problems);
    out.value = validate(root, format(), problems);
  } catch (const InvalidDocument& error) {
    out.errors = error.what();
    return out;
  }
  out.errors = joined(problems.errors());
  out.warnings = joined(problems.warnings());
  return out;
}

}  // namespace

TEST(Yaml, DefaultsAreFilledInAndTextIsCanonical) {
  const auto a = run("");
  ASSERT_EQ(a.errors, "");
  EXPECT_EQ(a.value["length"].number(), 1e-6);
  EXPECT_EQ(a.value["count"].integer(), 3);
  EXPECT_EQ(a.value["C"].number(), 5e-6);
  EXPECT_EQ(a.value["inner.tau"].number(), 2);
  EXPECT_FALSE(a.value.has("Gs"));
  const auto b =
      run("# a comment\ninner:   {tau: 2.0}\nlength: 0.001 mm\nsize: [1000 nm, 2um, 3.0 um]   # more\ncount: "
          "3\n");
  ASSERT_EQ(b.errors, "");
  EXPECT_EQ(canonical_text(a.value), canonical_text(b.value));
  EXPECT_NE(canonical_text(a.value), canonical_text(run("length: 1.0000001 um").value));
}

TEST(Yaml, CanonicalTextReadsBackAsItself) {
  const auto a =
      run("law: {skalak: {C: 3}}\nkinds: {b: {shape: \"a: b\"}, a: {shape: \"#x\"}}\nnote: "
          "\"two\\nlines\"\ncap: 0.03\n");
  ASSERT_EQ(a.errors, "");
  Problems problems;
  const std::string text = canonical_text(a.value);
  const Value again = validate(parse(text, "again", problems), format(), problems);
  ASSERT_EQ(joined(problems.errors()), "") << text;
  EXPECT_EQ(canonical_text(again), text);
  EXPECT_EQ(again["kinds.b.shape"].text(), "a: b");
  EXPECT_EQ(again["note"].text(), "two\nlines");
}

TEST(Yaml, KeysThatDoNotChangeResultsAreNotHashed) {
  EXPECT_EQ(physical_text(run("note: a").value), physical_text(run("note: b").value));
  EXPECT_NE(canonical_text(run("note: a").value), canonical_text(run("note: b").value));
}

TEST(Yaml, AllProblemsAtOnceWithTheirPlaces) {
  const auto a = run("length: 5\ncount: 2.5\nflag: yes\nlaw: papr\nnonsense: 1\nsize: [1 um, 2 s, 3]\n");
  EXPECT_TRUE(contains(a.errors, "f.yaml:2:9: length: `5` has no unit (a length is expected) write 5 um"))
      << a.errors;
  EXPECT_TRUE(contains(a.errors, "f.yaml:3:8: count: `2.5` is not a whole number")) << a.errors;
  EXPECT_TRUE(contains(a.errors, "f.yaml:4:7: flag: `yes` is not a truth value")) << a.errors;
  EXPECT_TRUE(contains(a.errors, "f.yaml:5:6: law: `papr` (expected: paper | skalak) did you mean `paper`?"))
      << a.errors;
  EXPECT_TRUE(contains(a.errors, "f.yaml:6:1: unknown key `nonsense`")) << a.errors;
  EXPECT_TRUE(contains(a.errors, "f.yaml:7:14: size.1: `s` measures a time (a length is expected)"))
      << a.errors;
  EXPECT_TRUE(contains(a.errors, "f.yaml:7:19: size.2: `3` has no unit")) << a.errors;
  EXPECT_EQ(std::count(a.errors.begin(), a.errors.end(), '\n'), 7) << a.errors;
}

TEST(Yaml, UnknownKeysNameTheNearestOrTheRightPlace) {
  EXPECT_TRUE(contains(run("lenght: 5 um").errors, "did you mean `length`?"));
  EXPECT_TRUE(contains(run("tau: 1").errors, "it belongs to inner.tau"));
  EXPECT_TRUE(contains(run("qqqqqqq: 1").errors, "the keys here are format, length"));
}

TEST(Yaml, DuplicateKeysAreRefusedWithTheSecondPlace) {
  const auto a = run("count: 3\nlength: 2 um\ncount: 4\n");
  EXPECT_TRUE(contains(a.errors, "f.yaml:4:1: duplicate key `count`")) << a.errors;
  EXPECT_TRUE(contains(run("inner: {tau: 1, tau: 1}").errors, "f.yaml:2:17: duplicate key `tau`"));
  EXPECT_TRUE(contains(run("law: {skalak: {C: 1}}\nC: 2").errors, "duplicate key `C`"));
  // What stands under a duplicate key is still checked as YAML, and the first value still as a value.
  EXPECT_TRUE(contains(run("count: 0\ncount: {a: &x 1}").errors, "anchor"));
  EXPECT_TRUE(contains(run("count: 0\ncount: 1").errors, "out of range"));
}

TEST(Yaml, NothingThatReadersDisagreeAbout) {
  EXPECT_TRUE(contains(run("count: 010").errors, "leading zero"));
  EXPECT_TRUE(contains(run("count: 0x10").errors, "not decimal"));
  EXPECT_TRUE(contains(run("inner: {tau: on}").errors, "truth value (a number is expected)"));
  EXPECT_TRUE(contains(run("inner: {tau: .nan}").errors, "not finite"));
  EXPECT_TRUE(contains(run("inner: {tau: -.inf}").errors, "not finite"));
  EXPECT_TRUE(contains(run("inner: {tau: 1e999}").errors, "out of range"));
  for (const char* word : {"yes", "no", "on", "off", "True", "TRUE", "y", "1"})
    EXPECT_TRUE(contains(run(std::string("flag: ") + word).errors, "not a truth value")) << word;
  EXPECT_EQ(run("flag: true").errors, "");
  EXPECT_EQ(run("cap: off").errors, "");  // a word of this format, no truth value
  EXPECT_EQ(run("count: 1e2").value["count"].integer(), 100);
  EXPECT_EQ(run("count: 9007199254740993").value["count"].integer(),
            9007199254740993);  // not through a double
}

TEST(Yaml, KeysDependOnOtherKeys) {
  const auto a = run("law: skalak\nC: 2\n");
  ASSERT_EQ(a.errors, "");
  EXPECT_EQ(a.value["C"].number(), 2);
  EXPECT_EQ(a.value["Gs"].number(), 2e-6);
  EXPECT_EQ(canonical_text(a.value), canonical_text(run("law: {skalak: {C: 2}}").value));
  EXPECT_TRUE(contains(run("law: skalak\nC: 2 pN/um\n").errors,
                       "measures a force per length (a dimensionless number is expected)"));
  const auto b = run("law: paper\nGs: 2 pN/um\n");
  EXPECT_EQ(b.errors, "");
  EXPECT_TRUE(
      contains(b.warnings, "f.yaml:3:1: `Gs` has no effect (it belongs to law: skalak, not paper) remove it"))
      << b.warnings;
  EXPECT_EQ(canonical_text(b.value), canonical_text(run("").value));
  // An invalid law is reported once; the keys that depend on it are not blamed.
  const auto c = run("law: x\nGs: 1 pN/um\nC: 1\n");
  EXPECT_EQ(std::count(c.errors.begin(), c.errors.end(), '\n'), 1) << c.errors;
}

TEST(Yaml, OverridesAreAppliedBeforeValidationAndNamedInErrors) {
  const auto a = run("", {"size.1=7 um", "inner.tau=3", "kinds.rbc.shape=disc", "law=skalak"});
  ASSERT_EQ(a.errors, "");
  EXPECT_EQ(a.value["size.0"].number(), 1e-6);  // the rest of the default list stays
  EXPECT_EQ(a.value["size.1"].number(), 7e-6);
  EXPECT_EQ(a.value["inner.tau"].number(), 3);
  EXPECT_EQ(a.value["kinds.rbc.shape"].text(), "disc");
  const auto b =
      run("", {"size.1=7", "size.3=1 um", "inner.tua=3", "nonsense", "count=[1", "cap=of", "inner=5"});
  EXPECT_TRUE(contains(b.errors, "--set size.1=7: size.1: `7` has no unit")) << b.errors;
  EXPECT_TRUE(
      contains(b.errors, "--set size.3=1 um: `size.3`: no item `3` (the list has 3 items, counted from 0)"))
      << b.errors;
  EXPECT_TRUE(contains(
      b.errors,
      "--set inner.tua=3: unknown key `inner.tua` (not part of this format) did you mean `inner.tau`?"))
      << b.errors;
  EXPECT_TRUE(contains(b.errors, "--set nonsense: no `key=value`")) << b.errors;
  EXPECT_TRUE(contains(b.errors, "--set count=[1: not valid YAML")) << b.errors;
  EXPECT_TRUE(contains(b.errors, "--set cap=of: cap: `of`")) << b.errors;
  EXPECT_TRUE(contains(b.errors, "--set inner=5: inner: `5` (expected: {tau})")) << b.errors;
}

TEST(Yaml, OnlyTheRightFormat) {
  Problems problems;
  validate(parse("format: other/2\nx: 1\n", "f", problems), format(), problems);
  EXPECT_TRUE(contains(joined(problems.errors()), "f:1:9: format `other/2` (this reader expects test/1)"));
  EXPECT_EQ(problems.errors().size(), 1u);
  Problems missing;
  validate(parse("count: 1\n", "f", missing), format(), missing);
  EXPECT_TRUE(contains(joined(missing.errors()), "`format` is missing"));
  for (const char* text : {"", "# nothing\n", "---\n", "just words", "[1, 2]", "5"}) {
    Problems p;
    validate(parse(text, "f", p), format(), p);
    EXPECT_FALSE(p.empty()) << text;
  }
}

TEST(Yaml, WhatIsNotTextIsRefusedWithItsPlace) {
  const auto errors = [](const std::string& text) {
    Problems p;
    try {
      const Node root = parse(text, "f", p);
      validate(root, format(), p);
    } catch (const InvalidDocument& e) {
      return std::string(e.what());
    }
    return joined(p.errors());
  };
  EXPECT_TRUE(contains(errors(std::string("format: test/1\nx\0y: 1", 21)), "f:2:2: a control character"));
  EXPECT_TRUE(contains(errors("format: \xff\xfe"), "f:1:9: a byte that is not UTF-8"));
  EXPECT_TRUE(contains(errors("\xff\xfe"
                              "f\0o\0"),
                       "f:1:1: a byte that is not UTF-8"));
  EXPECT_TRUE(contains(errors("format: test/1\ninner:\n\ttau: 1\n"), "spaces, not tabs"));
  EXPECT_TRUE(contains(errors("format: test/1\na: [1, 2\n"), "not valid YAML"));
  EXPECT_TRUE(contains(errors("format: test/1\n---\nformat: test/1\n"), "second YAML document"));
  EXPECT_TRUE(contains(errors("format: test/1\nnote: !!python/object x\n"), "a tag"));
  EXPECT_TRUE(contains(errors("format: test/1\n? [a, b]\n: 1\n"), "stands as a key"));
  EXPECT_TRUE(contains(errors("format: test/1\nkinds: " + std::string(50, '[') + std::string(50, ']') + "\n"),
                       "levels of nesting"));
  EXPECT_TRUE(
      contains(errors("format: test/1\nkinds: " + std::string(5000, '[') + std::string(5000, ']')), "f:2:"));
  EXPECT_TRUE(contains(errors("format: test/1\nkinds: " + std::string(5000, '[')), "f:2:"));
  EXPECT_TRUE(contains(errors("format: test/1\nkinds: " + std::string(5000, '{') + "\n"), "f:2:"));
  // A billion laughs: aliases are refused one by one and never expanded.
  std::string laughs = "format: test/1\na0: &a0 [x, x]\n";
  for (int i = 1; i < 30; ++i) {
    const std::string n = std::to_string(i), before = std::to_string(i - 1);
    laughs += "a" + n + ": &a" + n + " [*a" + before + ", *a" + before + "]\n";
  }
  EXPECT_TRUE(contains(errors(laughs), "f:3:10: an alias")) << errors(laughs).substr(0, 400);
}

TEST(Yaml, TreesAndTheirFlowText) {
  Problems p;
  const Node n = parse("{a: [1, 'two words', {b: ~}], c: \"x: y\"}", "f", p);
  EXPECT_EQ(flow_text(n), "{a: [1, two words, {b: null}], c: \"x: y\"}");
  EXPECT_EQ(flow_text(parse(flow_text(n), "f", p)), flow_text(n));
  EXPECT_EQ(n.find("a")->items[1].mark.text(), "f:1:9");
}

TEST(Yaml, NearestWords) {
  EXPECT_EQ(nearest("shear_rat", {"density", "shear_rate"}), "shear_rate");
  EXPECT_EQ(nearest("rcb", {"rbc", "platelet"}), "rbc");
  EXPECT_EQ(nearest("viscosity", {"density", "kinematic_viscosity"}), "kinematic_viscosity");
  EXPECT_EQ(nearest("foo", {"flow", "fluid"}), "");
  EXPECT_EQ(nearest("", {"a"}), "");
}

TEST(Yaml, JsonSchemaAndReferenceComeFromTheSameTable) {
  const std::string schema = json_schema(format(), "t"), page = reference_section(format(), "t", "i");
  for (const char* key : {"length", "count", "flag", "law", "Gs", "cap", "size", "inner", "tau", "kinds"}) {
    EXPECT_TRUE(contains(schema, "\"" + std::string(key) + "\"")) << key;
    EXPECT_TRUE(contains(page, std::string(key) + "`")) << key;
  }
  EXPECT_TRUE(contains(schema, "\"additionalProperties\": false"));
  EXPECT_TRUE(contains(page, "| `inner.tau` | number | `2` | tau |")) << page;
}
