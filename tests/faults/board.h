#pragma once
// What a trial's process and the test share: the plan, what happened, and the record of changes. Everything here works
// without allocating memory, in any state of the process.

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "tests/faults/faults.h"

namespace graze::faults {

struct Board {
  static constexpr std::size_t kPath = 4096, kRecord = std::size_t{64} << 20, kPaths = std::size_t{1} << 22;
  // the plan
  What what;
  long at;
  bool for_good;
  int error;
  long allocation, thread;
  bool note_paths, show;
  char under[kPath];  // the folder; empty: nothing is watched
  std::size_t under_length;
  // what happened
  std::atomic<long> calls, allocations, threads;
  std::atomic<bool> failed;
  char failed_call[32], failed_path[kPath];
  std::atomic<std::size_t> recorded;  // bytes of `record`
  std::atomic<bool> lost;             // a change could not be recorded
  std::atomic_flag recording;         // held while a change is made and recorded
  std::byte record[kRecord];
  std::uint64_t call_path[kPaths];
};

/// Shared with the processes that are forked; null: nothing is watched.
extern Board* board;

/// Takes a change down. The payload is copied.
void record(Change::Kind kind, std::uint64_t inode, std::uint64_t offset, const char* path, const char* to,
            const void* data, std::size_t size);

}  // namespace graze::faults
