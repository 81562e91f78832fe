#include "core/yaml/document.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <tuple>
#include <unordered_set>
#include <utility>

namespace hemowalk::yaml {
namespace {

constexpr std::size_t max_depth = 40;  ///< the deepest file format needs 8

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += (text.empty() ? "" : "\n") + line;
  return text;
}

/// Ends a parse from inside an event.
struct Stop {
  Mark mark;
  std::string text;
};

/// Turns yaml-cpp's events into a tree; yaml-cpp's own Node drops duplicate keys silently.
class TreeBuilder : public YAML::EventHandler {
 public:
  TreeBuilder(std::shared_ptr<const std::string> source, bool positions, Problems& problems)
      : source_(std::move(source)), positions_(positions), problems_(problems) {}

  Node root;

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (documents_++) throw Stop{at(mark), "a second YAML document (one is expected) remove the `---` line"};
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    refuse_anchor(mark, anchor);
    add(leaf(mark, Node::Type::null, ""));
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    problems_.add(at(mark), "an alias `*` (a file says every value where it stands) write the value");
    add(leaf(mark, Node::Type::null, ""));
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    refuse_anchor(mark, anchor);
    refuse_tag(mark, tag);
    const bool plain = tag != "!";
    const bool null = plain && (value == "~" || value == "null");
    add(leaf(mark, null ? Node::Type::null : Node::Type::scalar, value));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, Node::Type::list);
  }
  void OnSequenceEnd() override { open_.pop_back(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, Node::Type::map);
  }
  void OnMapEnd() override { open_.pop_back(); }

 private:
  /// A list or map whose end has not come yet.
  struct Open {
    Node* node;
    bool key_pending = false;
    bool drop_value = false;  ///< the key is a duplicate
    std::string key;
    Mark key_mark;
    std::unordered_set<std::string> keys;
  };

  Mark at(const YAML::Mark& mark) const {
    return positions_ ? Mark{source_, mark.line + 1, mark.column + 1} : Mark{source_, 0, 0};
  }
  Node leaf(const YAML::Mark& mark, Node::Type type, const std::string& text) const {
    Node node;
    node.type = type;
    node.text = text;
    node.mark = at(mark);
    return node;
  }
  void refuse_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (anchor) problems_.add(at(mark), "an anchor `&` (a file says every value where it stands) remove it");
  }
  void refuse_tag(const YAML::Mark& mark, const std::string& tag) {
    if (!tag.empty() && tag != "?" && tag != "!")
      problems_.add(at(mark), "a tag `" + tag.substr(0, 60) + "` (the schema knows every type) remove it");
  }
  void open(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, Node::Type type) {
    refuse_anchor(mark, anchor);
    refuse_tag(mark, tag);
    if (open_.size() >= max_depth)
      throw Stop{at(mark), "more than " + std::to_string(max_depth) +
                               " levels of nesting (no format needs them) is it the right file?"};
    if (!open_.empty() && open_.back().node->is_map() && !open_.back().key_pending)
      throw Stop{at(mark),
                 "not valid YAML (a bracket is not closed, or a list or map stands as a key) check the "
                 "braces, brackets and colons"};
    Node* node = add(leaf(mark, type, ""));
    open_.push_back({node, false, false, {}, {}, {}});
  }

  /// Puts a value where the document says; returns its place.
  Node* add(Node node) {
    if (open_.empty()) {
      root = std::move(node);
      return &root;
    }
    Open& parent = open_.back();
    if (parent.node->is_list()) {
      parent.node->items.push_back(std::move(node));
      return &parent.node->items.back();
    }
    if (!parent.key_pending) {
      parent.key_pending = true;
      parent.key = node.type == Node::Type::null ? "null" : node.text;
      parent.key_mark = node.mark;
      parent.drop_value = !parent.keys.insert(parent.key).second;
      if (parent.drop_value)
        problems_.add(node.mark, "duplicate key `" + parent.key.substr(0, 60) +
                                     "` (which one counts?) remove one of them");
      return nullptr;
    }
    parent.key_pending = false;
    if (node.type == Node::Type::null) node.mark = parent.key_mark;
    if (parent.drop_value) {
      dropped_.push_back(std::make_unique<Node>(std::move(node)));
      return dropped_.back().get();
    }
    parent.node->members.push_back({parent.key, parent.key_mark, std::move(node)});
    return &parent.node->members.back().value;
  }

  std::shared_ptr<const std::string> source_;
  bool positions_;
  Problems& problems_;
  int documents_ = 0;
  std::vector<Open> open_;
  std::vector<std::unique_ptr<Node>>
      dropped_;  ///< values of duplicate keys: read, so that their problems show, and unused
};

