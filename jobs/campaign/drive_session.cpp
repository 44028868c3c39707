#include "jobs/campaign/drive_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "engine/control/base_command.h"
#include "engine/model/placement.h"
#include "engine/model/rotation.h"
#include "engine/settings/signal_stack.h"
#include "jobs/campaign/nominal_traces.h"
#include "simulation/predictor.h"

namespace graze {
namespace {

constexpr double kLeastGap = 0.25;  // s, from the choice of a gait to the switch: time for an operator to see it

/// The part of a policy's settings whose base is told where to go: "gait", "network"; none: it has no such part.
std::optional<std::string> driven_part(const Settings& policy) {
  for (const char* part : {"gait", "network"}) {
    const auto settings = policy.find(part);
    if (!settings) continue;
    for (const std::string& key : steering_keys()) {
      if (settings->has(key)) return part;
    }
  }
  return std::nullopt;
}

/// Its settings without its own way.
Settings without_way(const Settings& policy) {
  const std::string part = driven_part(policy).value();
  Settings settings = policy.at(part);
  for (const std::string& key : steering_keys()) {
    if (settings.has(key)) settings = settings.without(key);
  }
  return policy.with(part, settings);
}

/// The policy with a constant command in place of its own way.
PolicySpec under_command(const PolicySpec& policy, const CommandRow& row) {
  const Settings velocity =
      Settings::parse(fmt::format("velocity: [{}, {}, {}]", row.forward, row.strafe, row.turn), "the command given");
  PolicySpec out = policy;
  out.settings =
      without_way(policy.settings).with(driven_part(policy.settings).value() + ".velocity", velocity.at("velocity"));
  return out;
}

const PolicySpec& policy_of(const Simulation& simulation, const std::string& name) {
  return simulation.scenario().policies[static_cast<std::size_t>(simulation.policy(name))];
}

std::vector<std::string> drivable(const Simulation& simulation) {
  std::vector<std::string> out;
  std::string kind;
  std::set<std::string> seen;
  for (const PolicySpec& policy : simulation.scenario().policies) {
    if (!driven_part(policy.settings)) continue;
    const std::string own = policy_kind(under_command(policy, {}));
    if (out.empty()) kind = own;
    if (own != kind) continue;
    // Policies that differ in their way alone are one to drive under.
    if (seen.insert(without_way(policy.settings).resolved_text()).second) out.push_back(policy.name);
  }
  if (!out.empty()) return out;
  throw InputError(simulation.scenario().file +
                   ": has no policy that can be driven: a gait or network with velocity, waypoints or commands");
}

State state_in(const BlockState& all, int lane) { return {all.q.column(lane), all.v.column(lane)}; }

}  // namespace

DriveSession::DriveSession(const Simulation& simulation, std::optional<std::uint32_t> particle, GaitTrial trial,
                           bool frames)
    : simulation_(simulation), trial_(trial), names_(drivable(simulation)), frames_(frames) {
  if (!simulation.nominal().floating_base) {
    throw InputError(simulation.scenario().file +
                     ": the robot's base is fixed to the world; there is nothing to drive");
  }
  if (particle) {
    robot_ = simulation.particle(*particle);
  } else {
    robot_ = Fabricator(simulation.scenario().world, {}).nominal();
    robot_.id = kNominalParticle;
  }
  CommandRow still;
  still.policy = names_.front();
  rows_.push_back(still);
  begin(nullptr);
}

DriveSession::~DriveSession() = default;

void DriveSession::begin(std::shared_ptr<const SavedTrace> saved) {
  spec_ = std::make_unique<PolicySpec>(under_command(policy_of(simulation_, names_[now_]), rows_.back()));
  run_ = std::make_unique<BlockRun>(simulation_.scenario(), *spec_, simulation_.scenario().seed);
  RunOptions options;
  options.observer = this;
  if (saved) options.saved = {&saved, 1};
  run_->begin({&robot_, 1}, options);
}

bool DriveSession::see(const StepView& view) {
  saver_ = &view.saver;
  time_ = view.time;
  if (view.ends) ended_ = true;
  if (wants_estimate_) start_trial(view);
  look(view);
  if (frames_ && view.step > view.first) FrameWatch::add_contacts(view, contacts_);
  return true;
}

TraceFrames DriveSession::frame() {
  TraceFrames out;
  out.time = {sight_.time};
  FrameWatch::add_poses(robot_.model, X_WB_, out);
  FrameWatch::take_contacts(contacts_, out);
  return out;
}

void DriveSession::look(const StepView& view) {
  const int lane = view.lane;
  state_ = state_in(view.physics.state(), lane);
  X_WB_ = place_bodies(view.model, state_.q);
  sight_.time = view.time;
  sight_.position = X_WB_[0].translation();
  const Mat3 R = X_WB_[0].linear();
  sight_.yaw = std::atan2(R(1, 0), R(0, 0));
  sight_.tilt = std::acos(std::clamp(R(2, 2), -1.0, 1.0));
  const double c = std::cos(sight_.yaw), s = std::sin(sight_.yaw);
  const double vx = state_.v[3], vy = state_.v[4];
  sight_.velocity = {c * vx + s * vy, c * vy - s * vx, state_.v[2]};
  if (feet_.empty()) feet_ = view.controller.policy().effectors();
  sight_.feet.resize(feet_.size());
  for (std::size_t i = 0; i < feet_.size(); ++i) {
    const Frame& frame = view.model.frames[static_cast<std::size_t>(feet_[i])];
    DriveSight::Foot& foot = sight_.feet[i];
    foot.name = frame.name;
    foot.position = frame_pose(view.model, X_WB_, feet_[i]).translation();
    foot.touches = false;
    for (const Frame& other : view.model.frames) {
      if (other.body != frame.body || view.step == view.first) continue;
      foot.touches |= view.truth.link_force(static_cast<int>(&other - view.model.frames.data()), lane) > 0;
    }
  }
}

void DriveSession::apply(std::size_t policy, CommandRow row) {
  if (ended_) return;
  row.time = time_;
  row.policy = names_[policy];
  const CommandRow& last = rows_.back();
  if (policy == now_ && row.forward == last.forward && row.strafe == last.strafe && row.turn == last.turn) return;
  if (last.time == row.time) rows_.pop_back();
  rows_.push_back(row);
  now_ = policy;
  changed_ = true;
}

void DriveSession::command(double forward, double strafe, double turn) {
  apply(now_, CommandRow{0, forward, strafe, turn});
}

void DriveSession::go_on_under(std::size_t policy, const CommandRow& row) { apply(policy, row); }

double DriveSession::cycle() const {
  const auto gait = policy_of(simulation_, names_[now_]).settings.find("gait");
  const double control = simulation_.scenario().timing.control;
  const double duration = gait ? gait->at("duration").number(Quantity::time) : kLeastGap;
  return std::round(duration * std::max(1.0, std::ceil(kLeastGap / duration)) / control) * control;
}

void DriveSession::choose(std::size_t policy) {
  if (ended_ || next_ || policy == now_) return;
  if (trial_.particles == 0) {
    apply(policy, rows_.back());
    return;
  }
  next_ = policy;
  switch_time_ = time_ + cycle();
  wants_memory_ = true;
}

/// What the sensors read when the policy was chosen stands in the next step. Where there are no
/// sensors the truth of that moment serves.
void DriveSession::start_trial(const StepView& view) {
  wants_estimate_ = false;
  const Scenario& scenario = simulation_.scenario();
  StateEstimate estimate = read_estimate(scenario, view.sensed, view.lane, truth_);
  estimate.memory = memory_;
  Scenario copy = scenario;
  copy.policies = {under_command(policy_of(simulation_, names_[now_]), rows_.back()),
                   under_command(policy_of(simulation_, names_[*next_]), rows_.back())};
  verdict_ = std::async(std::launch::async, [this, copy = std::move(copy), estimate = std::move(estimate)]() mutable {
    const SignalStack stack;
    return try_out(std::move(copy), estimate);
  });
}

GaitVerdict DriveSession::try_out(Scenario scenario, const StateEstimate& estimate) const {
  GaitVerdict out;
  out.from = scenario.policies[0].name;
  out.to = scenario.policies[1].name;
  out.horizon = std::min(trial_.horizon, scenario.timing.end - estimate.time);
  const std::vector<Requirement> requirements = scenario.task.requirements;
  const Simulation simulation(std::move(scenario), trial_.particles);
  Predictor predictor(simulation, {out.from, out.to});
  PredictionLimits limits;
  limits.horizon = out.horizon;
  limits.particles = trial_.particles;
  const Prediction told = predictor.predict(estimate, limits);
  const auto kept = [](const CandidatePrediction& one) {
    const double fails = static_cast<double>(one.outcomes[static_cast<std::size_t>(Outcome::known_failure)]);
    return 1 - fails / static_cast<double>(one.valid());  // NaN: none is valid
  };
  const CandidatePrediction& next = told.candidates[1];
  out.particles = next.valid();
  out.kept = kept(next);
  out.kept_by_stay = kept(told.candidates[0]);
  out.accepted = out.kept >= trial_.accept;
  const auto most = std::max_element(next.violated.begin(), next.violated.end());
  if (most != next.violated.end() && *most > 0) {
    out.first_violated = requirements[static_cast<std::size_t>(most - next.violated.begin())].name;
  }
  return out;
}

std::optional<GaitVerdict> DriveSession::advance() {
  if (ended_) return std::nullopt;
  if (std::exchange(wants_memory_, false)) {
    memory_ = saver_->remember(0);
    truth_ = state_;
    wants_estimate_ = true;
  }
  if (std::exchange(changed_, false)) begin(saver_->save(0));
  const Timing& timing = simulation_.scenario().timing;
  for (int i = 0; i < timing.steps_per_control() && run_->step(); ++i) {
  }
  if (!next_ || !verdict_.valid()) return std::nullopt;
  if (!ended_ && time_ < switch_time_ - kCommandSlack) return std::nullopt;
  const GaitVerdict verdict = verdict_.get();
  const std::size_t policy = *std::exchange(next_, std::nullopt);
  if (verdict.accepted) apply(policy, rows_.back());
  return verdict;
}

void DriveSession::stop() {
  if (ended_) return;
  ended_ = true;
  run_->stop(LaneMask::first(1));
}

}  // namespace graze
