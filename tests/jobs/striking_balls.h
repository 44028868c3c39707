#pragma once
// A campaign of balls that are dropped beside a block: how far to its side a ball begins decides whether it strikes the
// block, and that decides whether it ends low. The nominal ball touches the ground alone.

#include <cstdint>
#include <functional>
#include <string>

#include "archive/archive.h"
#include "jobs/campaign/campaign.h"
#include "jobs/campaign/describe_campaign.h"
#include "tests/jobs/program.h"

namespace graze::testing {

inline const char* kStrikingBalls = R"(graze: 1
name: Striking balls
robot:
  urdf: ball.urdf
  initial: {position: [0, 0, 0.22]}
environment:
  ground: {plane: z}
  block: {box: [0.2, 1, 0.1], position: [0.2, 0, 0.05]}
time: {end: 250 ms, step: 1 ms, control: 1 ms}
uncertain:
  initial.base.x: {uniform: [-10 cm, 10 cm]}
  initial.base.y: {uniform: [-10 cm, 10 cm]}
  robot.link.ball.density: {normal: {std: 2%}}
policies:
  still: {hold: {}, control: {torque: {}}}
  other: {hold: {}, control: {torque: {}}}
  third: {hold: {}, control: {torque: {}}}
task:
  requirements:
    centred: {position: {link: ball, y: {below: 8 cm}}, window: [0.2, 0.25]}
  objective:
    low: {position: {link: ball, x: {below: 4 cm}}}
)";

inline void write_striking_balls(const TemporaryFolder& folder) {
  write_file(folder / "ball.urdf", kBallUrdf);
  write_file(folder / "ball.yaml", kStrikingBalls);
}

/// Its archive a.graze in a folder of its own; the scenario's files are gone. One ball in ten begins beyond what is
/// `centred`, which ends its trace when it has struck what it strikes.
struct StrikingBalls {
  TemporaryFolder folder;

  explicit StrikingBalls(const std::string& arguments = "-n 60") {
    write_striking_balls(folder);
    const Result run = graze("run ball.yaml --quiet -o a.graze " + arguments);
    EXPECT_EQ(run.code, 0) << run.err;
    fs::remove(folder / "ball.yaml");
    fs::remove(folder / "ball.urdf");
  }
  Result graze(const std::string& arguments) const { return testing::graze(folder.path(), arguments); }
};

/// The first `done` of `particles` particles, as a campaign that was interrupted has them; `change` may alter a trace
/// of a policy.
inline void write_part(
    const fs::path& directory, const Scenario& scenario, std::uint64_t done, std::uint64_t particles,
    const std::function<void(TraceRecord&, int)>& change = [](TraceRecord&, int) {}) {
  CampaignWriter writer(directory, describe_campaign(scenario, particles, "test"), false);
  CampaignOptions options;
  options.particles = done;
  options.seed = scenario.seed;
  const auto comm = make_local_communicator();
  run_campaign(scenario, options, *comm, [&](int policy, std::vector<TraceRecord> traces, std::vector<double> values) {
    for (TraceRecord& trace : traces) change(trace, policy);
    writer.append(policy, std::move(traces), std::move(values));
  });
  writer.finish(done == particles);
}

}  // namespace graze::testing
