#pragma once
// The processes that work on one campaign together: this one alone, or the ranks that mpirun (or srun) started. They
// share what a campaign needs at one place: counters. Units of work are handed out by counting tickets, progress and
// outcomes are sums; nothing else is sent around, so that nothing grows with the number of ranks.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace graze {

/// What the shared counters count. From kFirstFreeCounter on they are free for other uses.
enum SharedCounter : std::size_t {
  kTickets,  // handed out so far
  kTraces,   // finished by this run; kSuccess … kInvalid: of these, by outcome
  kSuccess,
  kKnownFailure,
  kUnknownFailure,
  kInvalid,
  kSteps,        // physics steps, of one particle each
  kFailedRanks,  // that ended by an error
  kUnfinished,   // particles that were cut off
  kFirstFreeCounter = 16,
  kSharedCounters = 16384
};

/// All methods may be called from any thread.
class Communicator {
 public:
  virtual ~Communicator() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;

  /// Adds to one counter; returns its value before. All counters begin at 0.
  virtual std::uint64_t fetch_add(std::size_t counter, std::uint64_t delta) = 0;
  /// Adds to neighbouring counters, each atomically.
  virtual void add(std::size_t first, std::span<const std::uint64_t> deltas) = 0;
  virtual std::vector<std::uint64_t> read(std::size_t first, std::size_t count) = 0;

  /// Waits until all ranks have come here.
  virtual void barrier() = 0;
  /// All ranks call it and get the text that rank 0 gave.
  virtual std::string broadcast(const std::string& text) = 0;
  /// As the destructor, for a process that ends without running it: waits for all ranks to be through.
  virtual void leave() = 0;
};

/// This process alone.
std::unique_ptr<Communicator> make_local_communicator();

/// All ranks if this process was started as one of several, else this process alone. Throws MachineError if it was, but
/// MPI cannot be had (the program was built without it, or its library is not on this machine).
std::unique_ptr<Communicator> make_communicator();

/// Whether there is a module for MPI, so that this program can run as one of several ranks.
bool built_with_mpi();
/// The module's file: where it is, or would be.
std::filesystem::path mpi_module();

/// Threads that this process should use when it was not told: the processors that it may run on, shared with the ranks
/// that are on the same machine and may run on them, too.
int default_threads();

/// "rank 3 of 8 on node7"; empty for a process alone.
std::string rank_name(const Communicator& comm);

}  // namespace graze
