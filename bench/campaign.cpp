// What a campaign costs beside its physics: the curb campaign (policy, sensing, witnesses, events) against the same
// traces re-simulated from their recorded torques by the back end alone. The difference is ours to make small.
#include "jobs/campaign.h"

#include <benchmark/benchmark.h>

#include "jobs/block_run.h"

namespace graze {
namespace {

constexpr const char* kScenario = GRAZE_SOURCE_DIR "/data/scenarios/quadruped_curb.yaml";

Scenario curb(const std::string& telemetry) {
  ScenarioOptions options;
  // Every step is kept for the replay; traces run on after a violation, so that all have the same length.
  options.overrides = {{"time.end", "0.3 s"},
                       {"record", "{telemetry: " + telemetry + ", every: 1, events: true}"},
                       {"task.stop_at_violation", "false"}};
  return load_scenario(kScenario, options);
}

std::vector<Particle> block(const Scenario& scenario) {
  const Sampler sampler(scenario.space, scenario.design, scenario.seed, kLanes);
  std::vector<std::string> paths;
  for (const UncertainParameter& parameter : scenario.space.parameters) paths.push_back(parameter.name);
  const Fabricator fabricator(scenario.world, paths);
  std::vector<Particle> particles;
  for (std::uint32_t i = 0; i < kLanes; ++i) particles.push_back(fabricator.fabricate(i, sampler.draw(i)));
  return particles;
}

void count_steps(benchmark::State& state, std::uint64_t steps) {
  state.counters["particle-steps/s"] = benchmark::Counter(static_cast<double>(steps), benchmark::Counter::kIsRate);
}

void whole_campaign(benchmark::State& state) {
  const Scenario scenario = curb("none");
  const std::vector<Particle> particles = block(scenario);
  BlockRun run(scenario, scenario.policies.back(), scenario.seed);
  RunCost cost;
  for (auto _ : state) benchmark::DoNotOptimize(run.run(particles, &cost));
  count_steps(state, cost.steps);
}
BENCHMARK(whole_campaign)->Unit(benchmark::kMillisecond);

void physics_alone(benchmark::State& state) {
  const Scenario scenario = curb("all");
  const std::vector<Particle> particles = block(scenario);
  const std::vector<TraceRecord> traces = BlockRun(scenario, scenario.policies.back(), scenario.seed).run(particles);
  const auto physics = make_physics(scenario.physics, scenario.model);
  BlockArray tau(scenario.model.na());
  std::uint64_t steps = 0;
  for (auto _ : state) {
    for (int lane = 0; lane < kLanes; ++lane) physics->start(lane, particles[lane]);
    for (std::size_t frame = 1; frame < traces[0].telemetry.size(); ++frame) {
      for (int lane = 0; lane < kLanes; ++lane) {
        const std::vector<double>& torque = traces[lane].telemetry[frame].tau;
        for (int k = 0; k < tau.rows(); ++k) tau(k, lane) = torque[k];
      }
      physics->step(scenario.timing.step, LaneMask::all(), tau);
      steps += kLanes;
    }
  }
  for (int lane = 0; lane < kLanes; ++lane) {
    const Eigen::VectorXd q = physics->state().q.column(lane);
    if (!std::equal(q.begin(), q.end(), traces[lane].q.begin())) state.SkipWithError("the replay left the trace");
  }
  count_steps(state, steps);
}
BENCHMARK(physics_alone)->Unit(benchmark::kMillisecond);

/// The same campaign on one and two threads.
void threads(benchmark::State& state) {
  const Scenario scenario = curb("none");
  CampaignOptions options;
  options.particles = 64;
  options.threads = static_cast<int>(state.range(0));
  std::uint64_t steps = 0;
  for (auto _ : state) {
    CampaignProgress progress;
    run_campaign(scenario, options, progress, [](int, std::vector<TraceRecord>, std::vector<double>) {});
    steps += progress.steps;
  }
  count_steps(state, steps);
}
BENCHMARK(threads)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

void fabrication(benchmark::State& state) {
  const Scenario scenario = curb("none");
  for (auto _ : state) benchmark::DoNotOptimize(block(scenario));
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) * kLanes);
}
BENCHMARK(fabrication)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace graze

BENCHMARK_MAIN();
