#include <algorithm>

#include "engine/control/chain.h"
#include "engine/control/lag_buffer.h"
#include "engine/control/registry.h"

namespace graze {

namespace {

/// The targets that hold the nominal initial state: what the robot does before the first delayed command arrives.
Targets initial_targets(const ControlContext& context, const std::vector<int>& effectors) {
  const Model& model = context.nominal;
  Targets targets(model.na(), static_cast<int>(effectors.size()));
  for (int lane = 0; lane < kLanes; ++lane) {
    for (int k = 0; k < model.na(); ++k) {
      targets.q(k, lane) = context.initial.q[model.bodies[model.actuated[k]].q];
    }
    for (std::size_t e = 0; e < effectors.size(); ++e) {
      const Chain chain(model, effectors[e]);
      targets.x.set_column(lane, chain.position(chain.select(context.initial.q)), static_cast<int>(3 * e));
    }
  }
  return targets;
}

/// The entry of a policy map that names the policy. Throws InputError.
std::pair<std::string, Settings> policy_entry(const Settings& settings) {
  const std::vector<std::string> names = policy_names();
  std::vector<std::string> keys = names;
  keys.push_back("control");
  settings.allow(keys);
  std::optional<std::pair<std::string, Settings>> chosen;
  for (const auto& [key, value] : settings.entries()) {
    if (key == "control") continue;
    if (chosen) value.fail_key("a second policy beside " + chosen->first + "; a policy is one of them");
    chosen.emplace(key, value);
  }
  if (chosen) return *chosen;
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  settings.fail("names no policy; one of " + list + " must stand here");
}

}  // namespace

struct Controller::Impl {
  std::unique_ptr<Policy> policy;
  std::unique_ptr<Tracker> tracker;
  std::array<double, kLanes> lag{}, momentary_lag{};
  TargetKind kind = TargetKind::joint;
  Targets targets;
  const Targets* in_force = &targets;
  std::optional<LagBuffer> buffer;
};

Controller::Controller(const ControlContext& context, const Settings& settings) : impl_(std::make_unique<Impl>()) {
  const auto [policy, policy_settings] = policy_entry(settings);
  const auto [tracker, tracker_settings] = settings.at("control").single(tracker_names());
  const TrackerEntry& entry = tracker_registry().at(tracker);
  impl_->kind = entry.kind;
  impl_->policy = policy_registry().at(policy)(context, policy_settings, entry.kind);
  const std::vector<int> effectors = impl_->policy->effectors();
  impl_->tracker = entry.make(context, tracker_settings, effectors);
  impl_->targets = initial_targets(context, effectors);
  impl_->buffer.emplace(impl_->targets, context.period, context.end, entry.kind);
}

Controller::~Controller() = default;

void Controller::start(int lane, double lag) {
  impl_->lag[lane] = lag;
  impl_->policy->start(lane);
  impl_->buffer->start(lane, lag);
}

void Controller::act(const Observation& observation, const double* lag_jitter, LaneMask active,
                     ActuatorCommand& command) {
  Impl& own = *impl_;
  own.policy->act(observation, active, own.targets);
  std::array<double, kLanes>& lag = own.momentary_lag;
  lag = own.lag;
  for (int lane = 0; lane < kLanes && lag_jitter != nullptr; ++lane) lag[lane] += lag_jitter[lane];
  own.in_force = &own.buffer->pass(observation.time, lag, active, own.targets);
  own.tracker->track(observation, *own.in_force, active, command);
}

unsigned Controller::reads() const { return impl_->policy->reads() | impl_->tracker->reads(); }

TargetKind Controller::kind() const { return impl_->kind; }

const Policy& Controller::policy() const { return *impl_->policy; }

const Targets& Controller::targets() const { return impl_->targets; }

const Targets& Controller::targets_in_force() const { return *impl_->in_force; }

double Controller::lag(int lane) const { return std::max(impl_->momentary_lag[lane], 0.0); }

}  // namespace graze
