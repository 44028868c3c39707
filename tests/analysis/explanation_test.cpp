// Explanations of made-up archives whose truth is known: what decides is named, modes and deaths are counted, and text,
// JSON and tables tell the same.
#include "analysis/explanation.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "analysis/report_causes.h"
#include "analysis/report_survival.h"
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

// Claim: a margin has its unit in the rules of its tree, too.
TEST(Explanation, RulesOfMarginsHaveTheirUnit) {
  const Folder folder;
  write_campaign(folder / "a.graze", facts());
  const Explanation got = explain(Archive(folder / "a.graze"), {"decided"});
  ASSERT_TRUE(causes_of(got.policies[0], "margin: upright").tree_tells);
  EXPECT_THAT(format_explanation(got), ::testing::ContainsRegex("\n        mean -?0[.][0-9]+ rad of [0-9]+: "));
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

// Claim: survival by itself is that of the whole explanation, test by test; of large campaigns the first particles.
TEST(Explanation, SurvivalAlone) {
  const Folder folder;
  write_campaign(folder / "a.graze", facts());
  const Archive archive(folder / "a.graze");
  const Explanation all = explain(archive), alone = explain_survival(archive);
  EXPECT_EQ(explain_survival(archive, {"idle"}).policies[0].policy, "idle");
  ASSERT_EQ(alone.policies.size(), 2u);
  for (std::size_t p = 0; p < 2; ++p) {
    EXPECT_EQ(alone.policies[p].policy, all.policies[p].policy);
    EXPECT_EQ(alone.policies[p].n, all.policies[p].n);
    ASSERT_EQ(alone.policies[p].survival.size(), all.policies[p].survival.size());
    for (std::size_t k = 0; k < all.policies[p].survival.size(); ++k) {
      const Survival &got = alone.policies[p].survival[k], &want = all.policies[p].survival[k];
      EXPECT_EQ(got.what, want.what);
      EXPECT_EQ(got.failed, want.failed);
      ASSERT_EQ(got.steps.size(), want.steps.size());
      for (std::size_t i = 0; i < got.steps.size(); ++i) {
        EXPECT_EQ(got.steps[i].share, want.steps[i].share);
        EXPECT_EQ(got.steps[i].interval.low, want.steps[i].interval.low);
      }
    }
  }
  EXPECT_EQ(alone.log_rank.chi_square, all.log_rank.chi_square);
  ASSERT_EQ(alone.pairs.size(), 1u);
  EXPECT_EQ(alone.pairs[0].p_holm, all.pairs[0].p_holm);
  EXPECT_TRUE(alone.notes.empty());
  const Explanation first = explain_survival(archive, {}, {40});
  EXPECT_EQ(first.policies[0].n, 40u);
  EXPECT_THAT(survival_section(first, NumberForm::plain)["text"].get<std::string>(),
              ::testing::EndsWith(" Only of the first 40 particles."));
}

const Json& widget_of(const Json& section, const std::string& title) {
  for (const Json& one : section["widgets"]) {
    if (one.value("title", "") == title) return one;
  }
  throw std::runtime_error("no widget " + title);
}

// Claim: the page's curves begin at 1, have the shares and intervals of the estimate at its steps, and end when the
// last trace was seen; the table has what is left; a sentence says whether policies differ; where nothing is violated
// there are no curves, and a word.
TEST(ReportSurvival, IsThatOfTheExplanation) {
  const Folder folder;
  write_campaign(folder / "a.graze", facts());
  const Explanation all = explain(Archive(folder / "a.graze"));
  const Json section = survival_section(all, NumberForm::plain);
  const Json& plots = section["widgets"][0]["widgets"];
  ASSERT_EQ(plots.size(), 1u) << "one requirement alone has the curve of any";
  ASSERT_EQ(plots[0]["lines"].size(), 2u);
  const Json& line = plots[0]["lines"][0];
  const Survival& any = all.policies[0].survival[0];
  const SurvivalStep& step = any.steps[0];
  EXPECT_EQ(line["name"], "decided");
  EXPECT_EQ(line["x"], (Json{0.0, 0.5, any.seen_until}));
  EXPECT_EQ(any.seen_until, facts().end);
  EXPECT_EQ(line["y"], (Json{1.0, short_number(step.share), short_number(step.share)}));
  EXPECT_EQ(line["low"], (Json{1.0, short_number(step.interval.low), short_number(step.interval.low)}));
  EXPECT_EQ(line["high"], (Json{1.0, short_number(step.interval.high), short_number(step.interval.high)}));
  const Json& row = widget_of(section, "What is left")["rows"][0];
  EXPECT_EQ(row[1], "any requirement");
  EXPECT_EQ(row[2], all.policies[0].n);
  EXPECT_EQ(row[3], all.policies[0].known);
  EXPECT_EQ(row[4], step.share);
  EXPECT_THAT(section["widgets"][1]["text"].get<std::string>(),
              ::testing::AllOf(HasSubstr("1 degree of freedom, " + p_words(all.log_rank.p_value)),
                               HasSubstr(all.log_rank.p_value < 0.05 ? "differ in how long" : "no difference shows")));
  const Json& pair = widget_of(section, "Whether two policies differ: log-rank tests")["rows"][0];
  EXPECT_EQ(pair[3]["value"], short_number(all.pairs[0].p_holm));
  const Json packed = survival_section(all, NumberForm::packed);
  EXPECT_EQ(packed["widgets"][0]["widgets"][0]["lines"][0]["x"]["n"], 3);

  Explanation calm = all;
  for (PolicyExplanation& policy : calm.policies) {
    for (Survival& survival : policy.survival) survival.steps.clear(), survival.failed = 0;
  }
  EXPECT_THAT(survival_section(calm, NumberForm::plain).dump(),
              ::testing::AllOf(HasSubstr("No requirement was violated"), Not(HasSubstr("lines"))));
  for (PolicyExplanation& policy : calm.policies) policy.n = 0;
  EXPECT_TRUE(survival_section(calm, NumberForm::plain).is_null());
}

// Claim: of very many steps some are drawn, all of them points of the estimate, the last among them.
TEST(ReportSurvival, ManySteps) {
  std::vector<Lifetime> lifetimes;
  for (int i = 0; i < 3000; ++i) lifetimes.push_back({1e-3 * (i + 1), true});
  Explanation all;
  PolicyExplanation& policy = all.policies.emplace_back();
  policy.n = lifetimes.size();
  policy.survival = {survival_of(lifetimes), survival_of(lifetimes), survival_of({})};
  all.log_rank.p_value = std::numeric_limits<double>::quiet_NaN();
  const Json line = survival_section(all, NumberForm::plain)["widgets"][0]["widgets"][0]["lines"][0];
  ASSERT_EQ(line["x"].size(), 501u);
  EXPECT_EQ(line["x"].back(), 3.0);
  EXPECT_EQ(line["y"].back(), 0.0);
  for (std::size_t i = 1; i < 501; ++i) {
    EXPECT_NEAR(line["y"][i].get<double>(), 1 - line["x"][i].get<double>() / 3, 1e-5);
  }
}

// Claim: the page has each question with the verdict of the explanation, the parameters that matter with effect, p and
// direction, the tree with its counts, and what final states do; what nothing explains is said so.
TEST(ReportCauses, AreThoseOfTheExplanation) {
  const Folder folder;
  write_campaign(folder / "a.graze", facts());
  const Explanation all = explain(Archive(folder / "a.graze"));
  const Json section = causes_section(all, "a b.graze");
  std::size_t row = 0;
  for (const PolicyExplanation& policy : all.policies) {
    for (std::size_t i = 0; i < policy.causes.size(); ++i, ++row) {
      const Json& got = widget_of(section, "What explains it")["rows"][row];
      EXPECT_EQ(got[0], policy.policy);
      EXPECT_EQ(got[1], policy.causes[i].target);
      EXPECT_EQ(got[3], policy.verdicts[i]);
      EXPECT_EQ(got[4].is_null(), !policy.causes[i].tree_tells);
      EXPECT_EQ(got[3] == "no parameter explains it", !policy.causes[i].explained()) << got;
    }
  }
  const Causes& success = causes_of(all.policies[0], "success");
  const Json& effect = widget_of(section, "Parameters that matter")["rows"][0];
  EXPECT_EQ(effect, (Json{"decided", "success", "robot.link.LF_SHIN.length", short_number(success.effects[0].effect),
                          p_cell(success.effects[0].p_holm), "more often where it is larger"}));
  const Json& figures = widget_of(section, "What goes with outcomes")["widgets"];
  ASSERT_GE(figures.size(), 3u);
  EXPECT_EQ(figures[0]["title"], "success");
  const Json& tree = widget_of(section, "Decision trees")["root"][0];
  EXPECT_THAT(tree["label"].get<std::string>(), ::testing::StartsWith("decided, success: balanced accuracy "));
  EXPECT_EQ(tree["n"], all.policies[0].n);
  EXPECT_EQ(tree["parts"][0]["value"], static_cast<double>(all.policies[0].success));
  ASSERT_EQ(tree["children"].size(), 2u);
  EXPECT_THAT(tree["children"][0]["label"].get<std::string>(), HasSubstr("robot.link.LF_SHIN.length > 0.7"));
  EXPECT_EQ(tree["children"][0]["said"], "100 %");
  const Json& states = widget_of(section, "Final states: scattering or bifurcation")["rows"];
  for (std::size_t p = 0; p < 2; ++p) EXPECT_EQ(states[p][2], scatter_text(all.policies[p].ended));
  EXPECT_EQ(widget_of(section, "Modes of final states")["bars"][1]["parts"][0]["value"], all.policies[0].success);
  EXPECT_THAT(section["text"].get<std::string>(), Not(HasSubstr("Of the first")));
  const Json few = causes_section(explain(Archive(folder / "a.graze"), {}, {100}), "a b.graze");
  EXPECT_THAT(few["text"].get<std::string>(), HasSubstr("Of the first 100 particles; graze explain 'a b.graze' asks"));
}

// Claim: without stored values the page says why there are no causes, and still tells of final states.
TEST(ReportCauses, WithoutValues) {
  const Folder folder;
  CampaignInfo without = facts();
  without.store_values = false;
  write_campaign(folder / "a.graze", without);
  const Json section = causes_section(explain(Archive(folder / "a.graze")), "a.graze");
  EXPECT_EQ(section["widgets"][0]["text"], "no causes: the archive does not keep the particles' values");
  EXPECT_THAT(widget_of(section, "Final states: scattering or bifurcation")["rows"][0][2].get<std::string>(),
              HasSubstr("bifurcates: base.x"));
}

}  // namespace
}  // namespace graze
