#include <algorithm>

#include "core/yaml/document.hpp"

namespace hemowalk::yaml {
namespace {

bool is_plain(const std::string& text) {
  static const std::string first = "+-.%/~_";
  static const std::string later = "+-.%/_*^() ";
  if (text.empty() || text.front() == ' ' || text.back() == ' ' || text == "~" || text == "null" ||
      text == "-")
    return false;
  if (text.rfind("- ", 0) == 0 || text.rfind("---", 0) == 0 || text.rfind("...", 0) == 0) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const bool word = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (!word && (i ? later : first).find(text[i]) == std::string::npos) return false;
  }
  return text.front() != '%';
}

std::size_t edit_distance(const std::string& a, const std::string& b) {
  // Damerau-Levenshtein with adjacent transpositions: typing errors.
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i)
    for (std::size_t j = 1; j <= b.size(); ++j) {
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

}  // namespace

std::string flow_text(const Node& node) {
  std::string text;
  switch (node.type) {
    case Node::Type::null:
      return "null";
    case Node::Type::scalar: {
      if (is_plain(node.text)) return node.text;
      text = "\"";
      for (const char c : node.text) {
        if (c == '"' || c == '\\') text += '\\';
        if (c == '\n')
          text += "\\n";
        else if (c == '\t')
          text += "\\t";
        else if (c == '\r')
          text += "\\r";
        else
          text += c;
      }
      return text + "\"";
    }
    case Node::Type::list:
      for (const Node& item : node.items) text += (text.empty() ? "" : ", ") + flow_text(item);
      return "[" + text + "]";
    case Node::Type::map:
      for (const Member& m : node.members)
        text += (text.empty() ? "" : ", ") + flow_text(scalar(m.key)) + ": " + flow_text(m.value);
      return "{" + text + "}";
  }
  return text;
}

std::vector<std::string> split_path(const std::string& dotted) {
  std::vector<std::string> parts;
  std::size_t start = 0;
  while (true) {
    const auto dot = dotted.find('.', start);
    parts.push_back(dotted.substr(start, dot == std::string::npos ? dot : dot - start));
    if (dot == std::string::npos) return parts;
    start = dot + 1;
  }
}

std::string nearest(const std::string& word, const std::vector<std::string>& words) {
  if (word.empty() || word.size() > 64) return {};
  std::string best;
  std::size_t least = (word.size() < 4 ? 1 : std::max<std::size_t>(2, word.size() / 3)) + 1;
  for (const std::string& candidate : words) {
    const std::size_t d = edit_distance(word, candidate);
    if (d < least && d < std::max(word.size(), candidate.size())) {
      least = d;
      best = candidate;
    }
  }
  if (best.empty() && word.size() >= 4)  // half a compound: viscosity for kinematic_viscosity
    for (const std::string& candidate : words)
      if (candidate.find(word) != std::string::npos ||
          (candidate.size() >= 4 && word.find(candidate) != std::string::npos))
        return candidate;
  return best;
}

}  // namespace hemowalk::yaml
