// What is meant by a glob, a percentage or a list with a unit without quotes, which YAML takes for something
// else.
#include <fmt/format.h>

#include <cctype>
#include <optional>
#include <sstream>
#include <vector>

#include "engine/settings/tree.h"

namespace graze {
namespace {

bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
         std::string_view("_*?.-").find(c) != std::string_view::npos;
}

/// Walks along a line, outside of quotes and comments.
class LineScan {
 public:
  explicit LineScan(const std::string& line) : line_(line) {}

  std::string hint() {
    bool begins = true;  // a value or key may begin here
    for (std::size_t i = 0; i < line_.size(); ++i) {
      const char c = line_[i];
      if (c == '"' || c == '\'') {
        i = std::min(line_.find(c, i + 1), line_.size());
        begins = false;
        continue;
      }
      if (c == '#' && (i == 0 || line_[i - 1] == ' ')) break;
      if (begins && c == '*') return alias(i);
      if (begins && c == '%') return "; % cannot begin a value in YAML; put the text in quotes";
      if (c == '{') {
        const std::string glob = glob_at(i);
        if (!glob.empty()) return fmt::format("; {{ begins a map in YAML; in quotes it is a glob: \"{}\"", glob);
      }
      if (c == ']') {
        const std::string list = list_with_unit(i);
        if (!list.empty()) return fmt::format("; a list with a unit behind it needs quotes: \"{}\"", list);
      }
      const bool separates = std::string_view("[{,").find(c) != std::string_view::npos;
      const bool separated = (c == ':' || c == '-') && i + 1 < line_.size() && line_[i + 1] == ' ';
      begins = separates || separated || (begins && c == ' ');
    }
    return "";
  }

 private:
  /// The text from `i` on as far as a glob goes.
  std::string word(std::size_t i) const {
    std::size_t end = i, depth = 0;
    for (; end < line_.size(); ++end) {
      const char c = line_[end];
      if (c == '{') {
        ++depth;
      } else if (c == '}' && depth > 0) {
        --depth;
      } else if (!is_word(c) && !(c == ',' && depth > 0)) {
        break;
      }
    }
    return line_.substr(i, end - i);
  }

  std::string alias(std::size_t i) const {
    return fmt::format("; * begins an alias in YAML; in quotes it is a glob: \"{}\"", word(i));
  }

  /// A glob whose brace opens at `i`: text before or behind the braces, as no map has it. Empty: a map.
  std::string glob_at(std::size_t i) const {
    std::size_t begin = i;
    while (begin > 0 && is_word(line_[begin - 1])) --begin;
    const std::size_t close = line_.find('}', i);
    if (line_.find('{', i + 1) < close) return "";  // the inner one, if any
    if (close == std::string::npos || line_.substr(i, close - i).find(':') != std::string::npos) return "";
    const bool before = begin < i, behind = close + 1 < line_.size() && is_word(line_[close + 1]);
    return before || behind ? word(begin) : "";
  }

  /// The list that closes at `i` with a unit behind it.
  std::string list_with_unit(std::size_t i) const {
    const std::size_t open = line_.rfind('[', i), unit = line_.find_first_not_of(' ', i + 1);
    if (open == std::string::npos || unit == std::string::npos) return "";
    if (line_[unit] != '%' && std::isalpha(static_cast<unsigned char>(line_[unit])) == 0) return "";
    const std::size_t end = std::min(line_.find_first_of(" ,}]#", unit), line_.size());
    return line_.substr(open, end - open);
  }

  const std::string& line_;
};

/// Lines of a text as YAML sees them.
class Layout {
 public:
  explicit Layout(const std::string& text) {
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines_.push_back(line);
  }

  bool has(int line) const { return line >= 0 && line < static_cast<int>(lines_.size()); }
  const std::string& operator[](int line) const { return lines_[static_cast<std::size_t>(line)]; }

  /// Spaces in front; nothing for a line without content.
  std::optional<std::size_t> indent(int line) const {
    const std::size_t first = lines_[static_cast<std::size_t>(line)].find_first_not_of(" \t\r");
    if (first == std::string::npos || lines_[static_cast<std::size_t>(line)][first] == '#') return std::nullopt;
    return first;
  }

