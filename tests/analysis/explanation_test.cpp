// Explanations of made-up archives whose truth is known: what decides is named, modes and deaths are counted, and text,
// JSON and tables tell the same.
#include "analysis/explanation.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/archive/synthetic.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::uint32_t kParticles = 160;

CampaignInfo facts() {
  CampaignInfo out = info();
  out.particles = kParticles;
  out.policies = {"decided", "idle"};
  return out;
}

/// Under "decided" the first parameter alone decides: above 0.7 the trace succeeds and ends up 1 m further, below 0.2
/// it violates the first requirement at 0.5 s, else its objective is unmet. Under "idle" nothing depends on anything.
TraceRecord record_of(const CampaignInfo& info, int policy, std::uint32_t particle) {
  TraceRecord out = trace(info, policy, particle);
  const double x = policy == 0 ? values(info, particle)[0] : draw(policy, particle, 5000);
  out.outcome = x > 0.7 ? Outcome::success : x < 0.2 ? Outcome::known_failure : Outcome::unknown_failure;
  out.violated = x < 0.2 ? 0 : -1;
  out.end_time = x < 0.2 ? 0.5 : info.end;
  out.objective_margin = x - 0.7;
  out.first_violations.assign(info.requirements.size(), std::numeric_limits<double>::quiet_NaN());
  if (x < 0.2) out.first_violations[0] = 0.5;
  // Who is cut short has not come near the second requirement yet; a window that few reach says nothing of the others.
  out.margins = {x < 0.2 ? -0.1 : 0.1, x < 0.2 ? 50 - x : draw(policy, particle, 5001)};
  if (draw(policy, particle, 5002) < 0.3) out.margins[1] = std::numeric_limits<double>::infinity();
  out.violation_parts.assign(info.requirements.size(), kNoPart);
  out.invalid_reason.clear();
  out.telemetry.clear();
  out.q = {1, policy == 0 && x > 0.7 ? 1 + 0.1 * x : 0.1 * x, 0.05 * draw(policy, particle, 21)};
  return out;
}

void write_campaign(const std::filesystem::path& directory, const CampaignInfo& info,
                    std::uint32_t count = kParticles) {
  CampaignWriter writer(directory, info, false);
  for (std::uint32_t first = 0; first < count; first += 8) {
    for (int policy = 0; policy < 2; ++policy) {
      Block one = block(info, policy, range(first, first + 8));
      for (std::uint32_t i = 0; i < 8; ++i) one.traces[i] = record_of(info, policy, first + i);
      writer.append(policy, std::move(one.traces), std::move(one.values));
    }
  }
  writer.finish(count == kParticles);
}

const Causes& causes_of(const PolicyExplanation& policy, const std::string& target) {
  for (const Causes& one : policy.causes) {
    if (one.target == target) return one;
  }
  throw std::runtime_error("no target " + target);
}

// Claim: the parameter that decides is named for success, for the failure, for the mode and for the objective's margin;
// of a policy in which nothing depends on anything no parameter explains anything.
TEST(Explanation, NamesTheCause) {
  const Folder folder;
  write_campaign(folder / "a.graze", facts());
  const Explanation got = explain(Archive(folder / "a.graze"));
  ASSERT_EQ(got.policies.size(), 2u);
  const PolicyExplanation &decided = got.policies[0], &idle = got.policies[1];
  for (const char* target : {"success", "failure: upright", "failure: objective unmet", "margin: objective"}) {
    const Causes& causes = causes_of(decided, target);
    ASSERT_GE(causes.significant, 1u) << target;
    EXPECT_EQ(got.parameters.columns[causes.effects[0].column].name, "robot.link.LF_SHIN.length") << target;
    EXPECT_FALSE(causes_of(idle, target).explained()) << target;
  }
  EXPECT_GT(causes_of(decided, "success").effects[0].effect, 0.9);
  EXPECT_LT(causes_of(decided, "failure: upright").effects[0].effect, -0.9);
  const TreeRule rule = rules_of(causes_of(decided, "success").tree)[0];
  EXPECT_EQ(rule.mean, 1);
  EXPECT_THAT(rule_text(rule, got.parameters), ::testing::StartsWith("robot.link.LF_SHIN.length > 0.7"));
}

// Claim: a margin is looked at where it was judged: not of traces that another violation cut short, which had no time
// to come near, nor where its window was never reached.
TEST(Explanation, LooksAtMarginsThatWereJudged) {
  const Folder folder;
  write_campaign(folder / "a.graze", facts());
  const Explanation got = explain(Archive(folder / "a.graze"));
  const PolicyExplanation& decided = got.policies[0];
  EXPECT_FALSE(causes_of(decided, "margin: " + facts().requirements[1].name).explained());
  EXPECT_TRUE(causes_of(decided, "margin: upright").explained()) << "its own violations are its least margins";
  const MarginSummary& second = decided.margins[1];
  EXPECT_GT(second.n, 60u);
  EXPECT_LT(second.n, decided.n - decided.known);
  for (const double quantile : second.quantiles) EXPECT_LT(quantile, 1);
}

