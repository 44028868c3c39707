// Claim: each failed trace is listed once, with what there is to say of it and a command that replays it.
#include "analysis/failures.h"

#include <gmock/gmock.h>

#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "analysis/failure_table.h"
#include "analysis/score.h"
#include "tests/archive/compare.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

// Claim: the table of failures is that of the records, in order of particle, from a directory and from one file.
TEST(Failures, AreThoseOfTheRecords) {
  const Folder folder;
  const CampaignInfo want = info(200);
  write(folder / "a.graze", want);
  pack(folder / "a.graze", folder / "a.h5", false);
  for (const char* name : {"a.graze", "a.h5"}) {
    const Archive archive(folder / name);
    for (int policy = 0; policy < 3; ++policy) {
      const FailureTable table = failures_of(archive, want.policies[static_cast<std::size_t>(policy)]);
      std::size_t row = 0;
      for (std::uint32_t i = 0; i < want.particles; ++i) {
        const TraceRecord record = trace(want, policy, i);
        if (record.outcome == Outcome::success) continue;
        ASSERT_LT(row, table.rows.size());
        const FailureTable::Row& got = table.rows[row++];
        EXPECT_EQ(got.particle, i);
        EXPECT_EQ(got.outcome, record.outcome);
        EXPECT_EQ(got.violated, record.violated);
        const bool known = record.outcome == Outcome::known_failure;
        EXPECT_EQ(got.margin, known ? record.margins[static_cast<std::size_t>(record.violated)] : -0.5);
        EXPECT_EQ(got.culprit.part, known                                ? record.violation_parts[record.violated]
                                    : record.outcome == Outcome::invalid ? kNoPart
                                                                         : static_cast<int>(i % 3));
        EXPECT_EQ(got.culprit.leaf, record.outcome == Outcome::unknown_failure ? 1 : -1);
        EXPECT_EQ(got.time, record.end_time) << "the synthetic traces end at their violation";
        if (record.outcome == Outcome::invalid) {
          EXPECT_EQ(table.reasons.at(got.reason), record.invalid_reason);
        }
      }
      EXPECT_EQ(row, table.rows.size());
      EXPECT_GT(row, 50u);
    }
    EXPECT_TRUE(failures_of(archive, "nobody").rows.empty());
  }
}

// Claim: asked for some particles, the table has the rows of these, in the same order.
TEST(Failures, CanBeOfSomeParticles) {
  const Folder folder;
  write(folder / "a.graze", info(200));
  const Archive archive(folder / "a.graze");
  const auto wanted = [](std::uint32_t particle) { return particle % 7 == 3; };
  std::size_t found = 0;
  for (const std::string& policy : archive.info().policies) {
    FailureTable all = failures_of(archive, policy);
    const FailureTable some = failures_of(archive, policy, wanted);
    std::erase_if(all.rows, [&](const FailureTable::Row& row) { return !wanted(row.particle); });
    ASSERT_EQ(some.rows.size(), all.rows.size());
    for (std::size_t i = 0; i < all.rows.size(); ++i) {
      EXPECT_EQ(some.rows[i].particle, all.rows[i].particle);
      EXPECT_EQ(some.rows[i].margin, all.rows[i].margin);
      if (all.rows[i].outcome != Outcome::invalid) continue;
      EXPECT_EQ(some.reasons.at(some.rows[i].reason), all.reasons.at(all.rows[i].reason));
    }
    found += some.rows.size();
  }
  EXPECT_GT(found, 20u);
  EXPECT_TRUE(failures_of(archive, archive.info().policies[0], [](std::uint32_t) { return false; }).rows.empty());
}

// Claim: an objective's margin has the unit of the witness that gave it, in the table, the list and JSON.
TEST(Failures, MarginsOfObjectivesHaveUnits) {
  const Folder folder;
  CampaignInfo want = info(200);
  want.leaves[1].unit = "rad";  // all synthetic objectives are missed there
  write(folder / "a.graze", want);
  const Archive archive(folder / "a.graze");
  const Score result = score(archive, "a.graze");
  EXPECT_THAT(format_score(result), HasSubstr("-0.5 rad"));
  std::ostringstream list;
  list_traces(archive, Listed::failures, want.policies, "a.graze", false, list);
  EXPECT_THAT(list.str(), HasSubstr("-0.5 rad"));
  const nlohmann::json json = nlohmann::json::parse(score_json(result));
  for (const auto& failure : json["failures"]) {
    if (failure["outcome"].get<std::string>() != "unknown failure") continue;
    EXPECT_EQ(failure["unit"], "rad");
  }
}

