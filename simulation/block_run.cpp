#include "simulation/block_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/contact/events.h"
#include "engine/contact/phases.h"
#include "engine/model/limits.h"
#include "engine/physics.h"
#include "simulation/beginnings.h"
#include "simulation/change_counts.h"
#include "simulation/disturbances.h"
#include "simulation/invalid_reason.h"
#include "simulation/lag_noise.h"
#include "simulation/lane_controllers.h"
#include "simulation/lane_digests.h"
#include "simulation/names.h"
#include "simulation/telemetry.h"
#include "simulation/watchdog.h"
#include "simulation/watched_sensors.h"

namespace graze {
namespace {

std::vector<double> to_vector(const BlockArray& array, int lane) {
  const Eigen::VectorXd column = array.column(lane);
  return {column.begin(), column.end()};
}

}  // namespace

struct BlockRun::Impl final : TraceSaver {
  /// What one lane is busy with.
  struct Lane {
    const Particle* particle = nullptr;
    TraceRecord* record = nullptr;
    std::uint32_t step = 0;   // physics steps done, counted from t = 0
    std::uint32_t first = 0;  // at which it began
  };

  const Scenario& scenario;
  const PolicySpec& policy;
  const int per_control;
  int last_step;  // at which traces end
  State initial;
  std::unique_ptr<BlockPhysics> physics;
  LaneControllers controllers;
  Sensors sensors;  // senses what the controller reads
  Actuators actuators;
  TaskMonitor monitor;
  EventTracker events;
  PhaseTracker phases;
  TelemetryRecorder telemetry;
  LaneNoise lag_jitter;
  Observation observation;
  ActuatorCommand command;
  BlockArray tau;
  const BlockArray no_lag{1};
  BlockArray lag{1};  // s, jitter of this control step
  std::array<Lane, kLanes> lanes;
  Digests digests{};
  std::array<ChangeCounts, kLanes> last_changes;  // of the steps that did not converge
  LaneMask active, ending;                        // ending: of those that are shown
  std::array<double, kLanes> farthest{};          // m or rad
  std::uint64_t steps_done = 0;
  PhaseClock clock;
  TraceObserver* observer = nullptr;
  BlockArray requirement_values, objective_values;  // for the observer
  WatchedSensors watched;                           // for the observer
  const std::uint64_t seed;
  TraceWatch* watch = nullptr;
  std::shared_ptr<const TraceKind> kind;  // made when first needed
  // What is being run: BlockRun::begin.
  RunOptions options;
  std::vector<Particle> moved;  // particles that begin elsewhere
  std::span<const Particle> particles;
  std::vector<std::uint32_t> firsts;  // steps at which they begin
  std::size_t next = 0;               // the first that has no lane yet
  std::vector<TraceRecord> records;   // of `particles`

  Impl(const Scenario& s, const PolicySpec& chosen, std::uint64_t root_seed)
      : scenario(s),
        policy(chosen),
        per_control(s.timing.steps_per_control()),
        last_step(s.timing.steps()),
        initial(initial_state(*s.world, s.model)),
        physics(make_physics(s.physics, s.model)),
        controllers(ControlContext{s.model, initial, s.timing.control, physics->solves_drives(), s.timing.end,
                                   root_seed, policy.name, nullptr, s.controller_urdf},
                    policy.settings),
        sensors(s.model, channel_names(s.world->robot), sensor_noise(s, root_seed), controllers.reads()),
        actuators(s.model, s.torque_speed, physics->solves_drives()),
        monitor(s.task),
        events(s.model),
        phases(s.recording.rules),
        telemetry(s.recording, s.timing.step),
        lag_jitter(lag_noise(s, root_seed)),
        command(s.model.na()),
        tau(s.model.na()),
        seed(root_seed) {}

  std::size_t index_of(int lane) const { return static_cast<std::size_t>(lanes[lane].record - records.data()); }
  double time(int lane) const { return lanes[lane].step * scenario.timing.step; }

  std::array<double, kLanes> times() const {
    std::array<double, kLanes> out;
    for (int lane = 0; lane < kLanes; ++lane) out[lane] = time(lane);
    return out;
  }

