#pragma once
// Campaigns to replay, and what comes out of a replay.

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "jobs/campaign/campaign.h"
#include "jobs/campaign/describe_campaign.h"
#include "jobs/campaign/replay.h"
#include "tests/jobs/program.h"

namespace graze::testing {

/// Runs a campaign into an archive; `change` may alter what is written of the campaign and of its traces.
inline void write_campaign(
    const fs::path& directory, const Scenario& scenario, std::uint64_t particles,
    const std::function<void(CampaignInfo&)>& change_info = [](CampaignInfo&) {},
    const std::function<void(TraceRecord&)>& change_trace = [](TraceRecord&) {}) {
  CampaignInfo info = describe_campaign(scenario, particles, "test");
  change_info(info);
  CampaignWriter writer(directory, info, false);
  CampaignOptions options;
  options.particles = particles;
  options.seed = scenario.seed;
  options.threads = 2;
  const auto comm = make_local_communicator();
  run_campaign(scenario, options, *comm, [&](int policy, std::vector<TraceRecord> traces, std::vector<double> values) {
    for (TraceRecord& trace : traces) change_trace(trace);
    writer.append(policy, std::move(traces), std::move(values));
  });
  writer.finish();
}

inline ReplayRequest request(const fs::path& archive, std::uint32_t particle, const std::string& policy) {
  ReplayRequest out;
  out.archive = archive.string();
  out.particle = particle;
  out.policy = policy;
  out.record = true;
  return out;
}

inline const FrameTable& table(const StepLog& log, const std::string& name) {
  for (const FrameTable& one : log.tables) {
    if (one.name == name) return one;
  }
  throw std::runtime_error(name);
}

inline std::vector<double> row(const FrameTable& table, std::size_t frame) {
  const auto begin = table.values.begin() + static_cast<std::ptrdiff_t>(frame * table.columns.size());
  return {begin, begin + static_cast<std::ptrdiff_t>(table.columns.size())};
}

/// A campaign of dropped balls, by the program; its scenario's files are gone afterwards.
struct Balls {
  TemporaryFolder folder;
  explicit Balls(const std::string& extra = "", const std::string& arguments = "-n 12") {
    write_ball(folder, extra);
    const Result run = graze("run ball.yaml --quiet -o a.graze " + arguments);
    EXPECT_EQ(run.code, 0) << run.err;
    fs::remove(folder / "ball.yaml");
    fs::remove(folder / "ball.urdf");
  }
  Result graze(const std::string& arguments) const { return testing::graze(folder.path(), arguments); }
};

/// The whole numbers of a CSV file: [row][column], head first.
inline std::vector<std::vector<std::string>> read_csv(const fs::path& file) {
  std::vector<std::vector<std::string>> out;
  std::istringstream in(read_file(file));
  for (std::string line; std::getline(in, line);) {
    out.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) out.back().push_back(cell);
  }
  return out;
}

}  // namespace graze::testing
