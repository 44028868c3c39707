// Work that ran ahead of the question that ended a campaign: it lies in shards and counts nowhere.
#include "archive/directory/finished.h"
#include "tests/archive/compare.h"
#include "tests/archive/tables.h"

namespace graze {
namespace {

using namespace synthetic;

/// A campaign of 40 particles that was answered by 24 of them; and one of 24, with the same facts.
void write_both(const Folder& folder, CampaignInfo& facts) {
  facts.until = {{"p >= 0.3", "hold: ci < 0.5"}, 0.99, 40, 0, 0};
  CampaignWriter ahead(folder / "ahead.graze", facts, false), exact(folder / "exact.graze", facts, false);
  for (int policy = 0; policy < 3; ++policy) {
    Block all = block(facts, policy, range(0, 40)), some = block(facts, policy, range(0, 24));
    ahead.append(policy, std::move(all.traces), std::move(all.values));
    exact.append(policy, std::move(some.traces), std::move(some.values));
  }
  ahead.finish(true, 24);
  exact.finish(true, 24);
}

std::string bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Claim: readers see no particle beyond the last that counts, and the packed file has the bytes of a campaign that
// never ran ahead.
TEST(RanAhead, IsPassedOverByReadersAndPack) {
  const Folder folder;
  CampaignInfo facts = info();
  write_both(folder, facts);
  const Archive archive(folder / "ahead.graze");
  EXPECT_EQ(archive.info().particles, 24u);
  EXPECT_EQ(archive.info().until.answered_at, 24u);
  EXPECT_EQ(archive.info().until.most, 40u);
  EXPECT_EQ(archive.info().until.confidence, 0.99);
  EXPECT_EQ(archive.info().until.questions, facts.until.questions);
  for (int policy = 0; policy < 3; ++policy) {
    const TraceTable table = table_of(archive, facts.policies[static_cast<std::size_t>(policy)]);
    ASSERT_EQ(table.size(), 24u);
    for (std::uint32_t i = 0; i < 24; ++i) expect_row(table, i, trace(facts, policy, i));
    EXPECT_EQ(events_of(archive, table.policy).size(), 24u);
    EXPECT_EQ(table_of(archive, table.policy).outcome, table.outcome);
    EXPECT_TRUE(archive.telemetry(table.policy, 30).empty());
  }
  EXPECT_FALSE(archive.particle_values(23).empty());
  EXPECT_TRUE(archive.particle_values(24).empty());
  pack(folder / "ahead.graze", folder / "ahead.h5", false);
  pack(folder / "exact.graze", folder / "exact.h5", false);
  EXPECT_EQ(bytes(folder / "ahead.h5"), bytes(folder / "exact.h5"));
}

// Claim: nothing that ran ahead is lost: a campaign that grows finds it finished.
TEST(RanAhead, IsFinishedForACampaignThatGrows) {
  const Folder folder;
  CampaignInfo facts = info();
  write_both(folder, facts);
  facts.particles = 24;
  EXPECT_EQ(repair_and_list(folder / "ahead.graze", facts).count, 3 * 24u);
  facts.particles = 35;
  EXPECT_EQ(repair_and_list(folder / "ahead.graze", facts).count, 3 * 35u);
  EXPECT_EQ(repair_and_list(folder / "exact.graze", facts).count, 3 * 24u);
}

}  // namespace
}  // namespace graze
