#include "engine/settings/similar.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/settings/settings.h"

namespace graze {
namespace {

/// The word between the wildcards at the ends of a glob; empty if it has others.
std::string core_of(std::string_view word) {
  const std::size_t first = word.find_first_not_of("*?");
  if (first == std::string_view::npos) return "";
  const std::string core(word.substr(first, word.find_last_not_of("*?") + 1 - first));
  return core.find_first_of("*?{}") == std::string::npos ? core : "";
}

}  // namespace

std::string similar_names(std::string_view word, const std::vector<std::string>& names, bool globs) {
  const std::string near = nearest(word, names);
  if (!near.empty()) return "; did you mean " + near + "?";
  const std::string core = core_of(word);
  std::vector<std::string> holders;
  for (const std::string& name : names) {
    if (core.size() > 1 && name.find(core) != std::string::npos) holders.push_back(name);
  }
  if (holders.size() == 1) return "; did you mean " + holders[0] + "?";
  if (!holders.empty() && globs) {
    return fmt::format("; did you mean '*{}*' ({}, …)?", core, holders[0]);
  }
  return "; " + nearest_or_all(core, holders.empty() ? names : holders);
}

}  // namespace graze
