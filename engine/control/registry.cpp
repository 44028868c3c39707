#include "engine/control/registry.h"

#include "engine/settings/registry.h"

namespace graze {

const std::map<std::string, PolicyEntry>& policy_registry() { return registry<PolicyEntry>(); }

const std::map<std::string, TrackerEntry>& tracker_registry() { return registry<TrackerEntry>(); }

PolicyRegistration::PolicyRegistration(const std::string& name, Description text, PolicyFactory make) {
  enter(name, PolicyEntry{std::move(text), std::move(make)});
}

TrackerRegistration::TrackerRegistration(const std::string& name, Description text, TargetKind kind,
                                         TrackerFactory make) {
  enter(name, TrackerEntry{std::move(text), kind, std::move(make)});
}

void need_joint_targets(const Described& own, TargetKind kind, const std::string& policy) {
  if (kind == TargetKind::joint) return;
  own.settings().fail_key(policy +
                          " gives joint targets, and the tracker under control follows feet; use control: {joint_pd: "
                          "…}, {inverse_dynamics: …} or {torque: {}}");
}

std::vector<std::string> policy_names() { return registered_names<PolicyEntry>(); }

std::vector<std::string> tracker_names() { return registered_names<TrackerEntry>(); }

const Description& policy_text(const std::string& name) { return policy_registry().at(name).text; }

const Description& tracker_text(const std::string& name) { return tracker_registry().at(name).text; }

}  // namespace graze
