// Scores of synthetic campaigns: counts by brute force, tables and JSON, and what other programs read from the file.
#include "analysis/score.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "analysis/proportions.h"
#include "tests/archive/forge.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

// Claim: S, K, U and invalid are what the records say; invalid traces count in no rate; S + K + U = N and K is the sum
// over requirements.
TEST(Score, CountsWhatTheRecordsSay) {
  const Folder folder;
  const CampaignInfo want = info(200);
  write(folder / "a.graze", want);
  const Score got = score(Archive(folder / "a.graze"));
  EXPECT_EQ(got.campaign, want.scenario_name);
  EXPECT_TRUE(got.complete);
  ASSERT_EQ(got.policies.size(), 3u);
  for (int policy = 0; policy < 3; ++policy) {
    std::array<std::uint64_t, 4> counts{};
    std::vector<std::uint64_t> by_requirement(2);
    for (std::uint32_t i = 0; i < want.particles; ++i) {
      const TraceRecord record = trace(want, policy, i);
      ++counts[static_cast<std::size_t>(record.outcome)];
      if (record.violated >= 0) ++by_requirement[static_cast<std::size_t>(record.violated)];
    }
    const PolicyScore& p = got.policies[static_cast<std::size_t>(policy)];
    EXPECT_EQ(p.policy, want.policies[static_cast<std::size_t>(policy)]);
    EXPECT_EQ(p.success, counts[0]);
    EXPECT_EQ(p.known, counts[1]);
    EXPECT_EQ(p.unknown, counts[2]);
    EXPECT_EQ(p.invalid, counts[3]);
    EXPECT_GT(p.invalid, 0u);
    EXPECT_EQ(p.n, counts[0] + counts[1] + counts[2]);
    EXPECT_EQ(p.by_requirement, by_requirement);
    EXPECT_EQ(p.rate, static_cast<double>(counts[0]) / static_cast<double>(p.n));
    EXPECT_EQ(p.interval.low, clopper_pearson(p.success, p.n).low);
  }
}

// Claim: a pair counts the particles that both policies have and for which both traces are valid; a policy that was
// simulated on some of the particles only is compared on those.
TEST(Score, PairsCountCommonValidParticles) {
  const Folder folder;
  const CampaignInfo want = info(200);
  {
    CampaignWriter writer(folder / "a.graze", want, false);
    Block all = block(want, 0, range(0, 200)), some = block(want, 1, range(50, 120));
    writer.append(1, std::move(some.traces), std::move(some.values));
    writer.append(0, std::move(all.traces), std::move(all.values));
    writer.finish(false);
  }
  PairedTable brute;
  for (std::uint32_t i = 50; i < 120; ++i) {
    const Outcome a = trace(want, 0, i).outcome, b = trace(want, 1, i).outcome;
    if (a == Outcome::invalid || b == Outcome::invalid) continue;
    const bool sa = a == Outcome::success, sb = b == Outcome::success;
    ++(sa && sb ? brute.both : sa ? brute.only_a : sb ? brute.only_b : brute.neither);
  }
  const Score got = score(Archive(folder / "a.graze"));
  ASSERT_EQ(got.pairs.size(), 3u);
  const PairedComparison& pair = got.pairs[0];
  EXPECT_EQ(pair.a, "step/1cm");
  EXPECT_EQ(pair.b, "step/4cm");
  EXPECT_EQ(pair.both, brute.both);
  EXPECT_EQ(pair.only_a, brute.only_a);
  EXPECT_EQ(pair.only_b, brute.only_b);
  EXPECT_EQ(pair.neither, brute.neither);
  EXPECT_EQ(pair.n, brute.n());
  EXPECT_EQ(pair.difference, paired_difference(brute));
  EXPECT_EQ(pair.p_value, mcnemar_exact(brute.only_a, brute.only_b));
  EXPECT_EQ(got.pairs[1].n, 0u);  // "hold" was not simulated
  EXPECT_EQ(got.pairs[1].p_value, 1);
}

// Claim: an unfinished campaign says so in table and JSON, and a policy without traces has no rate.
TEST(Score, IncompleteSaysSo) {
  const Folder folder;
  { CampaignWriter(folder / "a.graze", info(200), false).finish(false); }
  EXPECT_FALSE(std::filesystem::exists(folder / "a.graze"));  // not one trace: as if it had never been
  {
    CampaignWriter writer(folder / "b.graze", info(200), false);
    Block one = block(info(200), 0, range(0, 3));
    writer.append(0, std::move(one.traces), std::move(one.values));
    writer.finish(false);
  }
  const Score got = score(Archive(folder / "b.graze"));
  EXPECT_FALSE(got.complete);
  EXPECT_THAT(format_score(got), HasSubstr("INCOMPLETE"));
  const auto json = nlohmann::json::parse(score_json(got));
  EXPECT_EQ(json["complete"], false);
  EXPECT_TRUE(json["policies"][2]["rate"].is_null());
  EXPECT_EQ(json["policies"][2]["interval"], nlohmann::json({0.0, 1.0}));
}

