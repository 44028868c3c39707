// The module libgraze_mpi.so: a Communicator of MPI ranks. A module of its own, so that the program runs where there is
// no MPI.
//
// The shared counters are one window of memory at rank 0, which all ranks change by atomic one-sided operations:
// between ranks of one machine they are processor atomics, over a network with remote atomics the adapter does them.
// Where they are messages, rank 0 must look for them now and then: a thread of its own does. MPI is entered by one
// thread at a time.
#include <mpi.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <thread>

#include "jobs/campaign/communicator.h"

namespace graze {
namespace {

using namespace std::chrono_literals;

class MpiCommunicator final : public Communicator {
 public:
  MpiCommunicator() {
    int given = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &given);
    if (given < MPI_THREAD_SERIALIZED) {
      std::fputs("graze: this MPI cannot be used by several threads of a process; use one that can\n", stderr);
      MPI_Abort(MPI_COMM_WORLD, 3);
    }
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
    const MPI_Aint bytes = rank_ == 0 ? static_cast<MPI_Aint>(kSharedCounters * sizeof(std::uint64_t)) : 0;
    void* memory = nullptr;
    MPI_Win_allocate(bytes, sizeof(std::uint64_t), MPI_INFO_NULL, MPI_COMM_WORLD, &memory, &window_);
    if (rank_ == 0) std::memset(memory, 0, static_cast<std::size_t>(bytes));
    MPI_Win_lock_all(MPI_MODE_NOCHECK, window_);
    MPI_Win_sync(window_);
    MPI_Barrier(MPI_COMM_WORLD);
    if (rank_ == 0) progress_ = std::thread([this] { answer(); });
  }

  ~MpiCommunicator() override { leave(); }

  void leave() override {
    if (window_ == MPI_WIN_NULL) return;
    barrier();
    if (progress_.joinable()) {
      {
        const std::lock_guard lock(mutex_);
        ended_ = true;
      }
      wake_.notify_all();
      progress_.join();
    }
    MPI_Win_unlock_all(window_);
    MPI_Win_free(&window_);
    MPI_Finalize();
  }

  int rank() const override { return rank_; }
  int size() const override { return size_; }

  std::uint64_t fetch_add(std::size_t counter, std::uint64_t delta) override {
    const std::lock_guard lock(mutex_);
    std::uint64_t before = 0;
    MPI_Fetch_and_op(&delta, &before, MPI_UINT64_T, 0, static_cast<MPI_Aint>(counter), MPI_SUM, window_);
    MPI_Win_flush(0, window_);
    return before;
  }

  void add(std::size_t first, std::span<const std::uint64_t> deltas) override {
    const std::lock_guard lock(mutex_);
    const int count = static_cast<int>(deltas.size());
    MPI_Accumulate(deltas.data(), count, MPI_UINT64_T, 0, static_cast<MPI_Aint>(first), count, MPI_UINT64_T, MPI_SUM,
                   window_);
    MPI_Win_flush(0, window_);
  }

  std::vector<std::uint64_t> read(std::size_t first, std::size_t count) override {
    const std::lock_guard lock(mutex_);
    std::vector<std::uint64_t> values(count);
    const int n = static_cast<int>(count);
    MPI_Get_accumulate(nullptr, 0, MPI_UINT64_T, values.data(), n, MPI_UINT64_T, 0, static_cast<MPI_Aint>(first), n,
                       MPI_UINT64_T, MPI_NO_OP, window_);
    MPI_Win_flush(0, window_);
    return values;
  }

  void barrier() override {
    MPI_Request request;
    {
      const std::lock_guard lock(mutex_);
      MPI_Ibarrier(MPI_COMM_WORLD, &request);
    }
    wait(request);
  }

  std::string broadcast(const std::string& text) override {
    std::uint64_t bytes = text.size();
    broadcast(&bytes, sizeof bytes);
    std::string out = rank_ == 0 ? text : std::string(bytes, '\0');
    constexpr std::uint64_t kMost = std::uint64_t{1} << 30;  // MPI counts in int
    for (std::uint64_t at = 0; at < bytes; at += kMost) {
      broadcast(out.data() + at, static_cast<int>(std::min(kMost, bytes - at)));
    }
    return out;
  }

 private:
  void broadcast(void* data, int bytes) {
    MPI_Request request;
    {
      const std::lock_guard lock(mutex_);
      MPI_Ibcast(data, bytes, MPI_BYTE, 0, MPI_COMM_WORLD, &request);
    }
    wait(request);
  }

  /// Asleep, not spinning: the processors are for ranks that still simulate, and other threads may enter MPI meanwhile.
  void wait(MPI_Request& request) {
    for (int done = 0;;) {
      {
        const std::lock_guard lock(mutex_);
        MPI_Test(&request, &done, MPI_STATUS_IGNORE);
      }
      if (done) return;
      std::this_thread::sleep_for(200us);
    }
  }

  /// Rank 0: lets MPI see what others ask for.
  void answer() {
    std::unique_lock lock(mutex_);
    while (!wake_.wait_for(lock, 500us, [this] { return ended_; })) {
      int waiting = 0;
      MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &waiting, MPI_STATUS_IGNORE);
    }
  }

  int rank_ = 0, size_ = 1;
  MPI_Win window_ = MPI_WIN_NULL;
  std::mutex mutex_;  // MPI is entered under it
  std::condition_variable wake_;
  bool ended_ = false;
  std::thread progress_;
};

}  // namespace
}  // namespace graze

extern "C" graze::Communicator* graze_make_mpi_communicator() { return new graze::MpiCommunicator; }
