// What writing, packing and reading an archive costs: traces per second, bytes per trace and per simulated second of
// telemetry. Records are of the curb's size (19 + 18 state numbers, 12 actuators, 175 parameters, 4 requirements).
#include "archive/archive.h"

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

namespace graze {
namespace {

namespace fs = std::filesystem;

class Folder {
 public:
  Folder() {
    std::string pattern = (fs::temp_directory_path() / "graze-bench-XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~Folder() { fs::remove_all(path_); }
  fs::path operator/(const char* name) const { return path_ / name; }

 private:
  fs::path path_;
};

CampaignInfo curb_info() {
  CampaignInfo info;
  info.particles = 1000;
  info.step = info.control = 0.001;
  info.end = 1.5;
  info.policies = {"step"};
  info.parameters.resize(175);
  info.requirements.resize(4);
  info.q_names.resize(19, "q");
  info.v_names.resize(18, "v");
  info.actuator_names.resize(12, "tau");
  info.colliders.resize(20, "part");
  return info;
}

/// Smooth, but no two frames equal: about as compressible as joint angles of a gait.
std::vector<double> wave(double phase, std::size_t n) {
  std::vector<double> values(n);
  for (std::size_t i = 0; i < n; ++i) values[i] = std::sin(phase + 0.7 * static_cast<double>(i));
  return values;
}

TraceRecord record(const CampaignInfo& info, std::uint32_t particle, int events, int frames) {
  TraceRecord r;
  r.particle = particle;
  r.outcome = static_cast<Outcome>(particle % 3);
  r.violated = r.outcome == Outcome::known_failure ? 1 : -1;
  r.end_time = info.end;
  r.margins = r.first_violations = wave(particle, info.requirements.size());
  r.q = wave(particle, info.q_names.size());
  r.v = wave(particle, info.v_names.size());
  r.digest = particle * 0x9E3779B97F4A7C15u;
  r.sequence = "LF_FOOT-ground RH_FOOT-ground " + std::to_string(particle % 1000);
  for (int i = 0; i < events; ++i) r.events.push_back({0.01 * i, EventKind::contact_begin, 0, 1 + i % 7});
  for (int i = 0; i < frames; ++i) {
    const double phase = particle + 0.06 * i;
    r.telemetry.add({0.01 * i, wave(phase, info.q_names.size()), wave(phase + 1, info.v_names.size()),
                     wave(phase + 2, info.actuator_names.size())});
  }
  return r;
}

void write(const fs::path& path, const CampaignInfo& info, std::uint32_t particles, int events, int frames) {
  CampaignWriter writer(path, info, true);
  for (std::uint32_t first = 0; first < particles; first += 8) {
    std::vector<TraceRecord> traces;
    std::vector<double> values;
    for (std::uint32_t i = first; i < first + 8; ++i) {
      traces.push_back(record(info, i, events, frames));
      if (!info.store_values) continue;
      const auto drawn = wave(i, info.parameters.size());
      values.insert(values.end(), drawn.begin(), drawn.end());
    }
    writer.append(0, std::move(traces), std::move(values));
  }
  writer.finish();
}

std::uintmax_t bytes_of(const fs::path& path) {
  if (fs::is_regular_file(path)) return fs::file_size(path);
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(path)) {
    if (entry.is_regular_file()) bytes += entry.file_size();
  }
  return bytes;
}

/// Arguments: traces, events per trace, frames per trace (0: no telemetry; 150 frames are 1.5 s at every tenth step).
void BM_Write(benchmark::State& state) {
  const Folder folder;
  const CampaignInfo info = curb_info();
  const auto traces = static_cast<std::uint32_t>(state.range(0));
  for (auto _ : state)
    write(folder / "a.graze", info, traces, static_cast<int>(state.range(1)), static_cast<int>(state.range(2)));
  state.SetItemsProcessed(state.iterations() * traces);
  state.counters["bytes/trace"] = static_cast<double>(bytes_of(folder / "a.graze")) / traces;
}
BENCHMARK(BM_Write)->Args({8000, 40, 0})->Args({800, 40, 150})->Unit(benchmark::kMillisecond);

void BM_Pack(benchmark::State& state) {
  const Folder folder;
  const CampaignInfo info = curb_info();
  const auto traces = static_cast<std::uint32_t>(state.range(0));
  write(folder / "a.graze", info, traces, static_cast<int>(state.range(1)), static_cast<int>(state.range(2)));
  for (auto _ : state) pack(folder / "a.graze", folder / "a.h5", true);
  state.SetItemsProcessed(state.iterations() * traces);
  const double bytes = static_cast<double>(bytes_of(folder / "a.h5"));
  state.counters["bytes/trace"] = bytes / traces;
  if (state.range(2) > 0) {
    write(folder / "b.graze", info, traces, static_cast<int>(state.range(1)), 0);
    pack(folder / "b.graze", folder / "b.h5", true);
    state.counters["telemetry bytes/s"] = (bytes - static_cast<double>(bytes_of(folder / "b.h5"))) / (1.5 * traces);
  }
}
BENCHMARK(BM_Pack)->Args({8000, 40, 0})->Args({800, 40, 150})->Unit(benchmark::kMillisecond);

/// All columns of one policy; from a directory and from a packed file. Without values, so that a million fits anywhere.
void BM_Read(benchmark::State& state) {
  const Folder folder;
  CampaignInfo info = curb_info();
  info.store_values = false;
  const auto traces = static_cast<std::uint32_t>(state.range(0));
  info.particles = traces;  // rows of others are passed over
  write(folder / "a.graze", info, traces, 0, 0);
  pack(folder / "a.graze", folder / "a.h5", true);
  const fs::path path = state.range(1) != 0 ? folder / "a.h5" : folder / "a.graze";
  for (auto _ : state) {
    const Archive archive(path);
    double sum = 0;
    archive.scan("step", kAllColumns & ~kEvents, [&](const TraceRows& rows) {
      for (std::size_t i = 0; i < rows.size(); ++i) sum += rows.end_time(i);
    });
    benchmark::DoNotOptimize(sum);
  }
  state.SetItemsProcessed(state.iterations() * traces);
}
BENCHMARK(BM_Read)->Args({1'000'000, 0})->Args({1'000'000, 1})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace graze

BENCHMARK_MAIN();
