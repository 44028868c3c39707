// What a control step of the policy `network` costs: a perceptron 48-256-128-64-12 with ELUs, as trained for legged
// robots, in single and double precision, and what of it is the policy around the network.

#include "engine/network/network.h"

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <fstream>

#include "engine/control/policy.h"
#include "engine/lanes/isa.h"
#include "scenarios/scenario.h"
#include "tests/engine/network/onnx_bytes.h"

namespace graze {
namespace {

using testing::Numbers;
using testing::perceptron;

const NetworkKernel& kernel_of(Isa isa) { return GRAZE_KERNEL(isa, find_network_kernel); }

void count_steps(benchmark::State& state) {
  state.counters["steps/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * kLanes, benchmark::Counter::kIsRate);
}

void evaluate(benchmark::State& state, Isa isa, const std::vector<int>& widths, const std::string& activation,
              Numbers type) {
  const Network network(perceptron(widths, activation, type), kernel_of(isa));
  BlockArray memory = network.memory();
  for (const int row : network.inputs()[0].rows) {
    for (int lane = 0; lane < kLanes; ++lane) memory(row, lane) = 0.01 * row - 0.02 * lane;
  }
  for (auto _ : state) {
    network.run(memory);
    benchmark::DoNotOptimize(memory.row(0));
  }
  count_steps(state);
}

/// The whole control step of a quadruped: observation, network, targets, tracker.
void control(benchmark::State& state, Isa isa) {
  const std::string file = "/tmp/graze_bench_network.onnx";
  std::ofstream(file, std::ios::binary) << perceptron({48, 256, 128, 64, 12}, "Elu", Numbers::float32);
  setenv("GRAZE_ISA", isa_name(isa).c_str(), 1);
  const Scenario scenario = load_scenario(GRAZE_SOURCE_DIR "/data/scenarios/quadruped_curb.yaml", ScenarioOptions{});
  const State initial = initial_state(*scenario.world, scenario.model);
  Controller controller(
      ControlContext{scenario.model, initial, scenario.timing.control},
      Settings::parse(
          "{network: {file: " + file +
              ", inputs: [base_velocity, base_rate, gravity, command, joint_position, "
              "joint_velocity, last_action], velocity: [0.5, 0, 0], scale: 0.25}, control: {joint_pd: {kp: 20}}}",
          "bench.yaml"));
  unsetenv("GRAZE_ISA");
  std::remove(file.c_str());
  const int na = scenario.model.na();
  Observation observation;
  observation.joint_position = observation.joint_velocity = BlockArray(na);
  observation.base_rpy = observation.base_velocity = observation.base_rate = BlockArray(3);
  ActuatorCommand command(na);
  for (int lane = 0; lane < kLanes; ++lane) controller.start(lane, 0, 0);
  for (auto _ : state) {
    controller.act(observation, nullptr, LaneMask::all(), command);
    benchmark::DoNotOptimize(command.q.row(0));
  }
  count_steps(state);
}

void add_all() {
  for (const Isa isa : available_isas()) {
    const auto add = [&](const std::string& name, auto function) {
      benchmark::RegisterBenchmark((name + "/" + isa_name(isa)).c_str(), function)->Unit(benchmark::kMicrosecond);
    };
    const std::vector<int> usual{48, 256, 128, 64, 12};
    add("network_float32", [=](auto& state) { evaluate(state, isa, usual, "Elu", Numbers::float32); });
    add("network_float64", [=](auto& state) { evaluate(state, isa, usual, "Elu", Numbers::float64); });
    add("network_relu", [=](auto& state) { evaluate(state, isa, usual, "Relu", Numbers::float32); });
    add("control_step", [=](auto& state) { control(state, isa); });
  }
}

}  // namespace
}  // namespace graze

int main(int argc, char** argv) {
  graze::add_all();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
