// Campaigns larger than what is read at a time: shards are merged window by window, outcomes come piece by piece.
#include <gmock/gmock.h>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/shard.h"
#include "archive/outcomes.h"
#include "tests/archive/compare.h"
#include "tests/archive/tables.h"

namespace graze {
namespace {

using namespace synthetic;

constexpr std::uint32_t kParticles = 40'000;  // windows are of 16384

CampaignInfo large_info() {
  CampaignInfo info = synthetic::info();
  info.scenario_text = "graze: 1\n";
  info.policies = {"step/1cm", "hold"};
  info.particles = kParticles;
  return info;
}

/// Five shards whose particles interleave in blocks of 8. Every 50th block stands in two of them.
void write_shards(const std::filesystem::path& path, const CampaignInfo& info) {
  CampaignDirectory directory(path, info, false);
  for (std::uint32_t shard = 0; shard < 5; ++shard) {
    ShardBuffer buffer(info.policies.size());
    for (std::uint32_t b = 0; b < kParticles / 8; ++b) {
      if (b % 5 != shard && !(b % 50 == 0 && shard == 3)) continue;
      for (int policy = 0; policy < 2; ++policy) {
        if (policy == 1 && b % 3 == 0) continue;  // not done yet
        Block one = block(info, policy, range(8 * b, 8 * b + 8));
        buffer.add(policy, std::move(one.traces), one.values, info.parameters.size());
      }
    }
    directory.add_shard(std::move(buffer));
  }
  directory.complete();
}

/// What score() is made of.
std::vector<TraceOutcome> outcomes(const Archive& archive, const std::string& policy) {
  std::vector<TraceOutcome> out;
  visit_outcomes(archive, policy,
                 [&](std::span<const TraceOutcome> some) { out.insert(out.end(), some.begin(), some.end()); });
  std::sort(out.begin(), out.end(),
            [](const TraceOutcome& a, const TraceOutcome& b) { return a.particle < b.particle; });
  return out;
}

void expect_outcomes(const Archive& archive, const CampaignInfo& info) {
  for (int policy = 0; policy < 2; ++policy) {
    const std::vector<TraceOutcome> got = outcomes(archive, info.policies[policy]);
    std::size_t i = 0;
    for (std::uint32_t id = 0; id < kParticles; ++id) {
      if (policy == 1 && id / 8 % 3 == 0) continue;
      const TraceRecord want = trace(info, policy, id);
      ASSERT_LT(i, got.size());
      ASSERT_EQ(got[i].particle, id);
      ASSERT_EQ(got[i].outcome, want.outcome);
      ASSERT_EQ(got[i].violated, want.violated);
      ASSERT_EQ(got[i].objective_margin, want.objective_margin);
      ++i;
    }
    EXPECT_EQ(i, got.size());
  }
}

// Claim: packing 40,000 particles in interleaved shards gives every field of every trace, in order of particle, each
// particle once; events, frames and values stay with their traces. Outcomes come out whole from both.
TEST(Large, PacksInOrderOfParticle) {
  const Folder folder;
  const CampaignInfo info = large_info();
  write_shards(folder / "a.graze", info);
  expect_outcomes(Archive(folder / "a.graze"), info);
  pack(folder / "a.graze", folder / "a.h5", false);
  const Archive packed(folder / "a.h5");
  expect_outcomes(packed, info);
  for (int policy = 0; policy < 2; ++policy) {
    const TraceTable table = table_of(packed, info.policies[policy]);
    const auto events = events_of(packed, info.policies[policy]);
    ASSERT_EQ(table.size(), outcomes(packed, info.policies[policy]).size());
    for (std::size_t i = 0; i < table.size(); i += i % 1000 == 0 ? 1 : 7) {
      const TraceRecord want = trace(info, policy, table.particle[i]);
      expect_row(table, i, want);
      ASSERT_EQ(events[i].size(), want.events.size());
      for (std::size_t k = 0; k < want.events.size(); ++k) expect_same(events[i][k], want.events[k]);
      if (::testing::Test::HasFailure()) return;
    }
    for (const std::uint32_t id : {8u, 16383u, 16384u, 16385u, 32768u, 39999u}) {
      const TraceRecord want = trace(info, policy, id);
      const auto frames = packed.telemetry(info.policies[policy], id);
      const bool there = policy == 0 || id / 8 % 3 != 0;
      ASSERT_EQ(frames.size(), there ? want.telemetry.size() : 0);
      for (std::size_t k = 0; k < frames.size(); ++k) expect_same(frames[k].q, want.telemetry[k].q);
      expect_same(packed.particle_values(id), values(info, id));
    }
  }
}

// Claim: a particle whose traces differ between two shards is refused by all that read it.
TEST(Large, TwoWaysAreRefused) {
  const Folder folder;
  const CampaignInfo info = large_info();
  {
    CampaignDirectory directory(folder / "a.graze", info, false);
    for (int shard = 0; shard < 2; ++shard) {
      ShardBuffer buffer(info.policies.size());
      Block one = block(info, 0, range(0, 16));
      if (shard == 1) one.traces[9].digest ^= 1;
      buffer.add(0, std::move(one.traces), one.values, info.parameters.size());
      directory.add_shard(std::move(buffer));
    }
    directory.complete();
  }
  const Archive archive(folder / "a.graze");
  EXPECT_THROW(visit_outcomes(archive, "step/1cm", [](std::span<const TraceOutcome>) {}), InputError);
  EXPECT_THROW(pack(folder / "a.graze", folder / "a.h5", false), InputError);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.h5"));
}

}  // namespace
}  // namespace graze
