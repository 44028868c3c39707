// On the lane engine, too, a trace is the same bits for any number of threads, any N, any order of particles, beside
// any neighbours, in lanes that were refilled, and on every instruction set that this machine has.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "archive/archive.h"
#include "engine/lanes/isa.h"
#include "simulation/block_run.h"
#include "tests/archive/tables.h"
#include "tests/jobs/program.h"
#include "tests/jobs/traces.h"
#include "tests/trace_bits.h"

namespace graze {
namespace {

/// Every trace, by policy and particle.
auto traces(const Scenario& scenario, std::uint64_t particles, int threads) {
  return testing::valid_traces(scenario, particles, threads, testing::all_bits_of);
}

using Overrides = std::vector<Override>;

/// The curb campaign on lanes under every contact model, cut to its first steps (all feet strike the ground).
Scenario striking_curb(const Overrides& more = {}) {
  ScenarioOptions options;
  options.overrides = {{"physics", "lanes"},
                       {"uncertain.contact.model", "{choice: [complementarity, complementarity_free, compliant]}"},
                       {"time.end", "60 ms"}};
  options.overrides.insert(options.overrides.end(), more.begin(), more.end());
  return load_scenario(testing::data("scenarios/quadruped_curb.yaml"), options);
}

/// The same with telemetry, and with traces that end one by one as their bases leave a narrow band of heights, so that
/// lanes are refilled in the middle of their neighbours' traces.
Scenario refilled_curb() {
  return striking_curb({{"record", "{telemetry: all, every: 7, events: true}"},
                        {"time.control", "2 ms"},
                        {"task.stop_at_violation", "true"},
                        {"task.requirements.level", "{height: {link: BODY0, above: 17.5 cm}}"}});
}

std::vector<Particle> particles_of(const Scenario& scenario, std::uint32_t count) {
  const Sampler sampler(scenario.space, scenario.design, 11, count);
  std::vector<std::string> paths;
  for (const UncertainParameter& parameter : scenario.space.parameters) paths.push_back(parameter.name);
  const Fabricator fabricator(scenario.world, paths);
  std::vector<Particle> out;
  for (std::uint32_t i = 0; i < count; ++i) out.push_back(fabricator.fabricate(i, sampler.draw(i)));
  return out;
}

TEST(LaneDeterminism, OneTwoAndEightThreadsGiveTheSameTraces) {
  for (const Scenario& scenario : {striking_curb(), refilled_curb()}) {
    const auto one = traces(scenario, 19, 1);
    ASSERT_EQ(one.size(), 19 * scenario.policies.size());
    EXPECT_EQ(one, traces(scenario, 19, 2));
    EXPECT_EQ(one, traces(scenario, 19, 8));
  }
}

TEST(LaneDeterminism, TracesDifferFromEachOther) {
  // Guards the other tests: equal traces must not come from records that are always equal, and those that are meant to
  // end one by one do.
  const Scenario scenario = refilled_curb();
  std::set<std::string> seen;
  for (const auto& [key, trace] : traces(scenario, 19, 2)) seen.insert(trace);
  EXPECT_GT(seen.size(), 19u);
  const std::vector<Particle> particles = particles_of(scenario, 19);
  std::set<double> ends;
  for (const TraceRecord& one : BlockRun(scenario, scenario.policies.back(), 11).run(particles)) {
    ends.insert(one.end_time);
    EXPECT_FALSE(one.events.empty());
    EXPECT_FALSE(one.phases.empty());
    EXPECT_FALSE(one.telemetry.empty());
  }
  EXPECT_GT(ends.size(), 4u);
}

TEST(LaneDeterminism, TheNumberOfParticlesDoesNotMatter) {
  for (const Scenario& scenario : {striking_curb({{"sampling.design", "sobol"}}), refilled_curb()}) {
    const auto many = traces(scenario, 40, 1);
    for (const std::uint64_t n : {1u, 3u, 9u}) {
      for (const auto& [key, trace] : traces(scenario, n, 1)) EXPECT_EQ(trace, many.at(key)) << n;
    }
  }
}

// Whatever lane, neighbours and trace before: the order of the particles does not matter, nor that a BlockRun is used
// again.
TEST(LaneDeterminism, TheOrderOfParticlesDoesNotMatter) {
  const Scenario scenario = refilled_curb();
  std::vector<Particle> particles = particles_of(scenario, 19);
  BlockRun run(scenario, scenario.policies.back(), 11);
  std::map<std::uint32_t, std::string> first;
  for (const TraceRecord& one : run.run(particles)) first[one.particle] = testing::all_bits_of(one);
  std::reverse(particles.begin(), particles.end());
  for (const TraceRecord& one : run.run(particles)) EXPECT_EQ(testing::all_bits_of(one), first.at(one.particle));
  std::rotate(particles.begin(), particles.begin() + 5, particles.end());
  for (const TraceRecord& one : run.run(particles)) EXPECT_EQ(testing::all_bits_of(one), first.at(one.particle));
  for (const Particle& particle : particles) {
    EXPECT_EQ(testing::all_bits_of(run.run({&particle, 1}).front()), first.at(particle.id)) << "alone";
  }
}

/// Digests, events and telemetry of an archive that the program writes under an instruction set.
std::string archive_under(const std::string& isa, const testing::TemporaryFolder& folder) {
  const std::string name = isa + ".h5";
  const testing::Result run =
      testing::shell(folder.path(), "GRAZE_ISA=" + isa + " '" GRAZE_PROGRAM "' run '" +
                                        testing::data("scenarios/quadruped_curb.yaml") +
                                        "' -n 9 --policy step/4cm --quiet --set physics=lanes --set time.end='40 ms'"
                                        " --set 'uncertain.contact.model={choice: [complementarity, "
                                        "complementarity_free, compliant]}'"
                                        " --set 'record={telemetry: all, every: 5, events: true}' -o " +
                                        name);
  EXPECT_EQ(run.code, 0) << run.err;
  const Archive archive((folder / name).string());
  const TraceTable table = table_of(archive, "step/4cm");
  const std::vector<std::vector<Event>> events = events_of(archive, "step/4cm");
  std::string out;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const SolverLog& log = table.solver.at(i);
    out += fmt::format("{} {:x} ", table.particle[i], table.digest[i]);
    testing::add_bits({log.largest_residual, log.unconverged_steps, log.median_residual, log.most_braked}, out);
    testing::add_bits(events[i], out);
    testing::add_frame_bits(archive.telemetry("step/4cm", table.particle[i]), out);
  }
  return out;
}

TEST(LaneDeterminism, EveryInstructionSetGivesTheSameArchive) {
  const testing::TemporaryFolder folder;
  std::map<std::string, std::string> archives;
  for (const Isa isa : available_isas()) archives[isa_name(isa)] = archive_under(isa_name(isa), folder);
  for (const auto& [isa, archive] : archives) {
    EXPECT_GT(archive.size(), 1000u) << isa;
    EXPECT_TRUE(archive == archives.at("portable")) << isa;
  }
  if (archives.size() < 2) GTEST_SKIP() << "one instruction set only";
}

}  // namespace
}  // namespace graze
