#include "jobs/cli/wrapped_text.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <utility>

#include "archive/files/utf8.h"

namespace graze {
namespace {

constexpr std::size_t kNarrowest = 40;  // below it nothing fits, and wrapping only hurts
constexpr std::size_t kWidest = 10'000;

/// What COLUMNS says, if it says a sensible number.
std::size_t told_width() {
  const char* const told = std::getenv("COLUMNS");
  if (told == nullptr) return kUnlimited;
  const std::string_view text(told);
  std::size_t width = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), width);
  if (error != std::errc() || end != text.data() + text.size() || width == 0) return kUnlimited;
  return std::clamp(width, kNarrowest, kWidest);
}

/// Characters of the longest word.
std::size_t longest_word(std::string_view text) {
  std::size_t longest = 0;
  for (const std::string& word : lines_of(text, 1)) longest = std::max(longest, width_of(word));
  return longest;
}

/// Widths of the columns for a table of `width`: natural ones, of which the widest but the first are cut as far as
/// needed, and none below its longest word, or a few short ones.
std::vector<std::size_t> column_widths(const std::vector<std::vector<std::string>>& rows, std::size_t width,
                                       std::size_t gap) {
  constexpr std::size_t kLeast = 12;
  std::vector<std::size_t> out;
  for (const std::vector<std::string>& row : rows) {
    out.resize(std::max(out.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) out[i] = std::max(out[i], width_of(row[i]));
  }
  if (width == kUnlimited || out.size() < 2) return out;
  std::vector<std::size_t> least(out.size(), kLeast);
  for (const std::vector<std::string>& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) least[i] = std::max(least[i], longest_word(row[i]));
  }
  std::size_t all = 2 + gap * (out.size() - 1);
  for (const std::size_t one : out) all += one;
  for (; all > width; --all) {
    std::size_t widest = 0;
    for (std::size_t i = 1; i < out.size(); ++i) {
      if (out[i] > least[i] && (widest == 0 || out[i] > out[widest])) widest = i;
    }
    if (widest == 0) break;
    --out[widest];
  }
  return out;
}

}  // namespace

std::size_t output_width() {
  if (const std::size_t told = told_width(); told != kUnlimited) return told;
  winsize size{};
  if (isatty(STDOUT_FILENO) == 0 || ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return kUnlimited;
  return std::max<std::size_t>(size.ws_col, kNarrowest);
}

std::string padded(const std::string& text, std::size_t width) {
  return text + std::string(width - std::min(width, width_of(text)), ' ');
}

std::vector<std::string> lines_of(std::string_view text, std::size_t width) {
  if (width == kUnlimited || width_of(text) <= width) return {std::string(text)};
  std::vector<std::string> out;
  std::string line;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t blank = std::min(text.find(' ', from), text.size());
    const std::string_view word = text.substr(from, blank - from);
    from = blank + 1;
    if (word.empty()) continue;
    if (!line.empty() && width_of(line) + 1 + width_of(word) > width) out.push_back(std::exchange(line, ""));
    line += (line.empty() ? "" : " ") + std::string(word);
  }
  if (!line.empty() || out.empty()) out.push_back(line);
  return out;
}

std::string wrapped(std::string_view text, std::size_t width, std::size_t indent) {
  if (width == kUnlimited) return std::string(text);
  std::string out;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = std::min(text.find('\n', from), text.size());
    const std::string_view line = text.substr(from, end - from);
    const std::size_t front = std::min(line.find_first_not_of(' '), line.size()), hung = front + indent;
    bool first = true;
    for (const std::string& part : lines_of(line.substr(front), width > hung ? width - hung : 1)) {
      out += (first ? "" : "\n") + (part.empty() ? "" : std::string(first ? front : hung, ' ') + part);
      first = false;
    }
    if (end < text.size()) out += '\n';
    from = end + 1;
  }
  return out;
}

std::string columns_text(const std::vector<std::vector<std::string>>& rows, std::size_t width, std::size_t gap) {
  const std::vector<std::size_t> widths = column_widths(rows, width, gap);
  std::string out;
  for (const std::vector<std::string>& row : rows) {
    std::vector<std::vector<std::string>> cells;
    std::size_t height = 1;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const bool whole = i == 0 || width == kUnlimited;
      cells.push_back(lines_of(row[i], whole ? kUnlimited : widths[i]));
      height = std::max(height, cells.back().size());
    }
    for (std::size_t at = 0; at < height; ++at) {
      std::string line = "  ";
      for (std::size_t i = 0; i < cells.size(); ++i) {
        line += padded(at < cells[i].size() ? cells[i][at] : "", widths[i]) + std::string(gap, ' ');
      }
      out += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
    }
  }
  return out;
}

}  // namespace graze
