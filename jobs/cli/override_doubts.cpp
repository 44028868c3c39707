#include "jobs/cli/override_doubts.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/settings/settings.h"
#include "jobs/cli/shipped.h"
#include "scenarios/policies.h"

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

}  // namespace

void doubt_settings(const std::string& option, const std::vector<std::string>& paths, const Scenario& scenario) {
  const auto of_settings = [](const std::string& path) { return path.find(".settings.") != std::string::npos; };
  if (std::ranges::none_of(paths, of_settings)) return;
  if (scenario.source.file == kStandardInput) return;  // it is there once
  const Settings as_written = Settings::load(scenario.source.file);
  for (const std::string& path : paths) {
    const std::string doubt = path.starts_with("policies.") ? doubted_setting(as_written, path) : "";
    if (!doubt.empty()) spdlog::warn("{} {}: {}", option, clipped(path, kShown), doubt);
  }
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