  bool has_tab_in_front(int line) const {
    return has(line) && indent(line) && (*this)[line].substr(0, *indent(line)).find('\t') != std::string::npos;
  }

  /// The last line with content before `line`; -1: none.
  int above(int line) const {
    do --line;
    while (line >= 0 && !indent(line));
    return line;
  }

  /// Whether a line begins where one that it could continue does: an ancestor of the line above it, or that line.
  bool is_aligned(int line) const {
    std::size_t open = std::string::npos;
    for (int i = above(line); i >= 0; i = above(i)) {
      if (*indent(i) >= open) continue;
      open = *indent(i);
      if (open == *indent(line)) return true;
    }
    return false;
  }

 private:
  std::vector<std::string> lines_;
};

/// Where the value of a line `key: value` begins; npos: it has none, or one in quotes or brackets.
std::size_t bare_value(const std::string& line) {
  const std::size_t colon = line.find(": "), value = line.find_first_not_of(' ', std::min(colon, line.size() - 1) + 1);
  if (colon == std::string::npos || value == std::string::npos) return std::string::npos;
  return std::string_view("\"'[{#|>&!*").find(line[value]) == std::string_view::npos ? value : std::string::npos;
}

/// "; the text … has a colon": of a line `key: a: b`.
std::string colon_hint(const std::string& line) {
  constexpr std::size_t kShown = 60;
  const std::size_t value = line.empty() ? std::string::npos : bare_value(line);
  if (value == std::string::npos) return "";
  const std::string text = line.substr(value, line.find(" #", value) - value);
  if (text.find(": ") == std::string::npos) return "";
  return "; a text with a colon and a space in it needs quotes" +
         (text.size() > kShown ? std::string() : fmt::format(": \"{}\"", text));
}

/// Of a line with a key that is longer than the parser looks for the colon behind one.
std::string long_key_hint(const std::string& line) {
  constexpr std::size_t kMostOfKey = 1024;  // bytes, YAML 1.2 § 7.4.2
  const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
  std::size_t colon = line.find(": ", begin);
  if (colon == std::string::npos && line.ends_with(':')) colon = line.size() - 1;
  if (colon == std::string::npos || colon - begin <= kMostOfKey) return "";
  return fmt::format("; a key has at most {} characters, and this one {}", kMostOfKey, colon - begin);
}

/// Of a line that the parser takes for a part of the value of the line above it.
std::string above_hint(const Layout& lines, int line) {
  const int above = lines.above(line);
  if (above < 0 || !lines.indent(line)) return "";
  const std::string& text = lines[above];
  const std::size_t colon = text.find(':');
  if (colon != std::string::npos && colon + 1 < text.size() && text[colon + 1] != ' ' &&
      bare_value(text) == std::string::npos) {
    return fmt::format("; a space is missing behind the colon in line {}", above + 1);
  }
  if (*lines.indent(line) <= *lines.indent(above) || bare_value(text) == std::string::npos) return "";
  return fmt::format("; it is indented below line {}, which has a value already", above + 1);
}

}  // namespace

std::string layout_hint(const std::string& text, int line, const std::string& problem) {
  const Layout lines(text);
  for (const int i : {line, line - 1}) {
    if (lines.has_tab_in_front(i))
      return fmt::format("; a tab stands in front of line {}: YAML indents by spaces", i + 1);
  }
  if (problem == "end of map flow not found") return "; a ',' or the closing '}' is missing before this place";
  if (problem == "end of sequence flow not found") return "; a ',' or the closing ']' is missing before this place";
  if (!lines.has(line)) return "";
  if (problem == "illegal map value") {
    if (std::string hint = long_key_hint(lines[line]); !hint.empty()) return hint;
    const std::string hint = colon_hint(lines[line]);
    return hint.empty() ? above_hint(lines, line) : hint;
  }
  if (problem.starts_with("end of") && lines.indent(line) && !lines.is_aligned(line)) {
    return fmt::format("; its indentation of {} space{} is that of no line above that it could go on with",
                       *lines.indent(line), *lines.indent(line) == 1 ? "" : "s");
  }
  return "";
}

std::string quoting_hint(const std::string& line) { return LineScan(line).hint(); }

}  // namespace graze
