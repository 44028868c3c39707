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

/// Takes the state and the controller's memory at a step, and what is sensed then, which the next step shows.
class StateTaker : public TraceObserver {
 public:
  StateTaker(const Scenario& scenario, std::uint32_t step) : scenario_(scenario), step_(step) {}

  bool see(const StepView& view) override {
    if (view.step < step_) return true;
    if (view.step == step_) {
      truth_ = state_at(view.physics.state(), view.lane);
      remember(view);
      return true;
    }
    taken.emplace();
    taken->estimate = read_estimate(scenario_, view.sensed, view.lane, truth_);
    taken->estimate.memory = memory_;
    taken->remembers = memory_ != nullptr;
    return false;
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
  std::uint32_t step_;
  State truth_;
  std::shared_ptr<const ControllerMemory> memory_;
};

}  // namespace

NominalEstimate nominal_estimate(const Simulation& simulation, const std::string& policy, double time) {
  const Scenario& scenario = simulation.scenario();
  const Timing& timing = scenario.timing;
  const double periods = std::round(time / timing.control);
  if (!(time >= 0 && periods * timing.control < timing.end - 0.5 * timing.step)) {
    throw InputError(
        fmt::format("{:g} s: no prediction can begin there; the scenario's traces end at {:g} s", time, timing.end));
  }
  StateTaker taker(scenario,
                   static_cast<std::uint32_t>(periods) * static_cast<std::uint32_t>(timing.steps_per_control()));
  Particle robot = Fabricator(scenario.world, {}).nominal();
  robot.id = kNominalParticle;
  const TraceRecord trace = std::move(Simulator(simulation, policy).run({&robot, 1}, {.observer = &taker}).front());
  if (taker.taken) return *std::move(taker.taken);
  std::string how = std::string(outcome_name(trace.outcome));
  if (trace.violated >= 0) {
    how += " of '" + scenario.task.requirements.at(static_cast<std::size_t>(trace.violated)).name + "'";
  }
  if (!trace.invalid_reason.empty()) how += ": " + trace.invalid_reason;
  throw InputError(fmt::format("{:g} s: the nominal robot does not come so far under {}: its trace ends at {:g} s ({})",
                               time, policy, trace.end_time, how));
}

}  // namespace graze
