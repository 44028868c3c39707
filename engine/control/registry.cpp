#include "engine/control/registry.h"

#include <cassert>

namespace graze {

std::map<std::string, PolicyEntry>& policy_registry() {
  static std::map<std::string, PolicyEntry> registry;
  return registry;
}

std::map<std::string, TrackerEntry>& tracker_registry() {
  static std::map<std::string, TrackerEntry> registry;
  return registry;
}

PolicyRegistration::PolicyRegistration(const std::string& name, Description text, PolicyFactory make) {
  [[maybe_unused]] const bool fresh =
      policy_registry().emplace(name, PolicyEntry{std::move(text), std::move(make)}).second;
  assert(fresh && "two policies of one name");
}

TrackerRegistration::TrackerRegistration(const std::string& name, Description text, TargetKind kind,
                                         TrackerFactory make) {
  [[maybe_unused]] const bool fresh =
      tracker_registry().emplace(name, TrackerEntry{std::move(text), kind, std::move(make)}).second;
  assert(fresh && "two trackers of one name");
}

std::vector<std::string> policy_names() {
  std::vector<std::string> names;
  for (const auto& [name, entry] : policy_registry()) names.push_back(name);
  return names;
}

std::vector<std::string> tracker_names() {
  std::vector<std::string> names;
  for (const auto& [name, entry] : tracker_registry()) names.push_back(name);
  return names;
}

const Description& policy_text(const std::string& name) { return policy_registry().at(name).text; }

const Description& tracker_text(const std::string& name) { return tracker_registry().at(name).text; }

}  // namespace graze