/// Position and name of the first byte no YAML text may hold: control characters, broken UTF-8.
struct BadByte {
  std::size_t at;
  std::string what;
};
bool find_bad_byte(const std::string& text, BadByte& bad) {
  for (std::size_t i = 0; i < text.size();) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c < 0x80) {
      if ((c < 0x20 && c != '\t' && c != '\n' && c != '\r') || c == 0x7f) {
        bad = {i, "a control character"};
        return true;
      }
      ++i;
      continue;
    }
    const std::size_t length = c >= 0xc2 && c < 0xe0   ? 2
                               : c >= 0xe0 && c < 0xf0 ? 3
                               : c >= 0xf0 && c < 0xf5 ? 4
                                                       : 0;
    bool good = length > 0 && i + length <= text.size();
    for (std::size_t k = 1; good && k < length; ++k)
      good = (static_cast<unsigned char>(text[i + k]) & 0xc0) == 0x80;
    if (!good) {
      bad = {i, "a byte that is not UTF-8"};
      return true;
    }
    i += length;
  }
  return false;
}

std::string line_of(const std::string& text, int line) {
  std::istringstream lines(text);
  std::string result;
  for (int i = 0; i <= line; ++i)
    if (!std::getline(lines, result)) return {};
  return result;
}

std::string yaml_error(const std::string& text, const YAML::Exception& error) {
  const std::string line = line_of(text, error.mark.line);
  const bool tab = line.substr(0, line.find_first_not_of(" \t")).find('\t') != std::string::npos;
  return "not valid YAML (" + error.msg + ") " +
         (tab ? "indent with spaces, not tabs" : "check indentation, braces, quotes and colons");
}

}  // namespace

std::string Mark::text() const {
  std::string result = source ? *source : "input";
  if (line > 0) result += ":" + std::to_string(line) + ":" + std::to_string(column);
  return result;
}

InvalidDocument::InvalidDocument(std::vector<std::string> problems_)
    : InputError(joined(problems_)), problems(std::move(problems_)) {}

void Problems::add(const Mark& mark, const std::string& text) { errors_.push_back({mark, text}); }
void Problems::warn(const Mark& mark, const std::string& text) { warnings_.push_back({mark, text}); }

void Problems::append(const Problems& other) {
  errors_.insert(errors_.end(), other.errors_.begin(), other.errors_.end());
  warnings_.insert(warnings_.end(), other.warnings_.begin(), other.warnings_.end());
}

std::vector<std::string> Problems::sorted(std::vector<Problem> problems) {
  const auto key = [](const Problem& p) {
    return std::make_tuple(p.mark.source ? *p.mark.source : std::string(), p.mark.line, p.mark.column);
  };
  std::stable_sort(problems.begin(), problems.end(),
                   [&](const Problem& a, const Problem& b) { return key(a) < key(b); });
  std::vector<std::string> lines;
  std::set<std::string> seen;
  for (const Problem& p : problems) {
    std::string line = p.mark.text() + ": " + p.text;
    if (seen.insert(line).second) lines.push_back(std::move(line));
  }
  return lines;
}

void Problems::throw_if_any() const {
  if (!errors_.empty()) throw InvalidDocument(errors());
}

const Node* Node::find(const std::string& key) const {
  for (const Member& m : members)
    if (m.key == key) return &m.value;
  return nullptr;
}
Node* Node::find(const std::string& key) { return const_cast<Node*>(std::as_const(*this).find(key)); }

void Node::set(const std::string& key, Node value) {
  if (Node* old = find(key)) {
    *old = std::move(value);
    return;
  }
  const Mark where = value.mark;
  members.push_back({key, where, std::move(value)});
}

Node scalar(std::string text) {
  Node node;
  node.type = Node::Type::scalar;
  node.text = std::move(text);
  return node;
}
Node list(std::vector<Node> items) {
  Node node;
  node.type = Node::Type::list;
  node.items = std::move(items);
  return node;
}
Node map(std::vector<std::pair<std::string, Node>> members) {
  Node node;
  node.type = Node::Type::map;
  for (auto& [key, value] : members) node.members.push_back({key, {}, std::move(value)});
  return node;
}

Node parse(const std::string& text, const std::string& source, Problems& problems, bool positions) {
  const auto shared = std::make_shared<const std::string>(source);
  TreeBuilder builder(shared, positions, problems);
  builder.root.mark = positions ? Mark{shared, 1, 1} : Mark{shared, 0, 0};
  const auto mark = [&](int line, int column) {
    return positions ? Mark{shared, std::max(line, 0) + 1, std::max(column, 0) + 1} : Mark{shared, 0, 0};
  };
  if (BadByte bad; find_bad_byte(text, bad)) {
    const auto start = bad.at == 0 ? std::string::npos : text.rfind('\n', bad.at - 1);
    const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(bad.at), '\n');
    problems.add(
        mark(static_cast<int>(line), static_cast<int>(bad.at - (start == std::string::npos ? 0 : start + 1))),
        bad.what + " (a text file in UTF-8 is expected) is it the right file?");
    problems.throw_if_any();
  }
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(builder)) {
    }
    return std::move(builder.root);
  } catch (const Stop& stop) {
    problems.add(stop.mark, stop.text);
  } catch (const YAML::Exception& error) {
    problems.add(mark(error.mark.line, error.mark.column), yaml_error(text, error));
  } catch (const std::exception& error) {
    problems.add(mark(0, 0), std::string("not valid YAML (") + error.what() + ") is it the right file?");
  }
  throw InvalidDocument(problems.errors());
}

}  // namespace hemowalk::yaml
