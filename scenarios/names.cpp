#include "scenarios/names.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/settings/glob_alternatives.h"
#include "engine/settings/limits.h"

namespace graze {

std::vector<int> match_names(const Settings& where, const std::string& pattern, const std::vector<std::string>& names,
                             const std::string& what) {
  if (const std::string problem = glob_problem(pattern); !problem.empty()) where.fail(problem);
  std::vector<int> out;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (matches(pattern, names[i])) out.push_back(static_cast<int>(i));
  }
  if (!out.empty()) {
    if (const std::string idle = idle_alternative_problem(pattern, names, what); !idle.empty()) where.fail(idle);
    return out;
  }
  const std::string near = nearest(pattern, names);
  std::string list;
  for (std::size_t i = 0; i < names.size() && i < 20; ++i) list += (i ? ", " : "") + names[i];
  if (names.size() > 20) list += ", …";
  where.fail(fmt::format("{}: matches no {}{}", pattern, what,
                         !near.empty()   ? fmt::format("; did you mean '{}'?", near)
                         : names.empty() ? "; there are none"
                                         : "; there are: " + list));
}

std::vector<std::string> frame_names(const Model& model) {
  std::vector<std::string> out;
  for (const Frame& frame : model.frames) out.push_back(frame.name);
  return out;
}

std::vector<std::string> driven_names(const Model& model) {
  std::vector<std::string> out;
  for (const int body : model.actuated) out.push_back(model.bodies[body].joint);
  return out;
}

std::vector<std::string> part_names(const Model& model) {
  std::vector<std::string> out;
  const auto add = [&](const std::string& name) {
    if (std::find(out.begin(), out.end(), name) == out.end()) out.push_back(name);
  };
  for (const Collider& collider : model.colliders) {
    add(collider.name);
    add(collider.link);
  }
  return out;
}

}  // namespace graze
