#include "engine/control/wrong_level.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "engine/control/policy.h"
#include "engine/settings/merged.h"

namespace graze {
namespace {

bool holds(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::vector<std::string> names_of(Component component) {
  return component == Component::policy ? policy_names() : tracker_names();
}

const Description& description_named(Component component, const std::string& name) {
  return component == Component::policy ? policy_text(name) : tracker_text(name);
}

/// "kp: 100, kd: 2", as written; what is no plain value is left out.
std::string written(const std::vector<SettingsEntry>& entries) {
  std::vector<std::string> out;
  for (const auto& [key, value] : entries)
    out.push_back(fmt::format("{}: {}", key, value.is_scalar() ? value.text() : "…"));
  return clipped(fmt::format("{}", fmt::join(out, ", ")), 80);
}

}  // namespace

void refuse_wrong_level(const Settings& settings, Component component) {
  if (!settings.is_map()) return;
  const std::vector<std::string> names = names_of(component);
  std::vector<SettingsEntry> strangers, chosen;
  for (const SettingsEntry& entry : settings.entries()) {
    if (entry.first == "control" && component == Component::policy) continue;
    (holds(names, entry.first) ? chosen : strangers).push_back(entry);
  }
  if (strangers.empty()) return;
  std::vector<std::string> fitting;
  for (const std::string& name : names) {
    const Description& text = description_named(component, name);
    const auto its = [&](const SettingsEntry& entry) { return text.find(entry.first) != nullptr; };
    if (std::all_of(strangers.begin(), strangers.end(), its)) fitting.push_back(name);
  }
  const auto& [key, value] = strangers.front();
  // What expands policies has taken `over` away by now; none of the names that may stand here is like it.
  if (component == Component::policy && !nearest(key, {"over"}).empty() && nearest(key, names).empty()) {
    value.fail_key("unknown key; did you mean 'over'?");
  }
  if (chosen.size() == 1 && holds(fitting, chosen[0].first)) {
    value.fail_key(
        fmt::format("stands beside {0} and belongs into it: {0}: {{…, {1}}}", chosen[0].first, written(strangers)));
  }
  const char* const what = component == Component::policy ? "policy" : "tracker";
  if (chosen.empty() && !fitting.empty()) {
    std::vector<std::string> meant;
    for (const std::string& name : fitting) meant.push_back(fmt::format("{{{}: {{{}}}}}", name, written(strangers)));
    settings.fail(
        fmt::format("{{{}}}: names no {}; did you mean {}?", written(strangers), what, fmt::join(meant, " or ")));
  }
  if (component == Component::policy && holds(tracker_names(), key) && nearest(key, names).empty()) {
    value.fail_key(fmt::format("is a tracker; it stands under 'control': control: {{{}: …}}", key));
  }
}

}  // namespace graze
