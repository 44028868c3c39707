// Comparisons of two campaigns with planted differences.
#include "analysis/compare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "tests/analysis/planted_archive.h"
#include "tests/message_of.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

struct Fate {
  Outcome outcome = Outcome::success;
  int violated = -1;
  double margin = 1;  // of the first requirement
  double end = 0;     // s; 0: as it comes
};

/// A campaign of one policy, whose particles meet these fates; `shift` is added to the first parameter.
void write_fates(const std::filesystem::path& path, const std::vector<Fate>& fates, std::uint64_t seed = 1,
                 double shift = 0, const std::vector<std::string>& policies = {"walk"}) {
  CampaignInfo info = synthetic::info();
  info.policies = policies;
  info.seed = seed;
  info.particles = fates.size();
  const auto trace_of = [&](std::uint32_t i) {
    TraceRecord record = planted::plain_trace(info, 0, i, fates[i].outcome);
    record.violated = fates[i].violated;
    record.margins[0] = fates[i].margin;
    if (fates[i].end > 0) record.end_time = fates[i].end;
    return record;
  };
  planted::write(path, info, trace_of, shift);
}

Comparison compared(const synthetic::Folder& folder) {
  return compare_campaigns(Archive(folder / "a.graze"), Archive(folder / "b.graze"),
                           {"a.graze", "b.graze", {}, "", ""});
}

TEST(Compare, CountsWhoWasFixedAndWhoBroke) {
  const synthetic::Folder folder;
  std::vector<Fate> a(20), b(20);
  for (int i = 0; i < 6; ++i) a[i] = {Outcome::known_failure, 0, -0.5};
  for (int i = 0; i < 2; ++i) b[i] = {Outcome::known_failure, 1, 0.25};
  b[10] = {Outcome::unknown_failure, -1, 1};
  b[19] = {Outcome::invalid, -1, 1};
  write_fates(folder / "a.graze", a);
  write_fates(folder / "b.graze", b);
  const Comparison got = compared(folder);
  EXPECT_TRUE(got.particles.same());
  EXPECT_EQ(got.particles.compared, 20u);
  EXPECT_THAT(got.particles.differ, IsEmpty());
  ASSERT_THAT(got.policies, SizeIs(1));
  const PolicyComparison& one = got.policies[0];
  EXPECT_EQ(one.pairs.n(), 19u) << "one is invalid in B";
  EXPECT_EQ(one.pairs.only_b, 4u);
  EXPECT_EQ(one.pairs.only_a, 1u);
  EXPECT_EQ(one.pairs.neither, 2u);
  EXPECT_NEAR(one.difference, 3.0 / 19, 1e-15);
  EXPECT_EQ(one.p_value, mcnemar_exact(1, 4));
  ASSERT_THAT(one.broken, SizeIs(1));
  EXPECT_EQ(one.broken[0].particle, 10u);
  EXPECT_EQ(one.broken[0].in_b, "objective");
  ASSERT_THAT(one.fixed, SizeIs(4));
  EXPECT_EQ(one.fixed[0].particle, 2u);
  ASSERT_FALSE(one.margins.empty());
  EXPECT_EQ(one.margins[0].n, 19u);
  EXPECT_EQ(one.margins[0].better, 6u);
  EXPECT_EQ(one.margins[0].worse, 0u);
  const std::string text = format_comparison(got, 2);
  EXPECT_THAT(text, HasSubstr("The same particles"));
  EXPECT_THAT(text, HasSubstr("graze replay b.graze --particle 10 --policy walk"));
  EXPECT_THAT(text, HasSubstr("… and 2 more"));
  const auto json = nlohmann::json::parse(comparison_json(got));
  EXPECT_EQ(json["policies"][0]["pairs"]["fixed"], 4);
  EXPECT_EQ(json["policies"][0]["fixed"].size(), 4u);
  EXPECT_THAT(changes_csv(got), HasSubstr("walk,walk,10,broken,success,objective,0,0\n"));
}

TEST(Compare, OfOtherParticlesIsUnpaired) {
  const synthetic::Folder folder;
  std::vector<Fate> a(50), b(50);
  for (int i = 0; i < 25; ++i) a[i] = {Outcome::unknown_failure, -1, 1};
  write_fates(folder / "a.graze", a, 1);
  write_fates(folder / "b.graze", b, 2);
  const Comparison got = compared(folder);
  EXPECT_EQ(got.particles.others, "the seeds differ (1 and 2)");
  EXPECT_FALSE(got.policies[0].paired);
  EXPECT_DOUBLE_EQ(got.policies[0].difference, 0.5);
  EXPECT_GT(got.policies[0].interval.low, 0.3);
  EXPECT_LT(got.policies[0].p_value, 1e-8);
  EXPECT_THAT(format_comparison(got, 5), HasSubstr("independent samples"));
  EXPECT_THAT(format_comparison(got, 5), Not(HasSubstr("Fixed")));
}

