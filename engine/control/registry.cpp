#include "engine/control/registry.h"

#include <cassert>

namespace graze {

std::map<std::string, PolicyFactory>& policy_registry() {
  static std::map<std::string, PolicyFactory> registry;
  return registry;
}

std::map<std::string, TrackerEntry>& tracker_registry() {
  static std::map<std::string, TrackerEntry> registry;
  return registry;
}

PolicyRegistration::PolicyRegistration(const std::string& name, PolicyFactory make) {
  [[maybe_unused]] const bool fresh = policy_registry().emplace(name, std::move(make)).second;
  assert(fresh && "two policies of one name");
}

TrackerRegistration::TrackerRegistration(const std::string& name, TargetKind kind, TrackerFactory make) {
  [[maybe_unused]] const bool fresh = tracker_registry().emplace(name, TrackerEntry{kind, std::move(make)}).second;
  assert(fresh && "two trackers of one name");
}

std::vector<std::string> policy_names() {
  std::vector<std::string> names;
  for (const auto& [name, make] : policy_registry()) names.push_back(name);
  return names;
}

std::vector<std::string> tracker_names() {
  std::vector<std::string> names;
  for (const auto& [name, entry] : tracker_registry()) names.push_back(name);
  return names;
}

}  // namespace graze