// Claim: where traces went on after a violation, the table also counts those that met their objective in spite of it.
TEST(Score, ObjectiveMetAfterAViolationHasAColumn) {
  Score s;
  s.policies = {{"p", 10, 3, 6, 1, 0, {6}, 8, 0.3, {0.1, 0.6}}};
  EXPECT_THAT(format_score(s), ::testing::HasSubstr("objective met"));
  s.policies[0].objective_met = 3;
  EXPECT_THAT(format_score(s), ::testing::Not(::testing::HasSubstr("objective met")));
}

// Claim: measures are counted beside the outcome, for all valid traces and for those that met the objective, and have a
// table; no known failure is put down to one.
TEST(Score, MeasuresAreCountedBesideTheOutcome) {
  const Folder folder;
  CampaignInfo want = info(200);
  want.requirements.push_back({"gentle", "impulse", "N s", true});
  std::uint64_t kept = 0, met = 0;
  {
    CampaignWriter writer(folder / "a.graze", want, false);
    Block all = block(want, 0, range(0, 200));
    for (TraceRecord& trace : all.traces) {
      trace.end_time = want.end;
      trace.margins[2] = trace.particle % 3 == 0 ? -0.1 : 0.0;
      const bool counts = trace.particle % 3 != 0 && trace.outcome != Outcome::invalid;
      kept += counts;
      met += counts && trace.objective_margin >= 0;
    }
    writer.append(0, std::move(all.traces), std::move(all.values));
    writer.finish(false);
  }
  const Archive archive(folder / "a.graze");
  EXPECT_TRUE(archive.info().requirements[2].measure);
  EXPECT_FALSE(archive.info().requirements[1].measure);
  const Score got = score(archive);
  EXPECT_THAT(got.requirements, ::testing::ElementsAre("upright", "clears-curb"));
  EXPECT_THAT(got.measures, ::testing::ElementsAre("gentle"));
  const PolicyScore& p = got.policies[0];
  EXPECT_EQ(p.by_requirement.size(), 2u);
  ASSERT_EQ(p.kept.size(), 1u);
  EXPECT_EQ(p.kept[0].all, kept);
  EXPECT_EQ(p.kept[0].met, met);
  EXPECT_GT(met, 0u);
  EXPECT_EQ(p.kept[0].interval.high, clopper_pearson(kept, p.n).high);
  EXPECT_THAT(format_score(got), HasSubstr("objective met  of these kept"));
  const auto json = nlohmann::json::parse(score_json(got));
  EXPECT_EQ(json["policies"][0]["measures"]["gentle"]["kept"], kept);
}

/// Four traces that met their objective as far as they went: one that lasted, and three that a violation ended at 0.5
/// s; the measures of the last but one fell below 0 before.
Score score_of_cut_traces(const Folder& folder, const CampaignInfo& info) {
  {
    CampaignWriter writer(folder / "a.graze", info, false);
    Block all = block(info, 0, range(0, 4));
    for (TraceRecord& trace : all.traces) {
      const bool lasted = trace.particle == 0;
      trace.outcome = lasted ? Outcome::success : Outcome::known_failure;
      trace.violated = lasted ? -1 : 0;
      trace.end_time = lasted ? info.end : 0.5;
      trace.objective_margin = 0.1;
      trace.first_violations.assign(trace.margins.size(), std::nan(""));
      if (!lasted) trace.first_violations[0] = 0.5;
      for (std::size_t i = 2; i < trace.margins.size(); ++i) {
        trace.margins[i] = trace.particle == 2 ? -0.1 : 0.1;
        if (trace.particle == 2) trace.first_violations[i] = 0.1;
      }
    }
    writer.append(0, std::move(all.traces), std::move(all.values));
    writer.finish(false);
  }
  return score(Archive(folder / "a.graze"));
}

// Claim: a trace that a violation ended before a measure's window was over has not kept the measure, and has met no
// objective; it is undecided unless the measure fell below 0 before, and table and JSON say so.
TEST(Score, CutTracesKeepNoMeasuresThatTheyDidNotSeeToTheEnd) {
  const Folder folder;
  CampaignInfo want = info(200);
  want.particles = 4;
  want.requirements.push_back({"always", "", "m", true});
  want.requirements.push_back({"early", "", "m", true, "", {0.1, 0.5}});
  want.requirements.push_back({"a step more", "", "m", true, "", {0.1, 0.501}});
  want.requirements.push_back({"late", "", "m", true, "", {1.0, 9.0}});
  const Score got = score_of_cut_traces(folder, want);
  const PolicyScore& p = got.policies[0];
  EXPECT_EQ(p.n, 4u);
  EXPECT_EQ(p.objective_met, 1u);
  const auto counts = [&](std::size_t k) { return std::array{p.kept[k].all, p.kept[k].undecided, p.kept[k].met}; };
  using Counts = std::array<std::uint64_t, 3>;
  EXPECT_EQ(counts(0), (Counts{1, 2, 1}));
  EXPECT_EQ(counts(1), (Counts{3, 0, 1}));
  EXPECT_EQ(counts(2), (Counts{1, 2, 1}));
  EXPECT_EQ(counts(3), (Counts{1, 2, 1}));
  EXPECT_EQ(p.kept[0].interval.high, clopper_pearson(1, 4).high);
  EXPECT_THAT(format_score(got), AllOf(HasSubstr("of these kept  undecided\n"), ContainsRegex("early +4 +3 .* 0\n")));
  const auto json = nlohmann::json::parse(score_json(got));
  EXPECT_EQ(json["policies"][0]["measures"]["always"]["undecided"], 2);
  EXPECT_EQ(json["policies"][0]["objective_met"], 1);
}

