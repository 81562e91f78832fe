#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "core/yaml/scalars.hpp"
#include "core/yaml/schema.hpp"

namespace hemowalk::yaml {
namespace {

std::string joined(const std::vector<std::string>& words, const char* separator) {
  std::string text;
  for (const std::string& w : words) text += (text.empty() ? "" : separator) + w;
  return text;
}

/// Whether \p node has the outer form of \p field: chooses among the parts of any_of.
bool has_form_of(const Node& node, const Field& field) {
  switch (field.type) {
    case Field::Type::number:
    case Field::Type::integer:
      return node.is_scalar() && looks_like_number(node.text);
    case Field::Type::choice:
      return node.is_scalar() &&
             std::find(field.words.begin(), field.words.end(), node.text) != field.words.end();
    case Field::Type::boolean:
      return node.is_scalar() && (node.text == "true" || node.text == "false");
    case Field::Type::unit:
    case Field::Type::text:
      return node.is_scalar();
    case Field::Type::list:
      return node.is_list();
    case Field::Type::map:
    case Field::Type::dictionary:
    case Field::Type::tagged:
      return node.is_map();
    case Field::Type::anything:
      return true;
    case Field::Type::any_of:
      return std::any_of(field.parts.begin(), field.parts.end(),
                         [&](const Field& f) { return has_form_of(node, f); });
  }
  return false;
}

std::vector<std::string> key_names(const Field& field) {
  std::vector<std::string> names;
  for (const Key& k : field.keys)
    if (std::find(names.begin(), names.end(), k.name) == names.end()) names.push_back(k.name);
  return names;
}

/// Dotted paths of all keys called \p name anywhere in the format: a key at the wrong level is a common slip.
void find_elsewhere(const Field& field, const std::string& name, const std::string& path,
                    std::set<std::string>& found) {
  for (const Key& k : field.keys) {
    const std::string here = path.empty() ? k.name : path + "." + k.name;
    if (k.name == name) found.insert(here);
    find_elsewhere(k.field, name, here, found);
  }
  for (const Field& part : field.parts)
    find_elsewhere(part, name, field.type == Field::Type::dictionary ? path + ".<name>" : path, found);
}

void set_marks(Node& node, const Mark& mark) {
  node.mark = mark;
  for (Node& item : node.items) set_marks(item, mark);
  for (Member& m : node.members) {
    m.mark = mark;
    set_marks(m.value, mark);
  }
}

class Validator {
 public:
  Validator(const Field& format, Problems& problems) : format_(format), problems_(problems) {}

  Value value(const Node& node, const Field& field, const std::string& path) {
    Value result = dispatch(node, field, path);
    result.mark = node.mark;
    return result;
  }

 private:
  void report(const Node& node, const std::string& path, const std::string& text) {
    problems_.add(node.mark, path.empty() ? text : path + ": " + text);
  }
  Value wrong_form(const Node& node, const Field& field, const std::string& path) {
    std::string what = node.is_list() ? "a list" : node.is_map() ? "a map" : quoted(node.text);
    std::string suggestion = "write " + describe(field);
    if (node.type == Node::Type::null) what = "no value";
    if (node.is_scalar() && node.text.empty()) what = "an empty value";
    report(node, path,
           what + " (expected: " + describe(field) + ") " + suggestion_for(node, field, suggestion));
    return {};
  }
  /// The nearest word of a choice, or \p otherwise.
  static std::string suggestion_for(const Node& node, const Field& field, const std::string& otherwise) {
    std::vector<std::string> words = field.words;
    for (const Field& part : field.parts) words.insert(words.end(), part.words.begin(), part.words.end());
    const std::string word = node.is_scalar() ? nearest(node.text, words) : "";
    return word.empty() ? otherwise : "did you mean `" + word + "`?";
  }

  Value dispatch(const Node& node, const Field& field, const std::string& path) {
    if (node.type == Node::Type::null) {
      if (!field.nullable) return wrong_form(node, field, path);
      Value result;
      result.type = Value::Type::null;
      return result;
    }
    switch (field.type) {
      case Field::Type::number:
      case Field::Type::unit:
      case Field::Type::integer:
      case Field::Type::boolean:
      case Field::Type::text:
      case Field::Type::choice:
        return scalar(node, field, path);
      case Field::Type::list:
        return list(node, field, path);
      case Field::Type::map:
        return map(node, field, path);
      case Field::Type::dictionary:
        return dictionary(node, field, path);
      case Field::Type::tagged:
        return tagged(node, field, path);
      case Field::Type::anything:
        return tree(node);
      case Field::Type::any_of:
        for (const Field& part : field.parts)
          if (has_form_of(node, part)) return dispatch(node, part, path);
        return wrong_form(node, field, path);
    }
    return {};
  }

