#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <typeinfo>

#include "engine/control/lag_buffer.h"
#include "engine/control/registry.h"
#include "engine/control/wrong_level.h"
#include "engine/dynamics/chain.h"
#include "engine/settings/merged.h"
#include "engine/settings/warnings.h"

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
SettingsEntry policy_entry(const Settings& settings) {
  const std::vector<std::string> names = policy_names();
  std::vector<std::string> keys = names;
  keys.push_back("control");
  refuse_wrong_level(settings, Component::policy);
  settings.allow(keys);
  std::optional<SettingsEntry> chosen;
  for (const SettingsEntry& entry : settings.entries()) {
    if (entry.first == "control") continue;
    if (chosen) {
      entry.second.fail_key("a second policy beside " + chosen->first + "; a policy is one of them" +
                            replace_hint(*chosen, entry));
    }
    chosen.emplace(entry);
  }
  if (chosen) return *chosen;
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  settings.fail("names no policy; one of " + list + " must stand here");
}

/// The one entry of `control`. Throws InputError.
SettingsEntry tracker_entry(const Settings& control) {
  const std::vector<std::string> names = tracker_names();
  const std::vector<SettingsEntry> entries = control.is_map() ? control.entries() : std::vector<SettingsEntry>{};
  refuse_wrong_level(control, Component::tracker);
  if (entries.size() == 2) {
    const std::string merged = replace_hint(entries[0], entries[1]);
    if (!merged.empty()) entries[1].second.fail_key("a second tracker beside " + entries[0].first + merged);
  }
  return control.single(names);
}

/// Prescribed joints are at their targets after one physics step, wherever they stand before.
void doubt_jump(const ControlContext& context, const Settings& settings, Policy& policy) {
  if (policy.reads() != 0) return;  // what it wants depends on what it will sense
  const Model& model = context.nominal;
  Targets first(model.na(), 0);
  policy.start(0);
  policy.act(Observation{}, LaneMask(1u), first);
  double most = 1;
  std::string text;
  for (int k = 0; k < model.na(); ++k) {
    const Body& body = model.bodies[model.actuated[k]];
    const bool turns = body.type == JointType::revolute;
    const double from = context.initial.q[body.q], to = first.q(k, 0);
    const double jump = std::abs(to - from) / (turns ? 0.1 : 0.01);  // rad, m: no step of a motion goes so far
    if (!(jump > most)) continue;
    most = jump;
    text = fmt::format(
        "begins with joint {} at {:.4g} {}, which stands at {:.4g}: prescribed motion takes it there in "
        "one step; let it begin there, by robot.initial.joints",
        body.joint, to, turns ? "rad" : "m", from);
  }
  if (!text.empty()) warn(settings, text);
}

}  // namespace

struct Controller::Impl {
  PolicyDraws draws;  // outlives the policy
  std::unique_ptr<Policy> policy;
  std::unique_ptr<Tracker> tracker;
  std::array<double, kLanes> lag{}, momentary_lag{};
  TargetKind kind = TargetKind::joint;
  Targets targets;
  const Targets* in_force = &targets;
  std::optional<LagBuffer> buffer;
};

Controller::Controller(const ControlContext& given, const Settings& settings) : impl_(std::make_unique<Impl>()) {
  impl_->draws = PolicyDraws(given.seed, given.name, given.period);
  ControlContext context = given;
  context.draws = &impl_->draws;
  const auto [policy, policy_settings] = policy_entry(settings);
  const auto [tracker, tracker_settings] = tracker_entry(settings.at("control"));
  const TrackerEntry& entry = tracker_registry().at(tracker);
  impl_->kind = entry.kind;
  impl_->policy =
      policy_registry().at(policy).make(context, Described(policy_settings, policy_text(policy)), entry.kind);
  const std::vector<int> effectors = impl_->policy->effectors();
  impl_->tracker = entry.make(context, Described(tracker_settings, entry.text), effectors);
  const std::string action = policy == "network" ? policy_settings.text_or("action", "") : "";
  const auto kd = tracker == "joint_pd" ? tracker_settings.find("kd") : std::nullopt;
  if (tracker == "joint_pd" && action == "velocity" && (!kd || (kd->is_scalar() && kd->text() == "0"))) {
    warn(settings, "the network's action is velocities, which count by kd, and that is 0: the network does nothing");
  }
  if (tracker == "torque" && action != "torque" &&
      (policy == "joint_trajectory" || policy == "tool_path" || policy == "gait" || policy == "network")) {
    warn(settings,
         fmt::format("'{}' wants {}, which the tracker 'torque' passes over: the robot is limp; use control: "
                     "{{joint_pd: {{{}: …}}}}{}",
                     policy, action == "velocity" ? "velocities" : "positions", action == "velocity" ? "kd" : "kp",
                     policy == "network" ? ", or action: torque if the network gives torques" : ""));
  }
  if (tracker == "prescribed") doubt_jump(context, policy_settings, *impl_->policy);
  impl_->targets = initial_targets(context, effectors);
  impl_->buffer.emplace(impl_->targets, context.period, context.end, entry.kind);
}

Controller::~Controller() = default;

bool Controller::know(int lane, const Controller& other) {
  if (!impl_->tracker->know(lane, *other.impl_->tracker) || !impl_->policy->know(lane, *other.impl_->policy)) {
    return false;
  }
  impl_->buffer->know(lane, *other.impl_->buffer);
  return true;
}

void Controller::start(int lane, double lag, std::uint32_t particle) {
  impl_->lag[lane] = lag;
  impl_->draws.start(lane, particle);
  impl_->policy->start(lane);
  impl_->tracker->start(lane);
  impl_->buffer->start(lane, lag);
}

void Controller::carry(int lane, LaneTape& tape) {
  Policy& policy = *impl_->policy;
  Tracker& tracker = *impl_->tracker;
  tape.same(typeid(policy).name());
  policy.carry(lane, tape);
  tape.same(typeid(tracker).name());
  tracker.carry(lane, tape);
  Targets& targets = impl_->targets;
  for (BlockArray* rows : {&targets.q, &targets.v, &targets.tau, &targets.x, &targets.xd}) tape.carry(*rows, lane);
  impl_->buffer->carry(lane, tape);
}

void Controller::act(const Observation& observation, const double* lag_jitter, LaneMask active,
                     ActuatorCommand& command) {
  Impl& own = *impl_;
  own.draws.begin_step(observation.time);
  own.policy->act(observation, active, own.targets);
  std::array<double, kLanes>& lag = own.momentary_lag;
  lag = own.lag;
  for (int lane = 0; lane < kLanes && lag_jitter != nullptr; ++lane) lag[lane] += lag_jitter[lane];
  bool lagged = lag_jitter != nullptr;
  for (int lane = 0; lane < kLanes; ++lane) lagged = lagged || (active[lane] && lag[lane] > 0);
  // Where none ever lags nothing is recorded.
  own.in_force = lagged ? &own.buffer->pass(observation.time, lag, active, own.targets) : &own.targets;
  own.tracker->track(observation, *own.in_force, active, command);
}

unsigned Controller::reads() const { return impl_->policy->reads() | impl_->tracker->reads(); }

TargetKind Controller::kind() const { return impl_->kind; }

const Policy& Controller::policy() const { return *impl_->policy; }

const Tracker& Controller::tracker() const { return *impl_->tracker; }

const Targets& Controller::targets() const { return impl_->targets; }

const Targets& Controller::targets_in_force() const { return *impl_->in_force; }

double Controller::lag(int lane) const { return std::max(impl_->momentary_lag[lane], 0.0); }

}  // namespace graze