  /// All but the bodies.
  void prepare(int lane, const Particle& particle, std::uint32_t first, TraceRecord& record) {
    lanes[lane] = {&particle, &record, first, first};
    if (watch) watch->begin(lane);
    digests[lane] = particle.id;
    last_changes[lane].clear();
    if (scenario.recording.events) events.start(lane, particle.model);
    phases.start(lane);
    sensors.start(lane, particle);
    watched.start(lane, particle);
    actuators.start(lane, particle);
    controllers.start(lane, particle, options.informed);
    monitor.start(lane, particle.model);
    for (int k = 0; k < tau.rows(); ++k) tau(k, lane) = 0;
    telemetry.start(lane);
  }

  void start(int lane, const Particle& particle, std::uint32_t first, const ControllerMemory* memory,
             TraceRecord& record) {
    prepare(lane, particle, first, record);
    if (memory) recall(lane, *memory);
    physics->start(lane, particle);
    active.set(lane);
    if (telemetry.on()) telemetry.take(lane, first, false, false, frame_source());
    LaneMask fresh;
    fresh.set(lane);
    const LaneMask ended = judge(fresh);
    finish(LaneMask(ended.bits() | show(fresh, ended).bits()));
  }

  /// Writes down, or reads back after prepare(), what the lane's further way depends on beside its bodies, between two
  /// control steps. Sensors are not in it: what they read is drawn and summed up at each control step.
  void carry(int lane, LaneTape& tape) {
    tape.carry(lanes[lane].step), tape.carry(lanes[lane].first), tape.carry(digests[lane]);
    tape.carry(tau, lane);
    SolverLog& log = lanes[lane].record->solver;
    tape.carry(log.mean_sweeps), tape.carry(log.most_sweeps);
    tape.carry(log.largest_residual), tape.carry(log.unconverged_steps);
    tape.carry(log.steps), tape.carry(log.braked_steps), tape.carry(log.most_braked);
    last_changes[lane].carry(tape);
    carry_controller(lane, tape);
    monitor.carry(lane, tape);
    if (scenario.recording.events) events.carry(lane, tape);
    phases.carry(lane, tape);
    telemetry.carry(lane, tape);
    tape.end();
  }

  void carry_controller(int lane, LaneTape& tape) { controllers.carry(lane, tape), actuators.carry(lane, tape); }

  void check_control_step(int lane) const {
    if (lanes[lane].step % per_control == 0) return;
    throw SavedTraceError(fmt::format("a trace is saved at a control step, one in {} steps; step {} is none",
                                      per_control, lanes[lane].step));
  }

  [[noreturn]] void fail_lane(int lane, const std::logic_error& error) const {
    const std::uint32_t id = lanes[lane].particle->id;
    throw SavedTraceError((id == kParticleLimit ? "the nominal robot" : fmt::format("particle {}", id)) + ", " +
                          policy.name + ": " + error.what());
  }

  std::shared_ptr<const ControllerMemory> remember(int lane) override try {
    check_control_step(lane);
    LaneTape tape;
    carry_controller(lane, tape);
    return std::make_shared<const ControllerMemory>(
        ControllerMemory{numbering_of(scenario.model), policy_kind(policy), time(lane), tape.take()});
  } catch (const std::logic_error& error) {
    fail_lane(lane, error);
  }

  void recall(int lane, const ControllerMemory& memory) try {
    LaneTape tape(memory.content);
    carry_controller(lane, tape);
    tape.end();
  } catch (const std::logic_error& error) {
    fail_lane(lane, error);
  }

  std::shared_ptr<const SavedTrace> save(int lane) override try {
    const Lane& l = lanes[lane];
    check_control_step(lane);
    if (ending[lane]) return nullptr;
    LaneTape tape;
    carry(lane, tape);
    if (!kind) kind = std::make_shared<const TraceKind>(trace_kind(scenario, policy));
    return std::make_shared<const SavedTrace>(SavedTrace{l.particle->id, own_numbers_of(*l.particle), l.step,
                                                         time(lane), physics->save(lane), tape.take(), kind});
  } catch (const std::logic_error& error) {
    fail_lane(lane, error);
  }

