#pragma once
// A campaign of dropped balls in a folder, run by the program, and what came out of it.

#include <cstdint>
#include <map>
#include <string>

#include "archive/archive.h"
#include "tests/archive/tables.h"
#include "tests/jobs/program.h"

namespace graze::testing {

/// ball.yaml and ball.urdf in a folder of their own, and the program run there.
struct BallCampaign {
  TemporaryFolder folder;

  explicit BallCampaign(const std::string& extra = "") { write_ball(folder, extra); }
  Result graze(const std::string& arguments) const { return testing::graze(folder.path(), arguments); }
};

/// By policy and particle.
using Digests = std::map<std::string, std::map<std::uint32_t, std::uint64_t>>;

/// Of the traces that count.
inline Digests digests(const fs::path& path) {
  const Archive archive(path);
  Digests out;
  for (const std::string& policy : archive.info().policies) {
    const TraceTable table = table_of(archive, policy);
    for (std::size_t i = 0; i < table.size(); ++i) out[policy][table.particle[i]] = table.digest[i];
  }
  return out;
}

}  // namespace graze::testing
