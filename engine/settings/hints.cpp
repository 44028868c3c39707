// What people mean who write a glob, a percentage or a list with a unit without quotes, which YAML takes for something
// else.
#include <fmt/format.h>

#include <cctype>

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

}  // namespace

std::string quoting_hint(const std::string& line) { return LineScan(line).hint(); }

}  // namespace graze
