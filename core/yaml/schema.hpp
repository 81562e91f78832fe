#pragma once
/// \file The schema layer: one table per file format gives validation, defaults, JSON Schema and the
/// reference page.
///
///   static const Field format = map({
///       with_default("dx", quantity("m", "um").above(0), "0.5 um", "lattice spacing"),
///       required("law", choice({"paper", "rigid"}), "membrane law"),
///       with_default("B", quantity("N/m", "pN/um"), "5 pN/um", "strain hardening").when("law", {"paper"})});
///   const Value v = validate(node, format, problems);    // defaults filled in, SI values

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "core/yaml/document.hpp"

namespace hemowalk::yaml {

struct Key;

/// What a value may be.
struct Field {
  enum class Type {
    number,      ///< `unit` "1": bare; else a value with a unit
    unit,        ///< a unit alone ("um"); value: its size in `unit`
    integer,     ///< 1e6 is one
    boolean,     ///< true or false, nothing else
    text,        ///< any text
    choice,      ///< one of `words`
    list,        ///< of parts[0], min_items to max_items
    map,         ///< exactly `keys`
    dictionary,  ///< any keys, values like parts[0]
    tagged,      ///< a map with exactly one of `keys`: {robin: 1 mm/s}
    any_of,      ///< the first of `parts` that has the value's form
    anything,    ///< any tree of texts: checked elsewhere
  };
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  static constexpr std::size_t any_number = std::numeric_limits<std::size_t>::max();

  Type type = Type::text;
  std::string unit = "1", usual;  ///< SI unit; the unit messages suggest
  double low = -infinity, high = infinity;
  bool low_open = false, high_open = false;
  bool nullable = false;  ///< `null` allowed: not known (a NaN inside)
  std::vector<std::string> words;
  std::vector<Field> parts;
  std::size_t min_items = 0, max_items = any_number;
  std::vector<Key> keys;

  Field above(double bound) const;
  Field at_least(double bound) const;
  Field below(double bound) const;
  Field at_most(double bound) const;
  Field or_null() const;
};

/// A key of a map: its value, default, meaning and when it applies.
struct Key {
  enum class Presence { required, optional, defaulted };
  struct Condition {
    std::string sibling;  ///< a choice earlier in the same map
    std::vector<std::string> words;
  };

  std::string name;
  Field field;
  Presence presence = Presence::required;
  std::string fallback;  ///< YAML text of the default
  std::string doc;
  std::vector<Condition>
      conditions;        ///< all must hold; a key may be listed several times under different ones
  bool physical = true;  ///< false: does not change results, left out of the hash

  /// The key acts only if \p sibling has one of \p words; else it is dropped with a warning.
  /// A sibling written as {word: {keys}} means the word and the keys beside it.
  Key when(const std::string& sibling, std::vector<std::string> words) const;
  Key not_physical() const;
};

Field quantity(const std::string& si_unit, const std::string& usual);
Field unit_name(const std::string& si_unit, const std::string& usual);
Field number();
Field integer();
Field boolean();
Field text();
Field choice(std::vector<std::string> words);
Field list_of(const Field& item, std::size_t min_items = 0, std::size_t max_items = Field::any_number);
Field map_of(std::vector<Key> keys);
Field dictionary(const Field& value);
Field tagged(std::vector<Key> keys);
Field any_of(std::vector<Field> parts);
Field anything();

Key required(const std::string& name, const Field& field, const std::string& doc);
Key optional(const std::string& name, const Field& field, const std::string& doc);
Key with_default(const std::string& name, const Field& field, const std::string& fallback,
                 const std::string& doc);
/// The `format:` key every file starts with.
Key format_key(const std::string& format);

/// A validated value: SI numbers, defaults filled in, map keys sorted.
struct Value {
  enum class Type { none, null, boolean, integer, number, text, list, map };

  Type type = Type::none;  ///< none: was invalid, the problem is reported
  bool flag = false;
  std::int64_t whole = 0;
  double real = 0;
  std::string word;       ///< text
  std::string unit;       ///< number: SI unit, "" for dimensionless
  std::size_t index = 0;  ///< choice: position among the words
  std::vector<Value> items;
  std::map<std::string, Value> members;
  Mark mark;
  bool given = true;     ///< written in the file, not a default
  bool physical = true;  ///< counts in the hash

  /// Value at "domain.size.0"; nullptr if absent or invalid.
  const Value* find(const std::string& path) const;
  /// Value at \p path, which must be there. \throws std::logic_error.
  const Value& operator[](const std::string& path) const;
  bool has(const std::string& path) const { return find(path) != nullptr; }

  /// Contents, type checked. \throws std::logic_error. number() of null is NaN.
  double number() const;
  std::int64_t integer() const;
  bool boolean() const;
  const std::string& text() const;
  std::vector<double> numbers() const;
  /// The enumerator at the position of the chosen word.
  template <class Enum>
  Enum choice() const {
    text();
    return static_cast<Enum>(index);
  }
};

/// Checks \p node against \p field, reporting all problems with their place.
Value validate(const Node& node, const Field& field, Problems& problems);

/// Applies "dotted.key=value" texts to a document before validation; list items by number (domain.size.1).
void apply_overrides(Node& root, const Field& field, const std::vector<std::string>& overrides,
                     Problems& problems);
/// Sets one value. Intermediate maps are made, lists start from their default. Problems go to value.mark.
bool set_path(Node& root, const Field& field, const std::string& dotted, const Node& value,
              Problems& problems);
/// True if \p dotted can be a key of the format; else adds a problem with the nearest one at \p mark.
bool check_path(const Field& field, const std::string& dotted, const Mark& mark, Problems& problems);

/// Block YAML with sorted keys, SI values and all defaults: equal meaning, equal text.
std::string canonical_text(const Value& value);
/// The same without the keys that do not change results: what is hashed.
std::string physical_text(const Value& value);

/// JSON Schema (draft 2020-12) of a format, for editors.
std::string json_schema(const Field& format, const std::string& title);
/// One format of the reference page: a Markdown table of its keys.
std::string reference_section(const Field& format, const std::string& title, const std::string& introduction);
/// "slab | periodic | map", "length > 0": a field in words.
std::string describe(const Field& field);

}  // namespace hemowalk::yaml
