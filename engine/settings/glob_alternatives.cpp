#include "engine/settings/glob_alternatives.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/settings/settings.h"

namespace graze {

std::vector<std::string> idle_alternatives(std::string_view pattern, const std::vector<std::string>& names) {
  std::vector<std::string> out;
  for (std::size_t open = pattern.find('{'); open != std::string_view::npos; open = pattern.find('{', open + 1)) {
    const std::size_t close = pattern.find('}', open);
    if (close == std::string_view::npos) break;
    for (std::size_t from = open + 1;;) {
      const std::size_t comma = std::min(pattern.find(',', from), close);
      const std::string one =
          fmt::format("{}{}{}", pattern.substr(0, open), pattern.substr(from, comma - from), pattern.substr(close + 1));
      const auto is_one = [&](const std::string& name) { return matches(one, name); };
      const bool written = comma > from;  // "leg{,_2}" may mean the plain name
      if (written && std::none_of(names.begin(), names.end(), is_one)) out.push_back(one);
      if (comma == close) break;
      from = comma + 1;
    }
  }
  return out;
}

std::string idle_alternative_problem(std::string_view pattern, const std::vector<std::string>& names,
                                     std::string_view what) {
  const std::vector<std::string> idle = idle_alternatives(pattern, names);
  if (idle.empty()) return "";
  const std::string near = nearest(idle.front(), names);
  return fmt::format("{}: '{}' of it matches no {}{}", pattern, idle.front(), what,
                     near.empty() ? "" : fmt::format("; did you mean '{}'?", near));
}

}  // namespace graze