  /// The frame of the step at which a trace is saved is taken when it goes on; that of its start was the first of all.
  void go_on(int lane, const Particle& particle, const SavedTrace& saved, TraceRecord& record) {
    prepare(lane, particle, 0, record);
    LaneTape tape(saved.rest);
    try {
      carry(lane, tape);
      physics->restore(lane, *saved.physics);
    } catch (const std::logic_error& error) {
      fail_lane(lane, error);
    }
    active.set(lane);
    const bool taken = lanes[lane].step == lanes[lane].first;
    if (telemetry.on() && !taken) {
      telemetry.take(lane, lanes[lane].step, false, monitor.violated(lane) >= 0, frame_source());
    }
  }

  FrameSource frame_source() const { return {physics->state().q, physics->state().v, tau}; }

  WitnessInput witness_input(LaneMask of) const {
    return {physics->state(), physics->contact_points(), tau, actuators.headroom(), times(), of};
  }

  /// Whether a body or joint is where neither gaps nor turns can be told any more (engine/model/limits.h).
  bool is_astray(int lane) const { return farthest[lane] > std::min(kMaxLength, kMaxAngle); }

  /// Largest of the coordinates of each lane, m or rad.
  void find_farthest() {
    const BlockArray& q = physics->state().q;
    farthest.fill(0);
    for (int i = 0; i < q.rows(); ++i) {
      const double* row = q.row(i);
      for (int lane = 0; lane < kLanes; ++lane) farthest[lane] = std::max(farthest[lane], std::abs(row[lane]));
    }
  }

  std::string why_astray(int lane) const {
    const TraceNames names = trace_names(scenario.model);
    const BlockArray& q = physics->state().q;
    int i = 0;
    while (std::abs(q(i, lane)) < farthest[lane]) ++i;
    return fmt::format("{} is {:.4g}, beyond {:g} m or rad, where rounding hides gaps and turns", names.q_names.at(i),
                       q(i, lane), std::min(kMaxLength, kMaxAngle));
  }

  /// Looks at some lanes after a step (or at their start); returns those whose traces end here.
  LaneMask judge(LaneMask of) {
    find_farthest();
    LaneMask faulty, over;
    for (int lane = 0; lane < kLanes; ++lane) {
      faulty.set(lane, of[lane] && (physics->fault(lane) || is_astray(lane)));
      over.set(lane, of[lane] && static_cast<int>(lanes[lane].step) >= last_step);
    }
    const LaneMask violated = monitor.update(witness_input(LaneMask(of.bits() & ~faulty.bits())));
    const unsigned stopped = scenario.task.stop_at_violation ? violated.bits() : 0;
    return LaneMask(faulty.bits() | over.bits() | stopped);
  }

