// What one control step costs a block: policy, lag and tracker, without sensing and physics. LINKS walks over the
// curb's parameters; its joints swing to and fro, and its feet swing and stand by the clock.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "engine/control/policy.h"
#include "engine/lanes/isa.h"
#include "scenarios/scenario.h"

namespace graze {
namespace {

constexpr const char* kScenario = GRAZE_SOURCE_DIR "/data/scenarios/quadruped_curb.yaml";

/// `control`: the tracker; empty: the scenario's own. Lag in s, with the curb's jitter of a third of a millisecond if
/// it is not 0.
void walk(benchmark::State& state, const char* isa, const std::string& control, double lag) {
  setenv("GRAZE_ISA", isa, 1);
  ScenarioOptions options;
  if (!control.empty()) options.overrides = {{"policies.step.control", control}};
  const Scenario scenario = load_scenario(kScenario, options);
  const State initial = initial_state(*scenario.world, scenario.model);
  const double period = scenario.timing.control;
  Controller controller(ControlContext{scenario.model, initial, period}, scenario.policies.back().settings);
  unsetenv("GRAZE_ISA");

  // One cycle of observations. Lanes are refilled at different times; here they are spread over a cycle of 0.3 s.
  const int na = scenario.model.na(), cycle = static_cast<int>(std::lround(0.3 / period));
  std::vector<Observation> observations(cycle);
  for (int step = 0; step < cycle; ++step) {
    Observation& out = observations[step];
    out.joint_position = out.joint_velocity = BlockArray(na);
    out.base_rpy = BlockArray(3);
    out.link_force = BlockArray(static_cast<int>(scenario.model.frames.size()));
    for (int i = 0; i < out.link_force.rows(); ++i) std::fill_n(out.link_force.row(i), kLanes, 5.0);
    for (int lane = 0; lane < kLanes; ++lane) {
      for (int k = 0; k < na; ++k) {
        const double q0 = initial.q[scenario.model.bodies[scenario.model.actuated[k]].q];
        const double angle = 2 * M_PI * (step + 75.0 * lane) / cycle + k;
        out.joint_position(k, lane) = q0 + 0.1 * std::sin(angle);
        out.joint_velocity(k, lane) = 0.1 * 2 * M_PI / 0.3 * std::cos(angle);
      }
    }
  }
  ActuatorCommand command(na);
  for (int lane = 0; lane < kLanes; ++lane) controller.start(lane, lag, 0);
  int step = 0;
  for (auto _ : state) {
    Observation& observation = observations[step % cycle];
    double jitter[kLanes] = {};
    for (int lane = 0; lane < kLanes; ++lane) {
      observation.time[lane] = (step + 75 * lane) * period;
      if (lag > 0) jitter[lane] = 0.33e-3 * ((step * 7 + lane * 13) % 5 - 2) / 2;
    }
    controller.act(observation, jitter, LaneMask::all(), command);
    benchmark::DoNotOptimize(command.tau.row(0));
    ++step;
  }
  state.SetLabel("us per block of 8");
}

void add(const std::string& isa) {
  const auto name = [&](const char* what) { return std::string(what) + "/" + isa; };
  const auto bench = [&](const char* what, const std::string& control, double lag) {
    benchmark::RegisterBenchmark(name(what).c_str(), [=](benchmark::State& state) {
      walk(state, isa.c_str(), control, lag);
    })->Unit(benchmark::kMicrosecond);
  };
  bench("gait_operational_pd", "", 0.005);
  bench("gait_operational_pd_no_lag", "", 0);
  bench("gait_joint_pd", "{joint_pd: {kp: 20, kd: 0.1}}", 0.005);
}

}  // namespace
}  // namespace graze

int main(int argc, char** argv) {
  for (const graze::Isa isa : graze::available_isas()) graze::add(graze::isa_name(isa));
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
