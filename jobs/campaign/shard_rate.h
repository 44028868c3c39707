#pragma once
// How fast a campaign is, as its files tell: somebody else's process writes it, maybe on another machine.

#include <cstdint>
#include <optional>
#include <vector>

#include "archive/files/directory.h"

namespace graze {

/// A shard, and when it was written (s, on any clock that `begin` and `now` share).
struct ShardTime {
  double time;
  std::uint64_t traces;
};

/// Traces per second since `begin`. Clocks jump, and machines are suspended: nothing if any time lies in the future or
/// nothing was written since `begin`; a gap between two shards that is much longer than the usual one does not count.
std::optional<double> rate_of(double begin, double now, std::vector<ShardTime> shards);

/// The rate of the process that writes into a campaign directory now; nothing if none does.
std::optional<double> writing_rate(const Directory& directory);

}  // namespace graze
