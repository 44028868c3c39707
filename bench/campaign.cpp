// What a campaign costs and where its time goes, by phase, on one thread: the whole curb campaign (policy, sensing,
// witnesses, events, archive) on both back ends, and a trot by joint servos without noise; and how the first scales to
// two threads.
#include "jobs/campaign/campaign.h"

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>

#include "archive/archive.h"
#include "engine/physics.h"
#include "jobs/campaign/describe_campaign.h"
#include "simulation/block_run.h"

namespace graze {
namespace {

constexpr const char* kScenario = GRAZE_SOURCE_DIR "/data/scenarios/quadruped_curb.yaml";
constexpr const char* kServoTrot = GRAZE_SOURCE_DIR "/bench/servo_trot.yaml";
constexpr std::uint64_t kParticles = 16;
constexpr std::uint64_t kMany = 256;  // beside which it does not count what an archive costs once

/// The curb campaign as it stands in data/, on a back end, with all contact models that this one has.
Scenario curb(const std::string& physics) {
  std::string models;
  for (const std::string& model : contact_models_of(physics)) models += (models.empty() ? "" : ", ") + model;
  ScenarioOptions options;
  options.overrides = {{"physics", physics}, {"uncertain.contact.model", "{choice: [" + models + "]}"}};
  return load_scenario(kScenario, options);
}

std::vector<std::string> parameter_paths(const Scenario& scenario) {
  std::vector<std::string> paths;
  for (const UncertainParameter& parameter : scenario.space.parameters) paths.push_back(parameter.name);
  return paths;
}

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "graze-bench-XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// Seconds since it was last asked.
class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Seconds of the parts of a campaign that are no phase of a step.
struct AroundSteps {
  double fabrication = 0, archive = 0;
};

/// All policies of a campaign, one after the other, as run_campaign() does it on one thread.
void run_all(const Scenario& scenario, std::uint64_t count, const std::filesystem::path& folder, RunCost& cost,
             AroundSteps& around) {
  Stopwatch watch;
  const Sampler sampler(scenario.space, scenario.design, scenario.seed, count);
  const Fabricator fabricator(scenario.world, parameter_paths(scenario));
  watch.lap();
  CampaignWriter writer(folder, describe_campaign(scenario, count, "bench"), true);
  around.archive += watch.lap();
  for (int policy = 0; policy < static_cast<int>(scenario.policies.size()); ++policy) {
    BlockRun run(scenario, scenario.policies[policy], scenario.seed);
    for (std::uint32_t first = 0; first < count; first += kLanes) {
      watch.lap();
      std::vector<Particle> particles;
      std::vector<double> values;
      for (std::uint32_t i = first; i < first + kLanes; ++i) {
        const std::vector<double> drawn = sampler.draw(i);
        particles.push_back(fabricator.fabricate(i, drawn));
        values.insert(values.end(), drawn.begin(), drawn.end());
      }
      around.fabrication += watch.lap();
      std::vector<TraceRecord> records = run.run(particles, &cost);
      watch.lap();
      writer.append(policy, std::move(records), std::move(values));
      around.archive += watch.lap();
    }
  }
  watch.lap();
  writer.finish();
  around.archive += watch.lap();
}

/// Rate, and nanoseconds per particle-step of each phase.
void campaign(benchmark::State& state, const Scenario& scenario, std::uint64_t particles = kParticles) {
  const TemporaryFolder folder;
  RunCost cost;
  cost.timed = true;
  AroundSteps around;
  for (auto _ : state) run_all(scenario, particles, folder / "bench.graze", cost, around);
  const auto steps = static_cast<double>(cost.steps);
  state.counters["particle-steps/s"] = benchmark::Counter(steps, benchmark::Counter::kIsRate);
  for (int phase = 0; phase < kPhases; ++phase) {
    state.counters[std::string(kPhaseNames[phase]) + "_ns"] = 1e9 * cost.seconds[phase] / steps;
  }
  state.counters["fabrication_ns"] = 1e9 * around.fabrication / steps;
  state.counters["archive_ns"] = 1e9 * around.archive / steps;
}
BENCHMARK_CAPTURE(campaign, lanes, curb("lanes"))->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(campaign, bullet, curb("bullet"))->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(campaign, servo_trot, load_scenario(kServoTrot))->Unit(benchmark::kMillisecond)->UseRealTime();

BENCHMARK_CAPTURE(campaign, servo_trot_of_256, load_scenario(kServoTrot), kMany)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// The runner as `graze run` uses it, without an archive, on one and two threads.
void threads(benchmark::State& state, const std::string& physics) {
  const Scenario scenario = curb(physics);
  CampaignOptions options;
  options.particles = kParticles;
  options.threads = static_cast<int>(state.range(0));
  std::uint64_t steps = 0;
  for (auto _ : state) {
    const std::unique_ptr<Communicator> comm = make_local_communicator();
    run_campaign(scenario, options, *comm, [](int, std::vector<TraceRecord>, std::vector<double>) {});
    steps += progress_of(*comm).steps;
  }
  state.counters["particle-steps/s"] = benchmark::Counter(static_cast<double>(steps), benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(threads, lanes, "lanes")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(threads, bullet, "bullet")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

void fabrication(benchmark::State& state) {
  const Scenario scenario = curb("lanes");
  const Sampler sampler(scenario.space, scenario.design, scenario.seed, kParticles);
  const Fabricator fabricator(scenario.world, parameter_paths(scenario));
  std::uint32_t particle = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(fabricator.fabricate(particle, sampler.draw(particle)));
    particle = (particle + 1) % kParticles;
  }
}
BENCHMARK(fabrication)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace graze

BENCHMARK_MAIN();
