// Archive::scan: the traces of a policy some at a time, with the columns that were asked for.
#include <gmock/gmock.h>

#include <map>
#include <set>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/shard.h"
#include "tests/archive/compare.h"
#include "tests/message_of.h"

namespace graze {
namespace {

using namespace synthetic;

CampaignInfo small_info(std::uint64_t particles) {
  CampaignInfo info = synthetic::info();
  info.scenario_text = "graze: 1\n";
  info.policies = {"hold"};
  info.particles = particles;
  return info;
}

TEST(Scan, GivesTheFinalStateAndCulpritsOfEachTraceOnce) {
  const Folder folder;
  const CampaignInfo facts = info();
  write(folder / "a.graze", facts);
  pack(folder / "a.graze", folder / "a.h5", false);
  for (const char* name : {"a.graze", "a.h5"}) {
    const Archive archive(folder / name);
    std::set<std::uint32_t> seen;
    archive.scan("step/4cm", kFinalState | kCulprits, [&](const TraceRows& rows) {
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const TraceRecord want = trace(facts, 1, rows.particle(i));
        EXPECT_TRUE(seen.insert(want.particle).second) << want.particle;
        EXPECT_TRUE(std::ranges::equal(rows.final_q(i), want.q)) << want.particle;
        EXPECT_TRUE(std::ranges::equal(rows.final_v(i), want.v)) << want.particle;
        const Culprit culprit = want.violated >= 0
                                    ? Culprit{-1, want.violation_parts[static_cast<std::size_t>(want.violated)]}
                                    : want.objective_culprit;
        EXPECT_EQ(rows.culprit(i).leaf, culprit.leaf) << want.particle;
        EXPECT_EQ(rows.culprit(i).part, culprit.part) << want.particle;
      }
    });
    EXPECT_EQ(seen.size(), facts.particles);
  }
}

TEST(Scan, GivesOnlyWhatIsWanted) {
  const Folder folder;
  const CampaignInfo facts = info();
  write(folder / "a.graze", facts);
  const Archive archive(folder / "a.graze");
  std::set<std::uint32_t> got, want;
  const auto wanted = [](std::uint32_t particle, Outcome outcome) {
    return particle % 2 == 1 && outcome == Outcome::known_failure;
  };
  archive.scan(
      "hold", kDigest,
      [&](const TraceRows& rows) {
        for (std::size_t i = 0; i < rows.size(); ++i) {
          EXPECT_EQ(rows.digest(i), trace(facts, 2, rows.particle(i)).digest);
          got.insert(rows.particle(i));
        }
      },
      wanted);
  for (std::uint32_t id = 0; id < facts.particles; ++id) {
    if (wanted(id, trace(facts, 2, id).outcome)) want.insert(id);
  }
  EXPECT_EQ(got, want);
  EXPECT_FALSE(want.empty());
  archive.scan(
      "hold", kAllColumns, [](const TraceRows&) { FAIL() << "nothing was wanted"; },
      [](std::uint32_t, Outcome) { return false; });
  archive.scan("nobody", kAllColumns, [](const TraceRows&) { FAIL() << "there is no such policy"; });
}

/// Whatever is wanted of them: the filter may pass one of the two ways alone.
TEST(Scan, RefusesAParticleThatWentTwoWays) {
  const Folder folder;
  const CampaignInfo facts = small_info(2);
  {
    CampaignDirectory directory(folder / "a.graze", facts, false);
    for (const Outcome outcome : {Outcome::unknown_failure, Outcome::success}) {
      ShardBuffer buffer(1);
      Block one = block(facts, 0, range(0, 2));
      for (TraceRecord& record : one.traces) {
        record.outcome = outcome;
        record.violated = -1;
        record.digest += static_cast<std::uint64_t>(outcome);
      }
      buffer.add(0, std::move(one.traces), one.values, facts.parameters.size());
      directory.add_shard(std::move(buffer));
    }
    directory.complete();
  }
  const Archive archive(folder / "a.graze");
  for (const Outcome wanted : {Outcome::success, Outcome::unknown_failure, Outcome::invalid}) {
    const auto scan = [&] {
      archive.scan(
          "hold", kEndTime, [](const TraceRows&) {}, [&](std::uint32_t, Outcome is) { return is == wanted; });
    };
    EXPECT_THAT(testing::message_of(scan), ::testing::HasSubstr("particle 0 of policy 'hold' went another way here"));
  }
}

/// So many events that no piece holds those of all traces, nor those of the second one.
TEST(Scan, TakesManyEventsSomeTracesAtATime) {
  const Folder folder;
  const CampaignInfo facts = small_info(6);
  const std::map<std::uint32_t, std::uint32_t> events = {{0, 90'000}, {1, 300'000}, {2, 100'000},
                                                         {3, 90'000}, {4, 0},       {5, 3}};
  {
    CampaignDirectory directory(folder / "a.graze", facts, false);
    ShardBuffer buffer(1);
    Block one = block(facts, 0, range(0, 6));
    for (TraceRecord& record : one.traces) {
      record.events.clear();
      for (std::uint32_t i = 0; i < events.at(record.particle); ++i) {
        record.events.push_back(event(0, record.particle, i % 50));
        record.events.back().impulse = i;
      }
    }
    buffer.add(0, std::move(one.traces), one.values, facts.parameters.size());
    directory.add_shard(std::move(buffer));
    directory.complete();
  }
  const Archive archive(folder / "a.graze");
  std::vector<std::size_t> pieces;
  std::map<std::uint32_t, std::uint32_t> got;
  archive.scan("hold", kEvents, [&](const TraceRows& rows) {
    pieces.push_back(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      got[rows.particle(i)] = static_cast<std::uint32_t>(rows.events(i).size());
      for (std::size_t k = 0; k < rows.events(i).size(); ++k) {
        ASSERT_EQ(rows.events(i)[k].impulse, static_cast<double>(k)) << rows.particle(i);
      }
    }
  });
  EXPECT_EQ(got, events);
  EXPECT_THAT(pieces, ::testing::ElementsAre(1u, 1u, 4u));
}

TEST(Scan, GivesTheValuesOfEachParticleOnce) {
  const Folder folder;
  CampaignInfo facts = info();
  write(folder / "a.graze", facts);
  pack(folder / "a.graze", folder / "a.h5", false);
  for (const char* name : {"a.graze", "a.h5"}) {
    std::set<std::uint32_t> seen;
    Archive(folder / name).scan_values([&](std::uint32_t id, std::span<const double> row) {
      EXPECT_TRUE(seen.insert(id).second) << id;
      EXPECT_TRUE(std::ranges::equal(row, values(facts, id))) << id;
    });
    EXPECT_EQ(seen.size(), facts.particles);
  }
  facts.store_values = false;
  write(folder / "b.graze", facts);
  Archive(folder / "b.graze").scan_values([](std::uint32_t, std::span<const double>) { FAIL() << "none is stored"; });
}

/// Of more shards than are kept open at a time.
TEST(Scan, MayAskForOtherThingsOnTheWay) {
  const Folder folder;
  const CampaignInfo facts = small_info(200);
  {
    CampaignDirectory directory(folder / "a.graze", facts, false);
    for (std::uint32_t first = 0; first < 200; first += 2) {
      ShardBuffer buffer(1);
      Block one = block(facts, 0, range(first, first + 2));
      buffer.add(0, std::move(one.traces), one.values, facts.parameters.size());
      directory.add_shard(std::move(buffer));
    }
    directory.complete();
  }
  const Archive archive(folder / "a.graze");
  std::size_t looked = 0;
  archive.scan("hold", kAllColumns, [&](const TraceRows& rows) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::uint32_t other = 199 - rows.particle(i);
      looked += archive.particle_values(other) == values(facts, other);
      EXPECT_EQ(rows.digest(i), trace(facts, 0, rows.particle(i)).digest);
    }
  });
  EXPECT_EQ(looked, 200u);
}

}  // namespace
}  // namespace graze
