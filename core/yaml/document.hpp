#pragma once
/// \file A YAML document as a tree of texts that remember where they stand. No meaning yet: that is the
/// schema's work.

#include <memory>
#include <string>
#include <vector>

#include "core/check.hpp"

namespace hemowalk::yaml {

/// Where a piece of input stands.
struct Mark {
  std::shared_ptr<const std::string> source;  ///< file name, or "--set key=value"
  int line = 0, column = 0;                   ///< from 1; 0 = the source as a whole

  /// "file:line:col", or the source alone.
  std::string text() const;
};

/// All problems of one input, thrown together; what() has one line per problem.
struct InvalidDocument : InputError {
  explicit InvalidDocument(std::vector<std::string> problems);
  std::vector<std::string> problems;
};

/// Collects problems as "file:line:col: problem (why) suggestion".
class Problems {
 public:
  /// \p text reads "problem (why) suggestion".
  void add(const Mark& mark, const std::string& text);
  void warn(const Mark& mark, const std::string& text);
  /// Takes over the errors and warnings of \p other.
  void append(const Problems& other);
  bool empty() const { return errors_.empty(); }
  /// In the order of the text; each problem once.
  std::vector<std::string> errors() const { return sorted(errors_); }
  std::vector<std::string> warnings() const { return sorted(warnings_); }
  /// \throws InvalidDocument if there is any error.
  void throw_if_any() const;

 private:
  struct Problem {
    Mark mark;
    std::string text;
  };
  static std::vector<std::string> sorted(std::vector<Problem> problems);

  std::vector<Problem> errors_, warnings_;
};

struct Member;

/// One value of a document.
struct Node {
  enum class Type { null, scalar, list, map };

  Type type = Type::null;
  std::string text;             ///< scalar
  std::vector<Node> items;      ///< list
  std::vector<Member> members;  ///< map, in the order of the text
  Mark mark;

  bool is_scalar() const { return type == Type::scalar; }
  bool is_list() const { return type == Type::list; }
  bool is_map() const { return type == Type::map; }
  /// The value of \p key of a map; nullptr if there is none.
  const Node* find(const std::string& key) const;
  Node* find(const std::string& key);
  /// Sets \p key of a map, keeping its place if it is there.
  void set(const std::string& key, Node value);
};

/// A key of a map and its value.
struct Member {
  std::string key;
  Mark mark;
  Node value;
};

/// Building trees in code.
Node scalar(std::string text);
Node list(std::vector<Node> items);
Node map(std::vector<std::pair<std::string, Node>> members);

/// The tree of \p text. Duplicate keys, anchors, aliases, tags and keys that are no plain text go to \p
/// problems; so does the first error of YAML itself, and what was read before it is returned. Never throws on
/// bad input. \p source stands for the text in marks; with \p positions false marks name the source only.
Node parse(const std::string& text, const std::string& source, Problems& problems, bool positions = true);

/// One line of flow YAML: "{a: 1, b: [2, 3]}".
std::string flow_text(const Node& node);

/// "a" and "b" for "a.b".
std::vector<std::string> split_path(const std::string& dotted);

/// The word of \p words nearest to \p word by edit distance; empty if none is near enough to be meant.
std::string nearest(const std::string& word, const std::vector<std::string>& words);

}  // namespace hemowalk::yaml
