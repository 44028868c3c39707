// Names: the nearest right one, and glob patterns.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <numeric>
#include <optional>

#include "engine/settings/limits.h"
#include "engine/settings/settings.h"
#include "engine/settings/similar.h"

namespace graze {
namespace {

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

}  // namespace

/// With transpositions of neighbours: optimal string alignment.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), previous(b.size() + 1), row(b.size() + 1);
  std::iota(previous.begin(), previous.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      row[j] = std::min({previous[j] + 1, row[j - 1] + 1, previous[j - 1] + (same ? 0 : 1)});
      if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1])) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
    before.swap(previous);
    previous.swap(row);
  }
  return previous[b.size()];
}

namespace {

/// `*` and `?` only. Linear in pattern times name: after a mismatch only the last star need be tried again.
bool matches_wildcards(std::string_view pattern, std::string_view name) {
  std::size_t p = 0, n = 0, star = std::string_view::npos, resume = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      resume = n;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
      ++p;
      ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++resume;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

/// Whether `test` holds for one of the plain patterns that braces stand for; `budget`: how many may be tried. Nothing
/// if there are more.
template <typename Test>
std::optional<bool> any_plain(const std::string& pattern, std::size_t& budget, const Test& test) {
  const std::size_t open = pattern.find('{');
  const std::size_t close = open == std::string::npos ? open : pattern.find('}', open);
  if (close == std::string::npos) {
    if (budget == 0) return std::nullopt;
    --budget;
    return test(pattern);
  }
  for (std::size_t from = open + 1;;) {
    const std::size_t comma = std::min(pattern.find(',', from), close);
    const std::string one = pattern.substr(0, open) + pattern.substr(from, comma - from) + pattern.substr(close + 1);
    const std::optional<bool> found = any_plain(one, budget, test);
    if (!found || *found) return found;
    if (comma == close) return false;
    from = comma + 1;
  }
}

}  // namespace

std::string clipped(std::string_view text, std::size_t most) {
  if (text.size() <= most) return std::string(text);
  std::size_t cut = most;
  while (cut > 0 && (static_cast<unsigned char>(text[cut]) & 0xc0) == 0x80) --cut;  // not inside a UTF-8 character
  return std::string(text.substr(0, cut)) + "…";
}

std::string nearest(std::string_view word, const std::vector<std::string>& candidates) {
  constexpr std::size_t kLongest = 200;  // longer words are not misspelt names
  if (word.empty() || word.size() > kLongest) return {};
  std::string best;
  std::size_t least = std::string::npos;
  for (const std::string& candidate : candidates) {
    if (candidate.size() > kLongest) continue;
    const std::size_t d = edit_distance(word, candidate);
    const std::size_t near = std::max<std::size_t>(1, (std::max(word.size(), candidate.size()) + 1) / 3);
    if (d <= near && d < least) {
      least = d;
      best = candidate;
    }
  }
  return best;
}

std::string nearest_or_all(std::string_view word, const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 20;
  const std::string near = nearest(word, names);
  if (!near.empty()) return "nearest: " + near;
  if (names.empty()) return "there are none";
  std::string all;
  for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i) all += (i > 0 ? ", " : "") + names[i];
  return "there are: " + all + (names.size() > kMost ? ", …" : "");
}

std::string glob_problem(std::string_view pattern) {
  constexpr std::size_t kShown = 80;
  const std::string shown = clipped(pattern, kShown);
  if (pattern.size() > kMaxGlobBytes) {
    return fmt::format("{}: a glob of {} bytes; at most {}: use several, or *", shown, pattern.size(), kMaxGlobBytes);
  }
  std::size_t budget = kMaxAlternatives;
  if (any_plain(std::string(pattern), budget, [](const std::string&) { return false; })) return "";
  return fmt::format("{}: a glob whose braces stand for more than {} patterns; use several, or *", shown,
                     kMaxAlternatives);
}

bool matches(std::string_view pattern, std::string_view name) {
  if (pattern.find('{') == std::string_view::npos) return matches_wildcards(pattern, name);
  std::size_t budget = kMaxAlternatives;
  const std::optional<bool> found =
      any_plain(std::string(pattern), budget, [&](const std::string& plain) { return matches_wildcards(plain, name); });
  if (!found) throw InputError(glob_problem(pattern));
  return *found;
}

}  // namespace graze