// A margin that a trace had no time to narrow is no gain.
TEST(Compare, LeavesOutMarginsOfTracesThatWereCutShort) {
  const synthetic::Folder folder;
  std::vector<Fate> a(20, {Outcome::success, -1, 0.5, 1.5}), b = a;
  for (int i = 0; i < 8; ++i) b[i] = {Outcome::known_failure, 1, 0.9, 0.4};
  write_fates(folder / "a.graze", a);
  write_fates(folder / "b.graze", b);
  const Comparison got = compared(folder);
  EXPECT_EQ(got.policies[0].uneven, 8u);
  EXPECT_EQ(got.policies[0].margins[0].n, 12u);
  EXPECT_EQ(got.policies[0].margins[0].better, 0u);
  EXPECT_EQ(got.policies[0].pairs.only_a, 8u) << "who broke is counted over all";
  EXPECT_THAT(format_comparison(got, 5), HasSubstr("without 8 pairs of traces that did not end at the same time"));
}

// Rates and their difference are of the same particles.
TEST(Compare, TellsRatesOfThePairs) {
  const synthetic::Folder folder;
  std::vector<Fate> a(40), b(10);
  for (int i = 20; i < 40; ++i) a[i] = {Outcome::unknown_failure, -1, 1};
  write_fates(folder / "a.graze", a);
  write_fates(folder / "b.graze", b);
  const std::string text = format_comparison(compared(folder), 5);
  EXPECT_THAT(text, HasSubstr("1.0000 of 10  1.0000 of 10"));
  EXPECT_THAT(text, HasSubstr("+0.0000"));
}

TEST(Compare, NamesParametersWithOtherValues) {
  const synthetic::Folder folder;
  write_fates(folder / "a.graze", std::vector<Fate>(5), 1);
  write_fates(folder / "b.graze", std::vector<Fate>(5), 1, 0.5);
  const Comparison got = compared(folder);
  EXPECT_THAT(got.particles.differ, ElementsAre("robot.link.LF_SHIN.length"));
  EXPECT_THAT(format_comparison(got, 5), HasSubstr("1 parameter has other values"));
}

// Values that differ are shown where they differ, however long their beginnings.
TEST(Compare, ShowsWhereLongValuesDiffer) {
  Comparison of;
  const std::string folder = "somewhere/far/away/in/a/folder/of/a/long/nam\xC3\xA9/";
  of.changes = {{"robot.urdf", folder + "before.urdf", folder + "after.urdf"}, {"time.end", "1 s", ""}};
  const std::string text = format_comparison(of, 5);
  EXPECT_THAT(text, HasSubstr("  robot.urdf: …/long/nam\xC3\xA9/before.urdf -> …/long/nam\xC3\xA9/after.urdf\n"));
  EXPECT_THAT(text, HasSubstr("  time.end: 1 s -> (not there)\n"));
}

TEST(Compare, NeedsAPolicyInCommonUnlessEachHasOne) {
  const synthetic::Folder folder;
  write_fates(folder / "a.graze", std::vector<Fate>(3), 1, 0, {"walk"});
  write_fates(folder / "b.graze", std::vector<Fate>(3), 1, 0, {"trot"});
  EXPECT_EQ(compared(folder).policies[0].policy_b, "trot");
  write_fates(folder / "c.graze", std::vector<Fate>(3), 1, 0, {"trot", "gallop"});
  EXPECT_THAT(
      testing::message_of([&] {
        compare_campaigns(Archive(folder / "a.graze"), Archive(folder / "c.graze"), {"a", "c", {}, "", ""});
      }),
      HasSubstr("no policy in common: a has walk; c has trot, gallop; name one of each by --policy and --with"));
}

// Claim: where B is as good as A on each particle but for luck, the paired test is significant at 5 % in at most 5 % of
// campaigns (the exact test is conservative); of 300, more than 28 has a probability of 0.1 % at 5 %.
TEST(Compare, FindsNoDifferenceWhereThereIsNone) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(0, 1);
  int found = 0, covered = 0;
  for (int campaign = 0; campaign < 300; ++campaign) {
    PairedTable pairs;
    for (int i = 0; i < 100; ++i) {
      const double chance = uniform(random);
      const bool a = uniform(random) < chance, b = uniform(random) < chance;
      ++(a ? b ? pairs.both : pairs.only_a : b ? pairs.only_b : pairs.neither);
    }
    found += mcnemar_exact(pairs.only_a, pairs.only_b) < 0.05;
    const Interval interval = newcombe_paired(pairs);
    covered += interval.low <= 0 && interval.high >= 0;
  }
  EXPECT_LE(found, 28);
  EXPECT_GE(covered, 272);
}

// Claim: Newcombe's example (1998, table II, 56/70 against 48/80): 0.0524 to 0.3339.
TEST(Proportions, NewcombeOfIndependentSamples) {
  const Interval got = newcombe_independent(48, 80, 56, 70);
  EXPECT_NEAR(got.low, 0.0524, 5e-5);
  EXPECT_NEAR(got.high, 0.3339, 5e-5);
}

}  // namespace
}  // namespace graze