  Value scalar(const Node& node, const Field& field, const std::string& path) {
    if (!node.is_scalar() || node.text.empty() ||
        (field.type == Field::Type::choice && !has_form_of(node, field)))
      return wrong_form(node, field, path);
    try {
      return read_scalar(node.text, field);
    } catch (const InputError& error) {
      report(node, path, error.what());
      return {};
    }
  }

  Value list(const Node& node, const Field& field, const std::string& path) {
    if (!node.is_list()) return wrong_form(node, field, path);
    if (node.items.size() < field.min_items || node.items.size() > field.max_items) {
      report(node, path,
             "a list of " + std::to_string(node.items.size()) + " (expected: " + describe(field) +
                 ") add or remove items");
      return {};
    }
    Value result;
    result.type = Value::Type::list;
    result.items.reserve(node.items.size());
    bool valid = true;
    for (std::size_t i = 0; i < node.items.size(); ++i) {
      result.items.push_back(value(node.items[i], field.parts[0], path + "." + std::to_string(i)));
      valid = valid && result.items.back().type != Value::Type::none;
    }
    if (!valid && field.parts[0].type != Field::Type::map)
      result.type = Value::Type::none;  // no half-read vectors
    return result;
  }

  static Value tree(const Node& node) {
    Value result;
    result.mark = node.mark;
    result.type = node.is_list()     ? Value::Type::list
                  : node.is_map()    ? Value::Type::map
                  : node.is_scalar() ? Value::Type::text
                                     : Value::Type::null;
    result.word = node.text;
    for (const Node& item : node.items) result.items.push_back(tree(item));
    for (const Member& m : node.members) result.members[m.key] = tree(m.value);
    return result;
  }

  Value dictionary(const Node& node, const Field& field, const std::string& path) {
    if (!node.is_map()) return wrong_form(node, field, path);
    Value result;
    result.type = Value::Type::map;
    for (const Member& m : node.members)
      result.members[m.key] = value(m.value, field.parts[0], joined_path(path, m.key));
    return result;
  }

  Value tagged(const Node& node, const Field& field, const std::string& path) {
    if (!node.is_map() || node.members.size() != 1) return wrong_form(node, field, path);
    const Member& m = node.members[0];
    for (const Key& k : field.keys)
      if (k.name == m.key) {
        Value result;
        result.type = Value::Type::map;
        result.members[m.key] = value(m.value, k.field, joined_path(path, m.key));
        return result;
      }
    unknown_key(m, field, path);
    return {};
  }

  void unknown_key(const Member& m, const Field& field, const std::string& path) {
    const std::vector<std::string> names = key_names(field);
    const std::string near = nearest(m.key, names);
    std::string suggestion = "the keys here are " + joined(names, ", ");
    if (!near.empty()) {
      suggestion = "did you mean `" + near + "`?";
    } else {
      std::set<std::string> elsewhere;
      find_elsewhere(format_, m.key, "", elsewhere);
      if (!elsewhere.empty() && elsewhere.size() < 4)
        suggestion = "it belongs to " + joined({elsewhere.begin(), elsewhere.end()}, " or ");
    }
    problems_.add(m.mark, "unknown key " + quoted(joined_path(path, m.key)) + " (not part of this format) " +
                              suggestion);
  }

  static std::string joined_path(const std::string& path, const std::string& key) {
    return path.empty() ? key : path + "." + key;
  }

  enum class Applies { yes, no, unknown };
  static Applies applies(const Key& key, const Value& map) {
    for (const Key::Condition& c : key.conditions) {
      const auto sibling = map.members.find(c.sibling);
      if (sibling == map.members.end() || sibling->second.type != Value::Type::text) return Applies::unknown;
      if (std::find(c.words.begin(), c.words.end(), sibling->second.word) == c.words.end())
        return Applies::no;
    }
    return Applies::yes;
  }

