#pragma once
// The particles that a campaign left without a trace because the machine failed them (cut off by the watchdog, out of
// memory), or their controller did not come back: a list beside the shards, a line of JSON each. `resume` tries them
// again and so begins by forgetting it.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "archive/files/directory.h"

namespace graze {

inline constexpr const char* kUnfinishedFile = "unfinished.jsonl";

struct UnfinishedTrace {
  std::string policy;
  std::uint32_t particle = 0;
  std::string reason;
  bool by_controller = false;  // the fault of a controller of the user's own, not of the machine
};

/// Appends one. May be called by several processes at once. Throws MachineError, or InputError if the file is none of
/// this campaign's own.
void add_unfinished(const Directory& directory, const UnfinishedTrace& trace);
/// In order of policy, then particle; each once. A line that a crash cut short is left out. Throws InputError if the
/// file is no regular one.
std::vector<UnfinishedTrace> read_unfinished(const Directory& directory);
/// Throws MachineError.
void forget_unfinished(const Directory& directory);

}  // namespace graze