// Claim: traces that ran to the end part in base.x into those that succeed and those that do not; the idle policy
// scatters.
TEST(Explanation, Modes) {
  const Folder folder;
  write_campaign(folder / "a.graze", facts());
  const Explanation got = explain(Archive(folder / "a.graze"));
  const PolicyExplanation& decided = got.policies[0];
  EXPECT_EQ(decided.ended.traces, decided.success + decided.unknown);
  EXPECT_EQ(decided.all.traces, decided.n);
  ASSERT_EQ(decided.modes.size(), 2u);
  EXPECT_EQ(decided.ended.freedoms[static_cast<std::size_t>(decided.ended.clearest)].name, "base.x");
  EXPECT_EQ(decided.modes[1].success, decided.success);
  EXPECT_EQ(decided.modes[1].unknown, 0u);
  EXPECT_EQ(decided.modes[0].unknown, decided.unknown);
  EXPECT_EQ(decided.modes[0].particles.size(), decided.unknown);
  EXPECT_FALSE(got.policies[1].ended.bifurcates());
  EXPECT_THAT(decided.growth.note, HasSubstr("needs telemetry"));
}

// Claim: those that violate the first requirement do so at 0.5 s, all others are seen to the end; the objective is
// apart.
TEST(Explanation, SurvivalAndMargins) {
  const Folder folder;
  write_campaign(folder / "a.graze", facts());
  const Explanation got = explain(Archive(folder / "a.graze"), {"decided"});
  const PolicyExplanation& one = got.policies[0];
  ASSERT_EQ(one.survival.size(), 4u);  // any, two requirements, the objective
  ASSERT_EQ(one.survival[0].steps.size(), 1u);
  EXPECT_EQ(one.survival[0].steps[0].time, 0.5);
  EXPECT_EQ(one.survival[0].failed, one.known);
  EXPECT_EQ(one.survival[1].what, "upright");
  EXPECT_EQ(one.survival[2].failed, 0u);
  EXPECT_EQ(one.survival[3].failed, one.unknown);
  ASSERT_EQ(one.margins.size(), 3u);
  EXPECT_EQ(one.margins[2].name, "objective");
  EXPECT_EQ(one.margins[2].n, one.success + one.unknown) << "who was cut short was not asked";
  EXPECT_EQ(one.margins[2].below, one.unknown);
  EXPECT_EQ(got.rates.policies[0].success, one.success);
}

// Claim: the text fits 80 columns but for names that are longer, tells the verdicts, and is the same at each call; JSON
// holds the same numbers; tables have as many cells in a row as in the head.
TEST(Explanation, TextJsonAndTablesAgree) {
  const Folder folder;
  write_campaign(folder / "a.graze", facts());
  const Archive archive(folder / "a.graze");
  const Explanation got = explain(archive);
  const std::string text = format_explanation(got);
  EXPECT_EQ(text, format_explanation(explain(archive)));
  EXPECT_THAT(text, HasSubstr("more often where robot.link.LF_SHIN.length is"));
  EXPECT_THAT(text, HasSubstr("no parameter explains it: success"));
  EXPECT_THAT(text, HasSubstr("bifurcates: base.x has 2 modes"));
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const auto width = std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; });
    EXPECT_LE(width, 80) << line;
  }
  const auto json = nlohmann::json::parse(explanation_json(got));
  EXPECT_EQ(json["policies"][0]["policy"], "decided");
  EXPECT_EQ(json["policies"][0]["causes"][0]["effects"][0]["parameter"], "robot.link.LF_SHIN.length");
  EXPECT_EQ(json["policies"][0]["modes"][1]["success"], got.policies[0].success);
  EXPECT_EQ(json["policies"][1]["causes"][0]["verdict"], "no parameter explains it");
  EXPECT_EQ(json["pairs"][0]["mcnemar_p"], got.rates.pairs[0].p_value);
  for (const ExplanationTable& table : explanation_tables(got)) {
    EXPECT_FALSE(table.rows.empty()) << table.name;
    for (const auto& row : table.rows) EXPECT_EQ(row.size(), table.head.size()) << table.name;
  }
}

// Claim: without stored values there are no causes, and a word why; an unfinished campaign and an empty policy are
// explained as far as they go; of large campaigns the first particles are looked at, with a word.
TEST(Explanation, WhatIsNotThere) {
  const Folder folder;
  CampaignInfo without = facts();
  without.store_values = false;
  write_campaign(folder / "a.graze", without);
  const Explanation no_values = explain(Archive(folder / "a.graze"));
  EXPECT_TRUE(no_values.policies[0].causes.empty());
  EXPECT_THAT(format_explanation(no_values), HasSubstr("the archive does not keep the particles' values"));
  CampaignInfo more = facts();
  more.policies.push_back("never");
  write_campaign(folder / "b.graze", more, 8);
  const Explanation part = explain(Archive(folder / "b.graze"));
  EXPECT_FALSE(part.complete);
  EXPECT_EQ(part.policies[2].n, 0u);
  EXPECT_THAT(format_explanation(part), HasSubstr("INCOMPLETE"));
  EXPECT_EQ(nlohmann::json::parse(explanation_json(part))["complete"], false);
  write_campaign(folder / "c.graze", facts());
  const Explanation first = explain(Archive(folder / "c.graze"), {}, {40});
  EXPECT_EQ(first.looked_at, 40u);
  EXPECT_EQ(first.policies[0].n, 40u);
  EXPECT_EQ(first.score.policies[0].n, kParticles);
  EXPECT_THAT(first.notes, ::testing::Contains(HasSubstr("of the first 40")));
}

}  // namespace
}  // namespace graze