// Claim: of each policy and way of failing the lowest particle stands for all, and the counts are the score's.
TEST(Failures, TheFirstOfEachKindStandsForAll) {
  const Folder folder;
  write(folder / "a.graze", info(200));
  const Archive archive(folder / "a.graze");
  const Score result = score(archive, "a.graze");
  std::map<std::string, std::uint64_t> known, others;
  for (const Failure& failure : result.failures) {
    (failure.outcome == Outcome::known_failure ? known : others)[failure.policy] += failure.alike;
    const auto record = archive.trace(failure.policy, failure.particle);
    ASSERT_TRUE(record);
    EXPECT_EQ(record->outcome, failure.outcome);
  }
  for (const PolicyScore& policy : result.policies) {
    EXPECT_EQ(known[policy.policy], policy.known);
    EXPECT_EQ(others[policy.policy], policy.unknown + policy.invalid);
  }
  const std::string text = format_score(result);
  EXPECT_THAT(text, AllOf(HasSubstr("'graze score a.graze --failures' lists all"), HasSubstr("clears-curb"),
                          HasSubstr("graze replay a.graze --particle "), HasSubstr("state is not finite")));
  EXPECT_THAT(format_score(result, false), Not(HasSubstr("graze replay")));
  EXPECT_THAT(format_failures(result.failures, "a.graze", "list", 2), HasSubstr("more kinds"));
}

// Claim: a reason that is too long for its column ends behind a whole word, and stands below the table as it is.
TEST(Failures, ReasonsAreCutBetweenWords) {
  Failure failure;
  failure.policy = "hold";
  failure.what = "step 17 (0.017 s), 'thigh' in 'ground' by 12 mm: the velocity of body 'extraordinary' is not finite";
  const std::string text = format_failures({failure}, "a", "list", 5);
  EXPECT_THAT(text, HasSubstr("'thigh' in 'ground' by 12 mm: the …  "));
  EXPECT_THAT(text, EndsWith("\nhold, particle 0: " + failure.what + "\n"));
  EXPECT_EQ(text.find("veloc"), text.rfind("veloc"));
  failure.what = "short";
  EXPECT_THAT(format_failures({failure}, "a", "list", 5), Not(HasSubstr("particle 0:")));
}

// Claim: the whole list, as text and as JSON, has a line for every failure.
TEST(Failures, TheWholeListHasEveryFailure) {
  const Folder folder;
  write(folder / "a.graze", info(200));
  const Archive archive(folder / "a.graze");
  std::size_t failed = 0;
  for (const PolicyScore& policy : score(archive).policies) failed += policy.known + policy.unknown + policy.invalid;
  std::ostringstream text, json;
  list_traces(archive, Listed::failures, archive.info().policies, "my campaign.h5", false, text);
  const std::string lines = text.str();
  EXPECT_EQ(static_cast<std::size_t>(std::count(lines.begin(), lines.end(), '\n')), failed + 1);
  list_traces_json(archive, Listed::failures, archive.info().policies, "my campaign.h5", json);
  const auto list = nlohmann::json::parse("[" + json.str() + "]");
  ASSERT_EQ(list.size(), failed);
  for (const auto& one : list) {
    EXPECT_EQ(one["replay"], replay_command("my campaign.h5", one["policy"], one["particle"]));
  }
}

// Claim: commands can be pasted into a shell whatever the names are.
TEST(Failures, CommandsAreQuotedForAShell) {
  EXPECT_EQ(replay_command("a.graze", "step/4cm", 7), "graze replay a.graze --particle 7 --policy step/4cm");
  EXPECT_EQ(replay_command("my runs/a.h5", "it's", 0), "graze replay 'my runs/a.h5' --particle 0 --policy 'it'\\''s'");
}

}  // namespace
}  // namespace graze
