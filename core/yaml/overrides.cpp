#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include "core/yaml/schema.hpp"

namespace hemowalk::yaml {
namespace {

std::optional<std::size_t> as_index(const std::string& part) {
  std::size_t i = 0;
  const auto result = std::from_chars(part.data(), part.data() + part.size(), i);
  if (part.empty() || result.ec != std::errc{} || result.ptr != part.data() + part.size()) return {};
  return i;
}

/// One step down a format: the field behind \p part and, for keys with a default, its text.
struct Step {
  const Field* field = nullptr;
  std::string fallback;
};

Step step_into(const Field& field, const std::string& part) {
  switch (field.type) {
    case Field::Type::map:
    case Field::Type::tagged:
      for (const Key& k : field.keys)
        if (k.name == part) return {&k.field, k.presence == Key::Presence::defaulted ? k.fallback : ""};
      return {};
    case Field::Type::dictionary:
      return part.empty() ? Step{} : Step{&field.parts[0], ""};
    case Field::Type::list:
      return as_index(part) ? Step{&field.parts[0], ""} : Step{};
    case Field::Type::any_of:
      for (const Field& alternative : field.parts)
        if (const Step step = step_into(alternative, part); step.field) return step;
      return {};
    default:
      return {};
  }
}

void collect_keys(const Field& field, std::vector<std::string>& names) {
  if (field.type == Field::Type::list) names.push_back("0");
  for (const Key& k : field.keys)
    if (std::find(names.begin(), names.end(), k.name) == names.end()) names.push_back(k.name);
  if (field.type == Field::Type::any_of)
    for (const Field& part : field.parts) collect_keys(part, names);
}

bool may_be(const Field& field, Field::Type type) {
  return field.type == type ||
         (field.type == Field::Type::any_of && std::any_of(field.parts.begin(), field.parts.end(),
                                                           [&](const Field& f) { return may_be(f, type); }));
}

/// The node a path continues into when the document does not have it: the default, else an empty map or list.
Node starting_node(const Step& step, const Mark& mark) {
  Problems internal;
  Node node;
  if (!step.fallback.empty()) node = parse(step.fallback, mark.source ? *mark.source : "", internal, false);
  if (node.type == Node::Type::null || node.is_scalar())
    node = may_be(*step.field, Field::Type::list) ? list({}) : map({});
  node.mark = mark;
  for (Node& item : node.items) item.mark = mark;
  return node;
}

}  // namespace

bool check_path(const Field& field, const std::string& dotted, const Mark& mark, Problems& problems) {
  const Field* at = &field;
  std::string walked;
  for (const std::string& part : split_path(dotted)) {
    const Step step = step_into(*at, part);
    if (!step.field) {
      std::vector<std::string> names;
      collect_keys(*at, names);
      const std::string near = nearest(part, names);
      std::string suggestion = near.empty() ? "" : "did you mean `" + walked + near + "`?";
      if (near.empty() && names.empty())
        suggestion =
            "`" + walked.substr(0, walked.size() - (walked.empty() ? 0 : 1)) + "` has no keys inside";
      if (near.empty() && !names.empty()) {
        suggestion = "the keys here are";
        for (const std::string& n : names) suggestion += (n == names.front() ? " " : ", ") + n;
      }
      problems.add(mark,
                   "unknown key `" + dotted.substr(0, 100) + "` (not part of this format) " + suggestion);
      return false;
    }
    at = step.field;
    walked += part + ".";
  }
  return true;
}

bool set_path(Node& root, const Field& field, const std::string& dotted, const Node& value,
              Problems& problems) {
  if (!check_path(field, dotted, value.mark, problems)) return false;
  if (root.type == Node::Type::null) root.type = Node::Type::map;
  Node* node = &root;
  const Field* at = &field;
  const std::vector<std::string> parts = split_path(dotted);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const bool last = i + 1 == parts.size();
    const Step step = step_into(*at, parts[i]);
    if (node->is_list()) {
      const auto index = as_index(parts[i]);
      if (!index || *index >= node->items.size()) {
        problems.add(value.mark, "`" + dotted + "`: no item `" + parts[i] + "` (the list has " +
                                     std::to_string(node->items.size()) +
                                     " items, counted from 0) choose one of them");
        return false;
      }
      node = &node->items[*index];
    } else {
      if (!node->is_map()) *node = map({});  // `geometry: slab` gives way to geometry.tube.diameter
      if (!node->find(parts[i])) node->set(parts[i], last ? value : starting_node(step, value.mark));
      node = node->find(parts[i]);
    }
    if (last)
      *node = value;
    else if (!node->is_map() && !node->is_list())
      *node = starting_node({step.field, ""}, value.mark);
    at = step.field;
  }
  return true;
}

void apply_overrides(Node& root, const Field& field, const std::vector<std::string>& overrides,
                     Problems& problems) {
  for (const std::string& text : overrides) {
    const std::string source = "--set " + text;
    const auto equals = text.find('=');
    const Mark mark{std::make_shared<const std::string>(source), 0, 0};
    if (equals == std::string::npos || equals == 0) {
      problems.add(mark,
                   "no `key=value` (the equals sign or the key is missing) write it like --set fluid.tau=1");
      continue;
    }
    try {
      Problems own;
      Node value = parse(text.substr(equals + 1), source, own, false);
      own.throw_if_any();
      set_path(root, field, text.substr(0, equals), value, problems);
    } catch (const InvalidDocument& error) {
      for (const std::string& line : error.problems)
        problems.add(mark, line.substr(line.find(": ", source.size()) + 2));
    }
  }
}

}  // namespace hemowalk::yaml