  /// Rewrites `law: {skalak: {Gs: 5 pN/um}}` as `law: skalak, Gs: 5 pN/um`.
  Node with_parameters_beside(const Node& node, const Field& field) {
    Node result = node;
    for (const Key& k : field.keys) {
      if (k.field.type != Field::Type::choice) continue;
      const bool decides = std::any_of(field.keys.begin(), field.keys.end(), [&](const Key& other) {
        return std::any_of(other.conditions.begin(), other.conditions.end(),
                           [&](const Key::Condition& c) { return c.sibling == k.name; });
      });
      Node* chosen = result.find(k.name);
      if (!decides || !chosen || !chosen->is_map() || chosen->members.size() != 1) continue;
      const Member pair = chosen->members[0];
      if (!pair.value.is_map() && pair.value.type != Node::Type::null) continue;
      Node word = yaml::scalar(pair.key);
      word.mark = pair.mark;
      *chosen = word;
      for (const Member& parameter : pair.value.members) {
        if (result.find(parameter.key))
          problems_.add(parameter.mark, "duplicate key " + quoted(parameter.key) + " (also given beside `" +
                                            k.name + "`) remove one of them");
        else
          result.members.push_back(parameter);
      }
    }
    return result;
  }

  Value map(const Node& node, const Field& field, const std::string& path) {
    if (!node.is_map()) return wrong_form(node, field, path);
    const Node flat = with_parameters_beside(node, field);
    Value result;
    result.type = Value::Type::map;
    std::set<std::string> used;
    for (const Key& k : field.keys) {
      const Applies a = applies(k, result);
      if (a == Applies::unknown) used.insert(k.name);  // the sibling is invalid: that is reported already
      if (a != Applies::yes) continue;
      used.insert(k.name);
      if (auto v = member(flat, k, path); v.type != Value::Type::none) {
        v.physical = k.physical;
        result.members[k.name] = std::move(v);
      }
    }
    for (const Member& m : flat.members) {
      if (used.count(m.key)) continue;
      const auto known =
          std::find_if(field.keys.begin(), field.keys.end(), [&](const Key& k) { return k.name == m.key; });
      if (known == field.keys.end())
        unknown_key(m, field, path);
      else
        without_effect(m, *known, result, path);
    }
    return result;
  }

  void without_effect(const Member& m, const Key& known, const Value& map, const std::string& path) {
    std::string why;
    for (const Key::Condition& c : known.conditions) {
      const std::string& word = map.members.at(c.sibling).word;
      if (std::find(c.words.begin(), c.words.end(), word) == c.words.end())
        why = "it belongs to " + c.sibling + ": " + joined(c.words, " or ") + ", not " + word;
    }
    problems_.warn(m.mark, quoted(joined_path(path, m.key)) + " has no effect (" + why + ") remove it");
  }

  Value member(const Node& map, const Key& k, const std::string& path) {
    const std::string here = joined_path(path, k.name);
    if (const Node* node = map.find(k.name)) return value(*node, k.field, here);
    if (k.presence == Key::Presence::optional) return {};
    if (k.presence == Key::Presence::required) {
      problems_.add(map.mark, "`" + here + "` is missing (" + k.doc + ") add it: " + describe(k.field));
      return {};
    }
    Problems internal;
    Node node = parse(k.fallback, "default of " + here, internal, false);
    set_marks(node, map.mark);
    Value v = value(node, k.field, here);
    if (!internal.empty()) throw std::logic_error("bad default of " + here);
    v.given = false;
    return v;
  }

  const Field& format_;
  Problems& problems_;
};

}  // namespace

Value validate(const Node& node, const Field& field, Problems& problems) {
  if (node.type == Node::Type::null && problems.empty()) {
    problems.add(node.mark, "the file is empty (a map of keys is expected) start it with `format:`");
    return {};
  }
  // Another format altogether: one clear line instead of a complaint about every key.
  if (const auto k = std::find_if(field.keys.begin(), field.keys.end(),
                                  [](const Key& key) { return key.name == "format"; });
      k != field.keys.end() && node.is_map()) {
    const Node* format = node.find("format");
    const std::string& expected = k->field.words[0];
    if (format && (!format->is_scalar() || format->text != expected)) {
      problems.add(format->mark, "format " + quoted(flow_text(*format)) + " (this reader expects " +
                                     expected + ") is it the right file or version?");
      return {};
    }
  }
  return Validator(field, problems).value(node, field, "");
}

}  // namespace hemowalk::yaml
