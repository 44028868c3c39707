#include "jobs/campaign/nominal_estimate.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "jobs/campaign/nominal_traces.h"

namespace graze {
namespace {

State state_at(const BlockState& all, int lane) {
  State out;
  out.q.resize(all.q.rows());
  out.v.resize(all.v.rows());
  for (int i = 0; i < all.q.rows(); ++i) out.q[i] = all.q(i, lane);
  for (int i = 0; i < all.v.rows(); ++i) out.v[i] = all.v(i, lane);
  return out;
}

constexpr std::uint32_t kNoStep = 0xffffffff;

/// Takes the state and the controller's memory at a step, and what is sensed then, which the next step shows; saves the
/// trace at another.
class StateTaker : public TraceObserver {
 public:
  /// `verdict`: kNoStep, or no less than `step`.
  StateTaker(const Scenario& scenario, std::uint32_t step, std::uint32_t verdict)
      : scenario_(scenario), step_(step), verdict_(verdict) {}

  bool see(const StepView& view) override {
    if (view.step < step_) return true;
    if (view.step == verdict_) saved_ = view.save();
    if (view.step == step_) {
      truth_ = state_at(view.physics.state(), view.lane);
      remember(view);
      return true;
    }
    if (!taken) {
      taken.emplace();
      taken->estimate = read_estimate(scenario_, view.sensed, view.lane, truth_);
      taken->estimate.memory = memory_;
      taken->remembers = memory_ != nullptr;
    }
    taken->saved = saved_;
    return verdict_ != kNoStep && !saved_;
  }

  std::optional<NominalEstimate> taken;

 private:
  void remember(const StepView& view) {
    try {
      memory_ = view.remember();
    } catch (const SavedTraceError&) {
    }
  }

  const Scenario& scenario_;
  std::uint32_t step_, verdict_;
  State truth_;
  std::shared_ptr<const SavedTrace> saved_;
  std::shared_ptr<const ControllerMemory> memory_;
};

/// With an id that no particle of a campaign has.
Particle nominal_robot(const Scenario& scenario) {
  Particle out = Fabricator(scenario.world, {}).nominal();
  out.id = kNominalParticle;
  return out;
}

}  // namespace

NominalEstimate nominal_estimate(const Simulation& simulation, const std::string& policy, const NominalTimes& times) {
  const Scenario& scenario = simulation.scenario();
  const Timing& timing = scenario.timing;
  const auto step_of = [&](double periods) {
    return static_cast<std::uint32_t>(periods) * static_cast<std::uint32_t>(timing.steps_per_control());
  };
  const double periods = std::round(times.at / timing.control);
  if (!(times.at >= 0 && periods * timing.control < timing.end - 0.5 * timing.step)) {
    throw InputError(fmt::format("{:g} s: no prediction can begin there; the scenario's traces end at {:g} s", times.at,
                                 timing.end));
  }
  const bool waits = times.verdict >= times.at && times.verdict < timing.end;
  const double verdict = std::ceil(times.verdict / timing.control - 1e-6);  // the first control step that knows it
  StateTaker taker(scenario, step_of(periods), waits ? step_of(verdict) : kNoStep);
  const Particle robot = nominal_robot(scenario);
  const TraceRecord trace = std::move(Simulator(simulation, policy).run({&robot, 1}, {.observer = &taker}).front());
  if (taker.taken) return *std::move(taker.taken);
  throw InputError(fmt::format("{:g} s: the nominal robot does not come so far under {}: its trace ends at {:g} s ({})",
                               times.at, policy, trace.end_time, how_it_ends(scenario, trace)));
}

TraceRecord gone_on(const Simulation& simulation, const std::string& policy, std::shared_ptr<const SavedTrace> saved) {
  const Particle robot = nominal_robot(simulation.scenario());
  return std::move(Simulator(simulation, policy).run({&robot, 1}, {.saved = {&saved, 1}}).front());
}

std::string how_it_ends(const Scenario& scenario, const TraceRecord& trace) {
  std::string how = std::string(outcome_name(trace.outcome));
  if (trace.violated >= 0) {
    how += " of '" + scenario.task.requirements.at(static_cast<std::size_t>(trace.violated)).name + "'";
  }
  if (!trace.invalid_reason.empty()) how += ": " + trace.invalid_reason;
  return how;
}

}  // namespace graze
