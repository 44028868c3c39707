// What logging costs: the curb campaign on the lane engine without an archive, with outcomes, margins and contact
// phases (what is recorded by default), with raw events in place of phases, and with telemetry of every step besides;
// on one thread and on two. Prints, for each, the rate, the share of processor time that goes into recording and
// archive (what it takes beyond the run without one), the same of the time on the clock, and the bytes of the shards
// per simulated second.
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>

#include "jobs/campaign/campaign.h"
#include "jobs/campaign/describe_campaign.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

struct Cost {
  double clock = 1e300, processor = 1e300;  // s
  double simulated = 0, bytes = 0;          // s, B
  std::uint64_t steps = 0, traces = 0;
};

double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double bytes_below(const fs::path& folder) {
  double bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) bytes += static_cast<double>(entry.file_size());
  }
  return bytes;
}

/// Runs the campaign once; keeps the least times.
void run_once(const Scenario& scenario, std::uint64_t particles, int threads, const fs::path& folder, bool archive,
              Cost& cost) {
  CampaignOptions options;
  options.particles = particles;
  options.seed = scenario.seed;
  options.threads = threads;
  const auto comm = make_local_communicator();
  const auto begin = std::chrono::steady_clock::now();
  const double processor = processor_seconds();
  if (archive) {
    CampaignWriter writer(folder, describe_campaign(scenario, particles, "bench"), true);
    run_campaign(scenario, options, *comm,
                 [&](int policy, std::vector<TraceRecord> traces, std::vector<double> values) {
                   writer.append(policy, std::move(traces), std::move(values));
                 });
    writer.finish();
  } else {
    run_campaign(scenario, options, *comm, [](int, std::vector<TraceRecord>, std::vector<double>) {});
  }
  cost.processor = std::min(cost.processor, processor_seconds() - processor);
  cost.clock = std::min(cost.clock, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  const CampaignProgress progress = progress_of(*comm);
  cost.steps = progress.steps;
  cost.traces = progress.traces;
  cost.simulated = static_cast<double>(progress.steps) * scenario.timing.step;
  cost.bytes = archive ? bytes_below(folder / "shards") : 0;
}

Scenario curb(const char* record) {
  ScenarioOptions options;
  options.overrides = {{"record", record}};
  return load_scenario(GRAZE_SOURCE_DIR "/data/scenarios/quadruped_curb.yaml", options);
}

void print(const char* what, const Cost& cost, const Cost& without) {
  fmt::print("  {:24} {:9.0f} steps/s  processor {:5.1f} %  clock {:5.1f} %", what,
             static_cast<double>(cost.steps) / cost.clock, 100 * (1 - without.processor / cost.processor),
             100 * (1 - without.clock / cost.clock));
  if (cost.bytes > 0) {
    fmt::print("  {:8.1f} kB per simulated second, {:.0f} B per trace", cost.bytes / cost.simulated / 1e3,
               cost.bytes / static_cast<double>(cost.traces));
  }
  fmt::print("\n");
}

void compare(std::uint64_t particles, int threads, int rounds, const fs::path& folder) {
  struct Kind {
    const char* what;
    const char* record;
    bool archive = true;
    Cost cost = {};
  };
  std::array kinds = {Kind{"no archive", "{telemetry: none, phases: false}", false},
                      Kind{"outcomes and phases", "{telemetry: none}"},
                      Kind{"outcomes and raw events", "{telemetry: none, phases: false, events: true}"},
                      Kind{"telemetry of every step", "{telemetry: all, every: 1, phases: false, events: true}"}};
  for (int round = 0; round < rounds; ++round) {  // in turn, so that a busy machine is busy for all
    for (Kind& kind : kinds) {
      run_once(curb(kind.record), particles, threads, folder / "bench.graze", kind.archive, kind.cost);
    }
  }
  fmt::print("{} particles, {} thread{}, least of {} rounds\n", particles, threads, threads > 1 ? "s" : "", rounds);
  for (const Kind& kind : kinds) print(kind.what, kind.cost, kinds.front().cost);
}

}  // namespace
}  // namespace graze

/// Arguments: particles, rounds, folder to write into.
int main(int argc, char** argv) {
  const std::uint64_t particles = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 256;
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 3;
  const std::filesystem::path folder =
      (argc > 3 ? std::filesystem::path(argv[3]) : std::filesystem::temp_directory_path()) /
      fmt::format("graze-bench-{}", getpid());
  std::filesystem::create_directories(folder);
  for (const int threads : {1, 2}) graze::compare(particles, threads, rounds, folder);
  std::filesystem::remove_all(folder);
}
