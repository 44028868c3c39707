#include "jobs/campaign/communicator.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>

#include "archive/archive.h"
#include "jobs/campaign/program_module.h"

namespace graze {
namespace {

class LocalCommunicator final : public Communicator {
 public:
  int rank() const override { return 0; }
  int size() const override { return 1; }
  std::uint64_t fetch_add(std::size_t counter, std::uint64_t delta) override {
    return counters_[counter].fetch_add(delta);
  }
  void add(std::size_t first, std::span<const std::uint64_t> deltas) override {
    for (std::size_t i = 0; i < deltas.size(); ++i) counters_[first + i] += deltas[i];
  }
  std::vector<std::uint64_t> read(std::size_t first, std::size_t count) override {
    return {counters_.begin() + static_cast<std::ptrdiff_t>(first),
            counters_.begin() + static_cast<std::ptrdiff_t>(first + count)};
  }
  void barrier() override {}
  std::string broadcast(const std::string& text) override { return text; }
  void leave() override {}

 private:
  std::vector<std::atomic<std::uint64_t>> counters_ = std::vector<std::atomic<std::uint64_t>>(kSharedCounters);
};

/// How many ranks the starter of this process says there are: Open MPI's mpirun, or srun with PMIx or PMI-2.
int ranks_started() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMIX_SIZE", "PMI_SIZE"}) {
    if (const char* value = std::getenv(name)) return std::atoi(value);
  }
  // PMIx tells a process its rank only; Slurm says how many there are.
  if (std::getenv("PMIX_RANK")) {
    if (const char* tasks = std::getenv("SLURM_STEP_NUM_TASKS")) return std::atoi(tasks);
  }
  return 1;
}

constexpr const char* kPlugin = "libgraze_mpi.so";

std::unique_ptr<Communicator> load_mpi_communicator(int ranks) {
  const std::filesystem::path path = mpi_module();
  const auto fail = [&](const std::string& reason) {
    return MachineError(
        fmt::format("started as one of {} ranks, but this graze cannot use MPI: {}; start it without "
                    "mpirun, or build it where libopenmpi-dev is installed",
                    ranks, reason));
  };
  if (!std::filesystem::exists(path)) throw fail(fmt::format("it was built without ({} is not there)", path.string()));
  // Global, because MPI's own plugins look for its symbols.
  void* module = dlopen(path.c_str(), RTLD_NOW | RTLD_GLOBAL);
  if (!module) throw fail(dlerror());
  using Maker = Communicator* (*)();
  const auto make = reinterpret_cast<Maker>(dlsym(module, "graze_make_mpi_communicator"));
  if (!make) throw fail(dlerror());
  return std::unique_ptr<Communicator>(make());
}

}  // namespace

std::unique_ptr<Communicator> make_local_communicator() { return std::make_unique<LocalCommunicator>(); }

std::unique_ptr<Communicator> make_communicator() {
  const int ranks = ranks_started();
  return ranks > 1 ? load_mpi_communicator(ranks) : make_local_communicator();
}

std::filesystem::path mpi_module() { return program_module(kPlugin); }

bool built_with_mpi() { return std::filesystem::exists(mpi_module()); }

int default_threads() {
  cpu_set_t mine;
  CPU_ZERO(&mine);
  if (sched_getaffinity(0, sizeof mine, &mine) != 0) return 1;
  const int processors = CPU_COUNT(&mine);
  const long all = sysconf(_SC_NPROCESSORS_ONLN);
  const char* neighbours = std::getenv("OMPI_COMM_WORLD_LOCAL_SIZE");
  const bool bound = processors < all;  // each rank to processors of its own
  if (!neighbours || bound) return processors;
  return std::max(1, processors / std::max(1, std::atoi(neighbours)));
}

std::string rank_name(const Communicator& comm) {
  if (comm.size() == 1) return {};
  char host[256] = {};
  gethostname(host, sizeof host - 1);
  return fmt::format("rank {} of {} on {}", comm.rank(), comm.size(), host);
}

}  // namespace graze
