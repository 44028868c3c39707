// What sensing costs per control step of a block of eight: the curb scenario's quadruped with normal noise on all its
// channels, by instruction set; against the same draws made one by one; and what the shipped policies read.

#include <benchmark/benchmark.h>

#include "engine/control/policy.h"
#include "engine/physics.h"
#include "engine/sensing/noise.h"
#include "engine/sensing/sensors.h"
#include "sampling/stream.h"
#include "scenarios/scenario.h"

namespace graze {
namespace {

/// The curb scenario's first particles, standing.
struct Curb {
  Scenario scenario = load_scenario(GRAZE_SOURCE_DIR "/data/scenarios/quadruped_curb.yaml", {});
  std::vector<std::string> names = channel_names(scenario.world->robot);
  SensorNoise noise = sensor_noise(scenario, 1);
  std::unique_ptr<BlockPhysics> physics = make_physics(scenario.physics, scenario.model);
  BlockArray tau{scenario.model.na()};
  std::array<double, kLanes> time{};

  Particle particle(std::uint32_t id) const {
    Particle out;
    out.id = id;
    out.model = scenario.model;
    out.initial = initial_state(*scenario.world, scenario.model);
    out.joint_zero.assign(scenario.model.na(), 0.0);
    out.sensor_bias.assign(names.size(), 0.0);
    return out;
  }
  unsigned policy_reads() const {
    const State initial = initial_state(*scenario.world, scenario.model);
    const ControlContext context{scenario.model, initial, scenario.timing.control};
    return Controller(context, scenario.policies.back().settings).reads();
  }
};

void sense(benchmark::State& state, unsigned reads, Isa isa) {
  Curb curb;
  Sensors sensors(curb.scenario.model, curb.names, curb.noise, reads, isa);
  for (int lane = 0; lane < kLanes; ++lane) {
    const Particle particle = curb.particle(static_cast<std::uint32_t>(lane));
    curb.physics->start(lane, particle);
    sensors.start(lane, particle);
  }
  for (int i = 0; i < 20; ++i) curb.physics->step(1e-3, LaneMask::all(), curb.tau);
  Observation out;
  std::array<std::uint32_t, kLanes> step{};
  for (auto _ : state) {
    sensors.sense(*curb.physics, curb.tau, 1e-3, step, curb.time, LaneMask::all(), out);
    benchmark::DoNotOptimize(out.joint_position.row(0));
    for (std::uint32_t& s : step) ++s;
  }
  state.SetLabel("groups read: " + std::to_string(reads));
}

/// The noise of all channels alone.
void draw(benchmark::State& state, Isa isa) {
  const Curb curb;
  std::vector<LaneNoise::Channel> channels;
  for (std::size_t c = 0; c < curb.names.size(); ++c) {
    if (curb.noise.jitter[c])
      channels.push_back({name_hash(curb.names[c]), static_cast<int>(c), *curb.noise.jitter[c]});
  }
  LaneNoise noise(1, channels, isa);
  const int rows = static_cast<int>(curb.names.size());
  const BlockArray mean(rows);
  BlockArray out(rows);
  std::array<std::uint32_t, kLanes> particle = {0, 1, 2, 3, 4, 5, 6, 7}, step{};
  for (auto _ : state) {
    noise.draw(particle, step, LaneMask::all(), mean, out);
    benchmark::DoNotOptimize(out.row(0));
    for (std::uint32_t& s : step) ++s;
  }
  state.SetLabel(std::to_string(channels.size()) + " channels");
}

/// The same by sampling's own functions.
void draw_one_by_one(benchmark::State& state) {
  const Curb curb;
  std::vector<std::uint64_t> names;
  for (const std::string& name : curb.names) names.push_back(name_hash(name));
  const int rows = static_cast<int>(names.size());
  BlockArray out(rows);
  std::uint32_t step = 0;
  for (auto _ : state) {
    for (int c = 0; c < rows; ++c) {
      if (!curb.noise.jitter[c]) continue;
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        out(c, static_cast<int>(lane)) = curb.noise.jitter[c]->quantile(uniform(1, lane, names[c], step));
      }
    }
    benchmark::DoNotOptimize(out.row(0));
    ++step;
  }
}
BENCHMARK(draw_one_by_one)->Unit(benchmark::kMicrosecond);

void register_all() {
  const unsigned policy = Curb().policy_reads();
  for (const Isa isa : available_isas()) {
    const auto add = [&](const std::string& what, auto run) {
      benchmark::RegisterBenchmark((what + "/" + isa_name(isa)).c_str(), run)->Unit(benchmark::kMicrosecond);
    };
    add("draw", [=](benchmark::State& state) { draw(state, isa); });
    add("sense_all", [=](benchmark::State& state) { sense(state, kAllGroups, isa); });
    add("sense_for_policy", [=](benchmark::State& state) { sense(state, policy, isa); });
  }
}

}  // namespace
}  // namespace graze

int main(int argc, char** argv) {
  graze::register_all();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
