// A particle's trace is the same bits for any number of threads, any N, any order and choice of policies, and any block
// neighbour (design: "Bit-identical is a feature").
#include <gtest/gtest.h>

#include <map>

#include "tests/jobs/program.h"
#include "tests/jobs/traces.h"

namespace graze {
namespace {

/// Digest of every trace, by policy name and particle.
auto digests(const Scenario& scenario, std::uint64_t particles, int threads) {
  return testing::valid_traces(scenario, particles, threads, [](const TraceRecord& trace) { return trace.digest; });
}

/// The curb campaign with everything uncertain, cut to the first steps of the walk (all feet strike the ground).
Scenario short_curb(const std::string& design = "random") {
  ScenarioOptions options;
  options.overrides = {{"time.end", "60 ms"}, {"sampling.design", design}};
  return load_scenario(testing::data("scenarios/quadruped_curb.yaml"), options);
}

TEST(ThreadsDeterminism, OneTwoAndEightThreadsGiveTheSameBits) {
  const Scenario scenario = short_curb();
  const auto one = digests(scenario, 11, 1);
  ASSERT_EQ(one.size(), 11 * scenario.policies.size());
  EXPECT_EQ(one, digests(scenario, 11, 2));
  EXPECT_EQ(one, digests(scenario, 11, 8));
}

TEST(ThreadsDeterminism, ParticlesDifferFromEachOther) {
  // Guards the other tests: equal digests must not come from digests that are always equal.
  std::map<std::uint64_t, int> seen;
  for (const auto& [key, digest] : digests(short_curb(), 11, 2)) ++seen[digest];
  EXPECT_GT(seen.size(), 11u);
}

TEST(Determinism, PolicyOrderAndChoiceDoNotMatter) {
  Scenario scenario = short_curb();
  const auto all = digests(scenario, 5, 2);
  std::reverse(scenario.policies.begin(), scenario.policies.end());
  EXPECT_EQ(all, digests(scenario, 5, 2));
  scenario.policies.erase(scenario.policies.begin() + 1, scenario.policies.end());
  for (const auto& [key, digest] : digests(scenario, 5, 2)) EXPECT_EQ(digest, all.at(key));
}

TEST(Determinism, TheNumberOfParticlesDoesNotMatter) {
  for (const char* design : {"random", "sobol"}) {
    const Scenario scenario = short_curb(design);
    const auto many = digests(scenario, 13, 2);
    for (const auto& [key, digest] : digests(scenario, 3, 1)) EXPECT_EQ(digest, many.at(key)) << design;
  }
}

TEST(Determinism, EndedLanesDoNotDisturbTheirNeighbours) {
  // The ball falls below the required height at different times, so that lanes end and are refilled one by one.
  testing::TemporaryFolder folder;
  testing::write_ball(folder);
  ScenarioOptions options;
  options.overrides = {{"time.end", "200 ms"}, {"task.requirements.high.height.above", "0.12"}};
  const Scenario scenario = load_scenario((folder / "ball.yaml").string(), options);
  const auto many = digests(scenario, 20, 1);
  for (std::uint64_t n : {1u, 2u, 9u}) {
    for (const auto& [key, digest] : digests(scenario, n, 1)) EXPECT_EQ(digest, many.at(key)) << n;
  }
}

}  // namespace
}  // namespace graze
