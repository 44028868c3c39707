#include "jobs/cli/override_doubts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "engine/settings/settings.h"
#include "jobs/cli/shipped.h"

namespace graze {
namespace {

constexpr std::size_t kShown = 80;  // bytes of what was given in a message

/// A number of the world that every particle draws for itself is only the middle of what is drawn, and not even that if
/// what is drawn does not follow it.
void doubt_nominal(const Override& given, const Scenario& scenario) {
  for (const UncertainParameter& one : scenario.space.parameters) {
    if (one.name != given.path || one.persistent.is_constant() || !one.labels.empty()) continue;
    const double mean = one.persistent.mean();
    if (std::abs(mean - one.nominal) <= 1e-6 * (std::abs(mean) + std::abs(one.nominal))) continue;
    spdlog::warn(
        "--set {0}: is uncertain, so that each particle draws its own value, by {1}, whatever the nominal one is; did "
        "you "
        "mean --set uncertain.{0}={2}, which gives all particles the value?",
        one.name, one.persistent.describe(), clipped(given.value, kShown));
  }
}

/// A setting of a controller from outside that stands nowhere in the file: the controller may know it, and may as well
/// never ask for it. `file`: the scenario without what --set says.
void doubt_new_setting(const std::string& option, const std::string& path, const Settings& file) {
  constexpr std::string_view kIn = ".settings.";
  const std::size_t dot = path.find(kIn);
  if (dot == std::string::npos || !path.starts_with("policies.")) return;
  std::optional<Settings> at = file;
  std::string way = path.substr(0, dot + kIn.size() - 1);
  for (std::size_t begin = 0; at && begin < way.size();) {
    const std::size_t end = std::min(way.find('.', begin), way.size());
    at = at->is_map() ? at->find(way.substr(begin, end - begin)) : std::nullopt;
    begin = end + 1;
  }
  if (!at || !at->is_map()) return;
  std::vector<std::string> names;
  for (const auto& [name, value] : at->entries()) names.push_back(name);
  std::string wanted = path.substr(dot + kIn.size());
  wanted = wanted.substr(0, wanted.find('.'));
  if (names.empty() || at->has(wanted)) return;
  const std::string near = nearest(wanted, names);
  spdlog::warn("{} {}: {} is none of the settings that stand there ({}){}; the controller gets it beside them", option,
               clipped(path, kShown), clipped(wanted, kShown), fmt::join(names, ", "),
               near.empty() ? "" : fmt::format("; did you mean {}?", near));
}

}  // namespace

void doubt_settings(const std::string& option, const std::vector<std::string>& paths, const Scenario& scenario) {
  const auto of_settings = [](const std::string& path) { return path.find(".settings.") != std::string::npos; };
  if (std::ranges::none_of(paths, of_settings)) return;
  if (scenario.source.file == kStandardInput) return;  // it is there once
  const Settings as_written = Settings::load(scenario.source.file);
  for (const std::string& path : paths) doubt_new_setting(option, path, as_written);
}

void doubt_overrides(const std::vector<Override>& overrides, const Scenario& scenario) {
  std::vector<std::string> paths;
  for (const Override& given : overrides) {
    doubt_nominal(given, scenario);
    paths.push_back(given.path);
  }
  doubt_settings("--set", paths, scenario);
}

}  // namespace graze