  /// Shows some lanes to the observer; returns those that it wants to end here. `ended`: those that end anyhow.
  LaneMask show(LaneMask some, LaneMask ended) {
    LaneMask enough;
    if (!observer) return enough;
    ending = ended;
    monitor.values(witness_input(some), requirement_values, objective_values);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!some[lane]) continue;
      const bool more = observer->see({lane, lanes[lane].particle->id, index_of(lane), lanes[lane].step,
                                       lanes[lane].first, time(lane), *physics, tau, actuators.headroom(), command,
                                       requirement_values, objective_values, lanes[lane].particle->model,
                                       controllers.of(lane), watched.sensed(), watched.truth(), ended[lane], *this});
      enough.set(lane, !more);
      lanes[lane].record->stopped = !more && !ended[lane];
    }
    return enough;
  }

  /// Ends the traces of some lanes.
  void finish(LaneMask ended) {
    if (!ended.any()) return;
    monitor.finish(witness_input(ended));
    for (int lane = 0; lane < kLanes; ++lane) {
      if (ended[lane]) finish(lane);
    }
  }

  void finish(int lane) {
    Lane& l = lanes[lane];
    TraceRecord& record = *l.record;
    record.digest = digests[lane];
    SolverLog& solver = record.solver;
    // A bin's middle may lie above all that is in it.
    if (solver.unconverged_steps > 0) {
      solver.median_residual = std::min(last_changes[lane].median(), solver.largest_residual);
    }
    record.end_time = time(lane);
    record.margins = monitor.margins(lane);
    record.first_violations = monitor.first_violations(lane);
    record.margin_parts = monitor.margin_parts(lane);
    record.violation_parts = monitor.violation_parts(lane);
    record.objective_culprit = monitor.objective_culprit(lane);
    record.q = to_vector(physics->state().q, lane);
    record.v = to_vector(physics->state().v, lane);
    record.events = events.take(lane);
    record.phases = phases.take(lane);
    record.sequence = contact_sequence(scenario.model, record.phases);
    record.objective_margin = monitor.objective_margin(lane);
    if (physics->fault(lane) || is_astray(lane)) {
      record.outcome = Outcome::invalid;
      const std::string why = physics->fault(lane) ? *physics->fault(lane) : why_astray(lane);
      record.invalid_reason = invalid_reason(controller_failure(scenario.model, command, lane) + why, l.step,
                                             time(lane), l.particle->model, *physics, lane);
      record.objective_margin = std::numeric_limits<double>::quiet_NaN();
      record.objective_culprit = {};
    } else if (monitor.violated(lane) >= 0) {
      record.outcome = Outcome::known_failure;
      record.violated = monitor.violated(lane);
    } else {
      record.outcome = monitor.objective_met(lane) ? Outcome::success : Outcome::unknown_failure;
    }
    if (telemetry.on()) record.telemetry = telemetry.hand_over(lane, record.outcome != Outcome::success);
    if (!scenario.recording.phases) record.phases.clear();
    active.set(lane, false);
    if (watch) watch->end(lane);
  }

  /// Senses and acts in the lanes whose control step is due.
  void control() {
    LaneMask due;
    std::array<std::uint32_t, kLanes> step{};
    std::array<std::uint32_t, kLanes> particle{};
    std::array<double, kLanes> now{};
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane] || lanes[lane].step % per_control != 0) continue;
      due.set(lane);
      step[lane] = lanes[lane].step / per_control;
      now[lane] = time(lane);
      particle[lane] = lanes[lane].particle->id;
    }
    if (!due.any()) return;
    clock.ended(Phase::bookkeeping);
    sensors.sense(*physics, tau, scenario.timing.step, step, now, due, observation);
    watched.sense(*physics, tau, scenario.timing.step, step, now, due);
    if (!lag_jitter.empty()) lag_jitter.draw(particle, step, due, no_lag, lag);
    clock.ended(Phase::sensing);
    controllers.act(observation, lag_jitter.empty() ? nullptr : lag.row(0), due, command);
    clock.ended(Phase::control);
  }

  void log_effort(int at) {
    const SolverEffort effort = physics->effort(at);
    const Lane& lane = lanes[at];
    SolverLog& log = lane.record->solver;
    log.mean_sweeps += (effort.sweeps - log.mean_sweeps) / (lane.step - lane.first);
    log.most_sweeps = std::max(log.most_sweeps, effort.sweeps);
    log.largest_residual = std::max(log.largest_residual, effort.residual);
    log.steps += effort.sweeps > 0 ? 1 : 0;
    log.braked_steps += effort.braked > kBraked ? 1 : 0;
    log.most_braked = std::max(log.most_braked, effort.braked);
    if (!effort.unconverged) return;
    log.unconverged_steps += 1;
    last_changes[at].add(effort.residual);
  }

  void disturb_lanes() {
    if (scenario.world->disturbances.empty()) return;
    for (int lane = 0; lane < kLanes; ++lane) {
      const Lane& l = lanes[lane];
      if (active[lane]) disturb(lane, *l.particle, {l.step, l.first, scenario.timing.step}, *physics);
    }
  }

  void advance() {
    control();
    disturb_lanes();
    actuators.step(command, *physics, sensors, scenario.timing.step, active, tau);
    clock.ended(Phase::physics);  // with what little the actuators do around it
    for (int lane = 0; lane < kLanes; ++lane) {
      lanes[lane].step += active[lane];
      if (active[lane]) log_effort(lane);
    }
    steps_done += std::popcount(active.bits());
    fold(digests, physics->state().q);
    fold(digests, physics->state().v);
    fold(digests, tau);
    clock.ended(Phase::digest);
    if (scenario.recording.events) events.update(times(), physics->contact_points(), physics->state(), active);
    phases.update(times(), physics->contact_points(), active);
    clock.ended(Phase::events);
    LaneMask ended = judge(active);
    clock.ended(Phase::witnesses);
    ended = LaneMask(ended.bits() | show(active, ended).bits());
    if (telemetry.on()) add_frames(ended);
    finish(ended);
    clock.ended(Phase::records);
  }

  void add_frames(LaneMask ended) {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      telemetry.take(lane, lanes[lane].step, ended[lane], monitor.violated(lane) >= 0, frame_source());
    }
  }

  /// True when every lane is at a control step: fresh traces that begin here keep in step with the others, so that all
  /// lanes are sensed and controlled together.
  bool at_control_step() const {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (active[lane] && lanes[lane].step % per_control != 0) return false;
    }
    return true;
  }

  /// Gives free lanes to particles that wait.
  void fill() {
    if (next == particles.size() || !at_control_step()) return;
    for (int lane = 0; lane < kLanes; ++lane) {
      while (!active[lane] && next < particles.size()) {
        const std::size_t i = next++;
        if (options.saved.empty()) {
          const auto memory = options.beginnings.empty() ? nullptr : options.beginnings[i].memory.get();
          start(lane, particles[i], firsts[i], memory, records[i]);
        } else {
          go_on(lane, particles[i], *options.saved[i], records[i]);
        }
      }
    }
  }

  void begin(std::span<const Particle> given, const RunOptions& chosen) {
    check_saved(scenario, policy, given, chosen);
    check_beginnings(scenario, policy, given.size(), chosen);
    options = chosen;
    particles = given;
    firsts.assign(given.size(), 0);
    if (!options.beginnings.empty()) {
      for (std::size_t i = 0; i < firsts.size(); ++i) firsts[i] = first_step(scenario.timing, options.beginnings[i]);
      moved = begun_elsewhere(given, options.beginnings);
      particles = moved;
    }
    observer = options.observer;
    watched.begin(scenario, seed, observer && observer->senses());
    records.assign(particles.size(), {});
    for (std::size_t i = 0; i < particles.size(); ++i) records[i].particle = particles[i].id;
    steps_done = 0;
    last_step = scenario.timing.steps();
    if (options.end > 0) last_step = static_cast<int>(std::lround(options.end / scenario.timing.step));
    active = LaneMask();  // what a block that was past its deadline has left
    next = 0;
    if (watch) watch->begin_block();
    fill();
  }

  bool step() {
    if (active.any()) advance();
    if (watch) watch->check(), watch->count(steps_done);
    fill();
    return active.any();
  }

  void stop(LaneMask some) {
    const LaneMask ended(some.bits() & active.bits());
    for (int lane = 0; lane < kLanes; ++lane) {
      if (ended[lane]) lanes[lane].record->stopped = true;
    }
    finish(ended);
    fill();
  }
};

BlockRun::BlockRun(const Scenario& scenario, const PolicySpec& policy, std::uint64_t seed)
    : impl_(std::make_unique<Impl>(scenario, policy, seed)) {}
BlockRun::~BlockRun() = default;
BlockRun::BlockRun(BlockRun&&) noexcept = default;
void BlockRun::watch(TraceWatch* watch) { impl_->watch = watch; }

std::vector<TraceRecord> BlockRun::run(std::span<const Particle> particles, RunCost* cost, const RunOptions& options) {
  impl_->clock.begin(cost && cost->timed ? &cost->seconds : nullptr);
  impl_->begin(particles, options);
  while (impl_->active.any()) impl_->step();
  if (cost) cost->steps += impl_->steps_done;
  return std::move(impl_->records);
}

void BlockRun::begin(std::span<const Particle> particles, const RunOptions& options) {
  impl_->clock.begin(nullptr);
  impl_->begin(particles, options);
}
bool BlockRun::step() { return impl_->step(); }
void BlockRun::stop(LaneMask lanes) { impl_->stop(lanes); }
const std::vector<TraceRecord>& BlockRun::records() const { return impl_->records; }
const std::vector<Event>& BlockRun::events(int lane) const { return impl_->events.events(lane); }

}  // namespace graze
