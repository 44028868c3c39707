#pragma once
// A shard: the traces that gathered since the last one, and how they become the bytes of a file.

#include <cstddef>
#include <map>
#include <vector>

#include "archive/directory/manifest.h"
#include "archive/files/directory.h"
#include "archive/hdf5/hdf5.h"
#include "archive/schema/campaign_info.h"
#include "simulation/trace.h"

namespace graze {

/// Traces in memory, by policy. Not thread-safe.
class ShardBuffer {
 public:
  explicit ShardBuffer(std::size_t policies) : traces_(policies) {}

  void add(int policy, std::vector<TraceRecord> traces, const std::vector<double>& values, std::size_t parameters);
  bool empty() const { return count_ == 0; }
  /// About how much memory is held.
  std::size_t bytes() const { return bytes_; }
  /// Writes it as a file that appears whole. Sorted by particle: the order of adding leaves no mark. Returns
  /// what the manifest says of it. Throws MachineError.
  ShardEntry publish(const Directory& folder, const std::string& name, const CampaignInfo& info);

 private:
  void write(const hdf5::Handle& file, const CampaignInfo& info);

  std::vector<std::vector<TraceRecord>> traces_;         // [policy]
  std::map<std::uint32_t, std::vector<double>> values_;  // by particle
  std::size_t count_ = 0, bytes_ = 0;
};

}  // namespace graze
