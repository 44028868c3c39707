#pragma once
// How much of the machine this process may use: by the kernel, by the limits of its shell, by its control group
// (containers, Slurm).

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "jobs/machine/finding.h"

namespace graze {

/// What the control groups that this process is in allow, the tightest of the group and those above it (cgroup
/// versions 1 and 2).
struct GroupLimits {
  std::optional<double> processors;            // how many at a time, on average: quota / period
  std::optional<std::uint64_t> memory;         // bytes
  std::optional<std::uint64_t> memory_in_use;  // bytes, of the group that sets `memory`
};

/// Reads them below `root`, "/" but in tests: proc/self/cgroup and sys/fs/cgroup.
GroupLimits group_limits(const std::filesystem::path& root = "/");

/// Processors, threads, memory and open files.
std::vector<Finding> limit_findings(const GroupLimits& groups);

}  // namespace graze