// Claim: archives that do not know windows are read as if measures were to be kept to the end.
TEST(Score, MeasuresWithoutWindowsReachToTheEnd) {
  const Folder folder;
  CampaignInfo want = info(200);
  want.particles = 4;
  want.requirements.push_back({"early", "", "m", true, "", {0.1, 0.5}});
  score_of_cut_traces(folder, want);
  pack(folder / "a.graze", folder / "a.h5", false);
  const auto old = forged(folder, folder / "a.h5", [](hid_t file) {
    for (const char* path : {"requirements/from", "requirements/to"}) drop(file, path);
  });
  EXPECT_EQ(score(Archive(folder / "a.h5")).policies[0].kept[0].all, 3u);
  EXPECT_EQ(score(Archive(old)).policies[0].kept[0].all, 1u);
}

// Claim: the table has one aligned line per policy, requirement counts and pairs, in the shape shown in
// docs/statistics.md.
TEST(Score, Table) {
  Score s;
  s.campaign = "Curb";
  s.requirements = {"upright", "clears-curb"};
  s.policies = {{"step/1cm", 100, 0, 97, 3, 0, {1, 96}, 0, 0.0, {0, 0.0362}},
                {"step/4cm", 99, 95, 4, 0, 1, {4, 0}, 95, 95.0 / 99, {0.8998, 0.9889}}};
  s.pairs = {{"step/1cm", "step/4cm", 99, 0, 0, 95, 4, 95.0 / 99, {0.8898, 0.9842}, 5.05e-29}};
  EXPECT_EQ(format_score(s),
            "Curb\n"
            "\n"
            "policy      N   S   K  U  invalid    rate     95 % interval\n"
            "step/1cm  100   0  97  3        0  0.0000  0.0000 .. 0.0362\n"
            "step/4cm   99  95   4  0        1  0.9596  0.8998 .. 0.9889\n"
            "\n"
            "Known failures by the requirement that was violated first\n"
            "policy    upright  clears-curb\n"
            "step/1cm        1           96\n"
            "step/4cm        4            0\n"
            "\n"
            "The same particles under two policies\n"
            "a         b         pairs  both  only a  only b  neither  rate b - a       95 % interval  McNemar p\n"
            "step/1cm  step/4cm     99     0       0      95        4     +0.9596  +0.8898 .. +0.9842   5.05e-29\n");
}

// Claim: of many pairs those that differ most stand in the table, and how many do not is told.
TEST(Score, TableOfManyPairs) {
  Score s;
  for (int i = 0; i < 21; ++i) {
    PairedComparison& pair = s.pairs.emplace_back();
    pair.a = "a" + std::to_string(i), pair.b = "b", pair.n = 8;
    pair.p_value = i == 20 ? std::numeric_limits<double>::quiet_NaN() : 0.01 * (20 - i);
  }
  const std::string text = format_score(s);
  EXPECT_THAT(text, AllOf(HasSubstr("\na19 "), HasSubstr("\na10 "), HasSubstr("11 pairs that differ less")));
  EXPECT_THAT(text, ::testing::Not(::testing::AnyOf(HasSubstr("\na9 "), HasSubstr("\na20 "))));
}

/// A Python that has h5py and pandas; empty if there is none.
std::string python() {
  for (const char* program : {"python3", "/usr/bin/python3"}) {
    const std::string command = std::string(program) + " -c 'import h5py, pandas' 2>/dev/null";
    if (std::system(command.c_str()) == 0) return program;
  }
  return "";
}

// Claim: h5py and pandas, knowing docs/archive.md alone, find in the packed file the table that `score` prints.
TEST(Score, PandasFindsTheSameTable) {
  const std::string program = python();
  if (program.empty()) GTEST_SKIP() << "no Python with h5py and pandas";
  const Folder folder;
  CampaignInfo facts = info(200);
  facts.unconverged = 0.01;  // some are flagged
  write(folder / "a.graze", facts);
  pack(folder / "a.graze", folder / "a.h5", false);
  put(folder / "score.json", score_json(score(Archive(folder / "a.h5"))));
  const std::string script = std::string(GRAZE_SOURCE_DIR) + "/tests/analysis/read_with_pandas.py";
  const std::string command =
      program + " " + script + " " + (folder / "a.h5").string() + " " + (folder / "score.json").string();
  EXPECT_EQ(std::system(command.c_str()), 0);
}

}  // namespace
}  // namespace graze
