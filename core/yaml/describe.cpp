#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "core/units.hpp"
#include "core/yaml/schema.hpp"

namespace hemowalk::yaml {
namespace {

using Json = nlohmann::ordered_json;

std::string bound(double value, const Field& field) {
  return field.unit == "1" ? format_number(value) : format_quantity(value, field.unit);
}

std::string range_text(const Field& field) {
  std::string text;
  if (std::isfinite(field.low)) text += (field.low_open ? " > " : " >= ") + bound(field.low, field);
  if (std::isfinite(field.high))
    text += std::string(text.empty() ? "" : " and") + (field.high_open ? " < " : " <= ") +
            bound(field.high, field);
  return text;
}

std::string join(const std::vector<std::string>& words, const std::string& separator) {
  std::string text;
  for (const std::string& w : words) text += (text.empty() ? "" : separator) + w;
  return text;
}

void add_bounds(Json& json, const Field& field) {
  if (std::isfinite(field.low)) json[field.low_open ? "exclusiveMinimum" : "minimum"] = field.low;
  if (std::isfinite(field.high)) json[field.high_open ? "exclusiveMaximum" : "maximum"] = field.high;
}

Json schema_of(const Field& field);

/// Whether other keys of the map depend on the word at \p name.
bool decides(const Field& map, const std::string& name) {
  for (const Key& k : map.keys)
    for (const Key::Condition& c : k.conditions)
      if (c.sibling == name) return true;
  return false;
}

Json object_of(const Field& field) {
  Json json = {{"type", "object"}, {"properties", Json::object()}, {"additionalProperties", false}};
  Json required = Json::array();
  for (const Key& k : field.keys) {
    Json one = schema_of(k.field);
    if (decides(field, k.name))  // may also be written {word: {keys}}
      one = Json{
          {"anyOf",
           {one, {{"type", "object"}, {"propertyNames", one}, {"minProperties", 1}, {"maxProperties", 1}}}}};
    one["description"] = k.doc;
    if (k.presence == Key::Presence::required && k.conditions.empty() && field.type == Field::Type::map)
      required.push_back(k.name);
    Json& there = json["properties"][k.name];
    if (there.is_null())
      there = one;
    else if (there.contains("anyOf") && there.value("x-conditional", false))
      there["anyOf"].push_back(one);
    else if (there != one)
      there = Json{{"anyOf", Json::array({there, one})}, {"x-conditional", true}};
  }
  for (auto& property : json["properties"])
    if (property.is_object()) property.erase("x-conditional");
  if (!required.empty()) json["required"] = required;
  if (field.type == Field::Type::tagged) json["minProperties"] = json["maxProperties"] = 1;
  return json;
}

Json schema_of(const Field& field) {
  Json json;
  switch (field.type) {
    case Field::Type::number:
      if (field.unit == "1") {
        json = {{"type", "number"}};
        add_bounds(json, field);
      } else {
        json = {{"type", "string"},
                {"pattern", "^[+-]?[0-9.][0-9.eE+-]*\\s*[^0-9\\s].*$|^[+-]?[0-9.]+\\s+1/.*$"},
                {"examples", {"1 " + field.usual}}};
      }
      break;
    case Field::Type::unit:
      json = {{"type", "string"}, {"examples", {field.usual}}};
      break;
    case Field::Type::integer:
      json = {{"type", "integer"}};
      add_bounds(json, field);
      break;
    case Field::Type::boolean:
      json = {{"type", "boolean"}};
      break;
    case Field::Type::text:
      json = {{"type", "string"}, {"minLength", 1}};
      break;
    case Field::Type::choice:
      json = {{"enum", field.words}};
      break;
    case Field::Type::list:
      json = {{"type", "array"}, {"items", schema_of(field.parts[0])}};
      if (field.min_items) json["minItems"] = field.min_items;
      if (field.max_items != Field::any_number) json["maxItems"] = field.max_items;
      break;
    case Field::Type::map:
    case Field::Type::tagged:
      json = object_of(field);
      break;
    case Field::Type::dictionary:
      json = {{"type", "object"}, {"additionalProperties", schema_of(field.parts[0])}};
      break;
    case Field::Type::anything:
      return Json::object();
    case Field::Type::any_of:
      json = {{"anyOf", Json::array()}};
      for (const Field& part : field.parts) json["anyOf"].push_back(schema_of(part));
      break;
  }
  if (field.nullable) json = Json{{"anyOf", Json::array({json, Json{{"type", "null"}}})}};
  return json;
}

std::string escaped(std::string text) {
  for (std::size_t i = 0; (i = text.find('|', i)) != std::string::npos; i += 2) text.insert(i, "\\");
  return text;
}

void add_rows(const Field& field, const std::string& path, std::string& table) {
  for (const Field& part : field.parts) {
    const std::string inside = field.type == Field::Type::dictionary ? path + ".NAME"
                               : field.type == Field::Type::list     ? path + "[]"
                                                                     : path;
    add_rows(part, inside, table);
  }
  for (const Key& k : field.keys) {
    const std::string here = path.empty() ? k.name : path + "." + k.name;
    std::string fallback = k.presence == Key::Presence::required   ? "required"
                           : k.presence == Key::Presence::optional ? ""
                                                                   : "`" + k.fallback + "`";
    if (k.fallback == "{}" || field.type == Field::Type::tagged) fallback = "";
    std::string doc = k.doc;
    for (const Key::Condition& c : k.conditions)
      doc += "; with `" + c.sibling + ": " + join(c.words, "` or `") + "`";
    if (!k.physical) doc += "; does not enter the hash";
    table += "| `" + here + "` | " + escaped(describe(k.field)) + " | " + escaped(fallback) + " | " +
             escaped(doc) + " |\n";
    add_rows(k.field, here, table);
  }
}

}  // namespace

std::string describe(const Field& field) {
  std::string text;
  switch (field.type) {
    case Field::Type::number:
      text = field.unit == "1"
                 ? "number" + range_text(field)
                 : dimension_name(field.unit) + range_text(field) + ", like `1 " + field.usual + "`";
      break;
    case Field::Type::unit:
      text = "unit of " + dimension_name(field.unit) + ", like `" + field.usual + "`";
      break;
    case Field::Type::integer:
      text = "whole number" + range_text(field);
      break;
    case Field::Type::boolean:
      text = "true | false";
      break;
    case Field::Type::text:
      text = "text";
      break;
    case Field::Type::choice:
      text = join(field.words, " | ");
      break;
    case Field::Type::list: {
      std::string count;
      if (field.min_items == field.max_items)
        count = std::to_string(field.min_items) + " x ";
      else if (field.min_items > 0)
        count = "at least " + std::to_string(field.min_items) + " x ";
      text = "list of " + count + "(" + describe(field.parts[0]) + ")";
      break;
    }
    case Field::Type::map: {
      std::vector<std::string> names;
      for (const Key& k : field.keys)
        if (names.empty() || names.back() != k.name) names.push_back(k.name);
      text = names.size() > 6 ? "map of keys" : "{" + join(names, ", ") + "}";
      break;
    }
    case Field::Type::dictionary:
      text = "map of names to " + describe(field.parts[0]);
      break;
    case Field::Type::tagged:
      for (const Key& k : field.keys)
        text += (text.empty() ? "{" : " | {") + k.name + ": " + describe(k.field) + "}";
      break;
    case Field::Type::anything:
      return "any value";
    case Field::Type::any_of:
      for (const Field& part : field.parts) text += (text.empty() ? "" : " | ") + describe(part);
      break;
  }
  return field.nullable ? text + " | null" : text;
}

std::string json_schema(const Field& format, const std::string& title) {
  Json json = {{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", title}};
  json.update(schema_of(format));
  return json.dump(2) + "\n";
}

std::string reference_section(const Field& format, const std::string& title,
                              const std::string& introduction) {
  std::string text =
      "## " + title + "\n\n" + introduction + "\n\n| key | value | default | meaning |\n|---|---|---|---|\n";
  add_rows(format, "", text);
  return text;
}

}  // namespace hemowalk::yaml
