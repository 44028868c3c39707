// What ranks cost each other, for docs/scaling.md: tickets, sums and reads of the shared counters, a shard with its
// rename and line of the manifest, and what reading a directory of many shards takes.
// usage: bench_communicator                     one process
//        mpirun -np R bench_communicator        R ranks at once on the counters; the rest by rank 0
#include "jobs/campaign/communicator.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/manifest.h"
#include "jobs/campaign/hand_out.h"

namespace {

using namespace graze;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// Microseconds per call.
template <class F>
double cost(int calls, const F& call) {
  const auto begin = Clock::now();
  for (int i = 0; i < calls; ++i) call(i);
  return std::chrono::duration<double, std::micro>(Clock::now() - begin).count() / calls;
}

void counters(Communicator& comm) {
  constexpr int kCalls = 200'000;
  const std::vector<std::uint64_t> six(6, 1);
  comm.barrier();
  const double ticket = cost(kCalls, [&](int) { comm.fetch_add(kFirstFreeCounter, 1); });
  comm.barrier();
  const double sum = cost(kCalls, [&](int) { comm.add(kFirstFreeCounter + 1, six); });
  comm.barrier();
  const double read = cost(kCalls, [&](int) { comm.read(kFirstFreeCounter + 1, 6); });
  comm.barrier();
  if (comm.rank() > 0) return;
  fmt::print("counters, {} ranks at once, us per call of each: ticket {:.2f}, sum of 6 {:.2f}, read of 6 {:.2f}\n",
             comm.size(), ticket, sum, read);
  fmt::print("tickets per second of all: {:.3g}\n", 1e6 * comm.size() / ticket);
}

void tickets() {
  for (const std::uint64_t particles : {100'000ull, 10'000'000ull}) {
    for (const std::uint64_t workers : {2ull, 1'000ull, 20'000ull}) {
      const std::uint64_t units = 4 * particles / 8;
      const HandOut hand_out(units, workers, 16);
      std::uint64_t count = 0;
      while (!hand_out.range(count).empty()) ++count;
      fmt::print("tickets for 4 policies x {} particles by {} workers: {} ({:.1f} blocks of 8 each)\n", particles,
                 workers, count, static_cast<double>(units) / static_cast<double>(count));
    }
  }
}

CampaignInfo info() {
  CampaignInfo out;
  out.particles = 1u << 31;
  out.policies = {"step"};
  out.parameters.resize(4);
  out.requirements.resize(4);
  out.q_names.resize(19, "q");
  out.v_names.resize(18, "v");
  return out;
}

ShardBuffer block(std::uint32_t first) {
  const CampaignInfo facts = info();
  std::vector<TraceRecord> traces(8);
  for (std::uint32_t i = 0; i < 8; ++i) {
    traces[i].particle = first + i;
    traces[i].margins = traces[i].first_violations = std::vector<double>(4);
    traces[i].q = std::vector<double>(19);
    traces[i].v = std::vector<double>(18);
  }
  ShardBuffer out(1);
  out.add(0, std::move(traces), std::vector<double>(8 * 4), 4);
  return out;
}

void directory() {
  std::string pattern = (fs::temp_directory_path() / "graze-bench-XXXXXX").string();
  const fs::path folder = mkdtemp(pattern.data());
  {
    CampaignDirectory campaign(folder / "a.graze", info(), false);
    constexpr int kShards = 2000;
    const double shard = cost(kShards, [&](int i) { campaign.add_shard(block(8 * static_cast<std::uint32_t>(i))); });
    fmt::print("a shard of one block with its line of the manifest, synced: {:.0f} us\n", shard);
    const double manifest = cost(5, [&](int) { read_manifest(folder / "a.graze"); });
    const double listing = cost(5, [&](int) { shard_files(folder / "a.graze"); });
    fmt::print("reading the manifest: {:.1f} us per shard; listing the folder: {:.1f} us per shard\n",
               manifest / kShards, listing / kShards);
  }
  fs::remove_all(folder);
}

}  // namespace

int main() {
  const std::unique_ptr<Communicator> comm = make_communicator();
  counters(*comm);
  if (comm->rank() > 0) return 0;
  tickets();
  directory();
  return 0;
}
