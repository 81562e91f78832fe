#include "core/yaml/schema.hpp"

#include <charconv>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "core/units.hpp"

namespace hemowalk::yaml {
namespace {

Field of_type(Field::Type type) {
  Field field;
  field.type = type;
  return field;
}

[[noreturn]] void wrong(const std::string& what) {
  throw std::logic_error("schema and reader disagree: " + what);
}

Key key(Key::Presence presence, const std::string& name, const Field& field, const std::string& fallback,
        const std::string& doc) {
  Key result;
  result.name = name;
  result.field = field;
  result.presence = presence;
  result.fallback = fallback;
  result.doc = doc;
  return result;
}

}  // namespace

Field Field::above(double bound) const {
  Field f = *this;
  f.low = bound;
  f.low_open = true;
  return f;
}
Field Field::at_least(double bound) const {
  Field f = *this;
  f.low = bound;
  f.low_open = false;
  return f;
}
Field Field::below(double bound) const {
  Field f = *this;
  f.high = bound;
  f.high_open = true;
  return f;
}
Field Field::at_most(double bound) const {
  Field f = *this;
  f.high = bound;
  f.high_open = false;
  return f;
}
Field Field::or_null() const {
  Field f = *this;
  f.nullable = true;
  return f;
}

Key Key::when(const std::string& sibling, std::vector<std::string> words) const {
  Key k = *this;
  k.conditions.push_back({sibling, std::move(words)});
  return k;
}
Key Key::not_physical() const {
  Key k = *this;
  k.physical = false;
  return k;
}

Field quantity(const std::string& si_unit, const std::string& usual) {
  Field f = of_type(Field::Type::number);
  f.unit = si_unit;
  f.usual = usual;
  return f;
}
Field unit_name(const std::string& si_unit, const std::string& usual) {
  Field f = quantity(si_unit, usual).above(0);
  f.type = Field::Type::unit;
  return f;
}
Field number() { return of_type(Field::Type::number); }
Field integer() { return of_type(Field::Type::integer); }
Field boolean() { return of_type(Field::Type::boolean); }
Field text() { return of_type(Field::Type::text); }
Field choice(std::vector<std::string> words) {
  Field f = of_type(Field::Type::choice);
  f.words = std::move(words);
  return f;
}
Field list_of(const Field& item, std::size_t min_items, std::size_t max_items) {
  Field f = of_type(Field::Type::list);
  f.parts = {item};
  f.min_items = min_items;
  f.max_items = max_items;
  return f;
}
Field map_of(std::vector<Key> keys) {
  Field f = of_type(Field::Type::map);
  f.keys = std::move(keys);
  return f;
}
Field dictionary(const Field& value) {
  Field f = of_type(Field::Type::dictionary);
  f.parts = {value};
  return f;
}
Field tagged(std::vector<Key> keys) {
  Field f = of_type(Field::Type::tagged);
  f.keys = std::move(keys);
  return f;
}
Field any_of(std::vector<Field> parts) {
  Field f = of_type(Field::Type::any_of);
  f.parts = std::move(parts);
  return f;
}
Field anything() {
  Field f = of_type(Field::Type::anything);
  f.nullable = true;
  return f;
}

Key required(const std::string& name, const Field& field, const std::string& doc) {
  return key(Key::Presence::required, name, field, "", doc);
}
Key optional(const std::string& name, const Field& field, const std::string& doc) {
  return key(Key::Presence::optional, name, field, "", doc);
}
Key with_default(const std::string& name, const Field& field, const std::string& fallback,
                 const std::string& doc) {
  return key(Key::Presence::defaulted, name, field, fallback, doc);
}
Key format_key(const std::string& format) {
  return required("format", choice({format}), "name and version of the format");
}

const Value* Value::find(const std::string& path) const {
  const Value* at = this;
  for (const std::string& part : split_path(path)) {
    if (at->type == Type::map) {
      const auto member = at->members.find(part);
      if (member == at->members.end()) return nullptr;
      at = &member->second;
    } else if (at->type == Type::list) {
      std::size_t i = 0;
      const auto result = std::from_chars(part.data(), part.data() + part.size(), i);
      if (result.ec != std::errc{} || i >= at->items.size()) return nullptr;
      at = &at->items[i];
    } else {
      return nullptr;
    }
  }
  return at->type == Type::none ? nullptr : at;
}

const Value& Value::operator[](const std::string& path) const {
  const Value* value = find(path);
  if (!value) wrong("no value at " + path);
  return *value;
}

double Value::number() const {
  if (type == Type::null) return std::numeric_limits<double>::quiet_NaN();
  if (type == Type::integer) return static_cast<double>(whole);
  if (type != Type::number) wrong("not a number");
  return real;
}
std::int64_t Value::integer() const {
  if (type != Type::integer) wrong("not an integer");
  return whole;
}
bool Value::boolean() const {
  if (type != Type::boolean) wrong("not a truth value");
  return flag;
}
const std::string& Value::text() const {
  if (type != Type::text) wrong("not a text");
  return word;
}
std::vector<double> Value::numbers() const {
  if (type != Type::list) wrong("not a list");
  std::vector<double> result;
  result.reserve(items.size());
  for (const Value& item : items) result.push_back(item.number());
  return result;
}

}  // namespace hemowalk::yaml
