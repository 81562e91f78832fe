#include <cmath>

#include "core/units.hpp"
#include "core/yaml/schema.hpp"

namespace hemowalk::yaml {
namespace {

bool is_container(const Value& v) { return v.type == Value::Type::map || v.type == Value::Type::list; }

/// Writes values; with everything false the keys that do not change results are left out.
class Writer {
 public:
  explicit Writer(bool everything) : everything_(everything) {}

  std::string flow(const Value& v) const {
    std::string text;
    switch (v.type) {
      case Value::Type::none:
      case Value::Type::null:
        return "null";
      case Value::Type::boolean:
        return v.flag ? "true" : "false";
      case Value::Type::integer:
        return std::to_string(v.whole);
      case Value::Type::number:
        return std::isfinite(v.real) ? format_quantity(v.real, v.unit) : "null";
      case Value::Type::text:
        return flow_text(scalar(v.word));
      case Value::Type::list:
        for (const Value& item : v.items) text += (text.empty() ? "" : ", ") + flow(item);
        return "[" + text + "]";
      case Value::Type::map:
        for (const auto& [key, member] : v.members)
          if (kept(member)) text += (text.empty() ? "" : ", ") + flow_text(scalar(key)) + ": " + flow(member);
        return "{" + text + "}";
    }
    return text;
  }

  /// Maps over several lines, one key each; lists of containers one item per line; all else on one line.
  std::string block(const Value& map, const std::string& indent) const {
    std::string text;
    for (const auto& [key, v] : map.members) {
      if (!kept(v)) continue;
      text += indent + flow_text(scalar(key)) + ":";
      const bool rows = v.type == Value::Type::list && !v.items.empty() && is_container(v.items[0]);
      if (v.type == Value::Type::map && !v.members.empty()) {
        text += "\n" + block(v, indent + "  ");
      } else if (rows) {
        text += "\n";
        for (const Value& item : v.items) text += indent + "  - " + flow(item) + "\n";
      } else {
        text += " " + flow(v) + "\n";
      }
    }
    return text;
  }

 private:
  bool kept(const Value& v) const { return v.type != Value::Type::none && (everything_ || v.physical); }
  bool everything_;
};

}  // namespace

std::string canonical_text(const Value& value) { return Writer(true).block(value, ""); }
std::string physical_text(const Value& value) { return Writer(false).block(value, ""); }

}  // namespace hemowalk::yaml
