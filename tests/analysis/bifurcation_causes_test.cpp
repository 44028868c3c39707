// Causes of bifurcations with a planted truth: the parameter that decides which way a trace goes is found, a way that
// chance decides has no cause, at the stated rate.
#include "analysis/bifurcation_causes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/events.h"
#include "analysis/explanation.h"
#include "tests/archive/synthetic.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

enum Collided { kLeft, kRight, kGround, kCurb };
constexpr std::size_t kParameters = 15;

CampaignInfo two_bifurcations() {
  CampaignInfo info = synthetic::info();
  info.colliders = {"LF_FOOT", "RF_FOOT", "ground", "curb"};
  info.links = {"LF_FOOT", "RF_FOOT"};
  info.policies = {"walk"};
  info.end = 3;
  return info;
}

ContactPhase touch(int a, int b, double begin) {
  ContactPhase out;
  out.a = a;
  out.b = b;
  out.begin = begin;
  out.end = begin + 0.1;
  out.impulse = 1;
  return out;
}

double chance(std::uint32_t particle, std::uint64_t of, std::uint32_t campaign) {
  return uniform(31, particle, of, campaign);
}

/// How trace i goes: kLeft comes down on `first`, kRight on `second` (-1: not at all), and whether it succeeds.
struct Way {
  int first = kGround, second = kGround;
  bool success = true;
  double end = 3;
};

/// A campaign of `n` particles with idle parameters p0, p1, …, uniform within 0 .. 1.
struct Campaign {
  Campaign(std::uint32_t n, std::uint32_t number) {
    values.table.columns.resize(kParameters);
    for (std::size_t k = 0; k < kParameters; ++k) {
      values.table.columns[k].name = "p" + std::to_string(k);
      for (std::uint32_t i = 0; i < n; ++i) values.table.columns[k].values.push_back(chance(i, 100 + k, number));
    }
    for (std::uint32_t i = 0; i < n; ++i) values.particles.push_back(i);
  }
  double p(std::size_t k, std::uint32_t i) const { return values.table.columns[k].values[i]; }

  template <class Go>
  std::vector<std::vector<BifurcationCauses>> explain(const Go& go) {
    StoryTeller teller({"walk"}, {.detail = Detail::features}, 1e-3);
    for (const std::uint32_t i : values.particles) {
      const Way way = go(i);
      std::vector<ContactPhase> phases = {touch(kLeft, way.first, 0.5)};
      if (way.second >= 0) phases.push_back(touch(kRight, way.second, 1.5));
      teller.add(0, i, way.success ? Outcome::success : Outcome::known_failure, way.success ? -1 : 0, way.end, phases);
    }
    const Stories stories = std::move(teller.take().front());
    tree = event_tree(stories, info);
    return bifurcation_causes(tree, stories, EventWords(info, Detail::features), values);
  }

  CampaignInfo info = two_bifurcations();
  ParticleValues values;
  EventTree tree;
};

// Claim: of two bifurcations, one below the other, the side of the first is decided by p3 alone, which is found with
// its direction; that of the second by chance, and no parameter explains it.
TEST(BifurcationCauses, TellWhatDecidesFromWhatChanceDecides) {
  Campaign campaign(400, 1);
  const auto got = campaign.explain([&](std::uint32_t i) {
    const bool strikes = campaign.p(3, i) > 0.6, slips = strikes && chance(i, 1, 1) < 0.5;
    const double rate = !strikes ? 0.95 : slips ? 0.05 : 0.6;
    return Way{strikes ? kCurb : kGround, slips ? kCurb : kGround, chance(i, 2, 1) < rate};
  });
  ASSERT_THAT(campaign.tree.nodes, SizeIs(2));
  ASSERT_EQ(campaign.tree.nodes[1].parent, 0);
  ASSERT_THAT(got[0], SizeIs(1)) << "of two branches one question";
  const Causes& first = got[0][0].causes;
  ASSERT_EQ(first.significant, 1u);
  EXPECT_EQ(first.effects[0].column, 3u);
  const EventBranch& asked = campaign.tree.nodes[0].branches[got[0][0].branch];
  EXPECT_EQ(first.effects[0].auc, part_b(asked.word) == kCurb ? 1 : 0);
  EXPECT_EQ(first.ones, asked.outcomes.n);
  EXPECT_THAT(first.target, HasSubstr("bifurcation at 0.500 s: the 1st contact of LF_FOOT: LF_FOOT-"));
  ASSERT_THAT(got[1], SizeIs(1));
  EXPECT_FALSE(got[1][0].causes.explained());
  const EventBranch& above =
      campaign.tree.nodes[0].branches[static_cast<std::size_t>(campaign.tree.nodes[1].parent_branch)];
  EXPECT_EQ(got[1][0].causes.rows, above.outcomes.n) << "only traces that come to the node count";
  EXPECT_EQ(verdict_text(got[1][0].causes, campaign.values.table), "no parameter explains it");
}

// Claim: of three branches each is asked about; that nothing touches is explained by the parameter that decides it.
TEST(BifurcationCauses, OfThreeBranchesAskAboutEach) {
  Campaign campaign(300, 2);
  const auto got = campaign.explain([&](std::uint32_t i) {
    const double x = campaign.p(7, i);
    return Way{kGround, x < 0.3 ? -1 : x < 0.6 ? kCurb : kGround, chance(i, 2, 2) < (x < 0.3 ? 0.1 : 0.8)};
  });
  ASSERT_THAT(campaign.tree.nodes, SizeIs(1));
  ASSERT_THAT(got[0], SizeIs(3));
  for (const BifurcationCauses& one : got[0]) {
    ASSERT_GE(one.causes.significant, 1u) << one.causes.target;
    EXPECT_EQ(one.causes.effects[0].column, 7u) << one.causes.target;
    EXPECT_EQ(one.causes.rows, 300u);
  }
}

// Claim: traces that a violation ended before they came to the contact do not count, and a particle without values
// neither.
TEST(BifurcationCauses, LeaveOutWhatWasCutOffAndWhatHasNoValues) {
  Campaign campaign(300, 3);
  const auto go = [&](std::uint32_t i) {
    if (i % 5 == 0) return Way{kGround, -1, false, 1.0};
    const bool strikes = campaign.p(0, i) > 0.5;
    return Way{kGround, strikes ? kCurb : kGround, strikes};
  };
  const auto got = campaign.explain(go);
  ASSERT_THAT(got, SizeIs(1));
  EXPECT_EQ(got[0][0].causes.rows, 240u);
  EXPECT_THAT(got[0], SizeIs(1)) << "cut is no branch to ask about";
  for (ParticleTable::Column& column : campaign.values.table.columns) column.values.resize(200);
  ParticleValues few = campaign.values;
  few.particles.resize(200);
  StoryTeller teller({"walk"}, {.detail = Detail::features}, 1e-3);
  for (std::uint32_t i = 0; i < 300; ++i) {
    const Way way = i < 200 ? go(i) : Way{};
    std::vector<ContactPhase> phases = {touch(kLeft, way.first, 0.5)};
    if (way.second >= 0) phases.push_back(touch(kRight, way.second, 1.5));
    teller.add(0, i, way.success ? Outcome::success : Outcome::known_failure, way.success ? -1 : 0, way.end, phases);
  }
  const Stories stories = std::move(teller.take().front());
  const EventTree tree = event_tree(stories, campaign.info);
  const auto some = bifurcation_causes(tree, stories, EventWords(campaign.info, Detail::features), few);
  ASSERT_THAT(some, SizeIs(1));
  EXPECT_EQ(some[0][0].causes.rows, 160u);
}

// Claim: where chance decides every bifurcation, any parameter is called significant for any branch of any node in at
// most 5 % of campaigns, a tree better than chance in at most 1 %: 250 campaigns with two or three nodes of two and
// three branches, within 3 standard errors of the bound.
TEST(BifurcationCauses, FalseAlarmsAreRareOverAllNodesTogether) {
  const int campaigns = test::trials(250);
  int found = 0, trees = 0;
  std::size_t nodes = 0, questions = 0;
  for (int c = 0; c < campaigns; ++c) {
    const auto number = static_cast<std::uint32_t>(100 + c);
    Campaign campaign(160, number);
    const auto got = campaign.explain([&](std::uint32_t i) {
      const double u = chance(i, 1, number), w = chance(i, 2, number);
      const bool strikes = u < 0.5;
      const int second = w < 0.3 ? -1 : w < 0.6 ? kCurb : kGround;
      const double rate = strikes ? (w < 0.3 ? 0.05 : 0.45) : (w < 0.3 ? 0.5 : 0.97);
      return Way{strikes ? kCurb : kGround, second, chance(i, 3, number) < rate};
    });
    nodes += got.size();
    bool any = false, any_tree = false;
    for (const auto& of_node : got) {
      questions += of_node.size();
      for (const BifurcationCauses& one : of_node) {
        any |= one.causes.significant > 0;
        any_tree |= one.causes.tree_tells;
      }
    }
    found += any;
    trees += any_tree;
  }
  EXPECT_GT(nodes, static_cast<std::size_t>(campaigns) * 3 / 2) << "there is more than one node to correct for";
  EXPECT_GT(questions, nodes);
  const auto most = [&](double rate) { return campaigns * rate + 3 * std::sqrt(campaigns * rate * (1 - rate)); };
  EXPECT_LE(found, most(0.05));
  EXPECT_LE(trees, most(0.01));
}

void write_campaign(const std::filesystem::path& path, bool store_values, bool noise) {
  CampaignInfo info = two_bifurcations();
  info.particles = 200;
  info.store_values = store_values;
  CampaignWriter writer(path, info, false);
  std::vector<TraceRecord> records;
  std::vector<double> all;
  for (std::uint32_t i = 0; i < 200; ++i) {
    const std::vector<double> row = synthetic::values(info, i);
    const bool strikes = (noise ? chance(i, 1, 0) : row[0]) > 0.5;
    TraceRecord record = synthetic::trace(info, 0, i);
    record.events.clear();
    record.phases = {touch(kLeft, kGround, 0.5), touch(kRight, strikes ? kCurb : kGround, 1.5)};
    record.outcome = chance(i, 2, 0) < (strikes ? 0.1 : 0.9) ? Outcome::success : Outcome::unknown_failure;
    record.violated = -1;
    record.invalid_reason.clear();
    record.end_time = 3;
    record.margin_parts.assign(info.requirements.size(), kNoPart);
    record.violation_parts.assign(info.requirements.size(), kNoPart);
    record.objective_culprit = {};
    records.push_back(std::move(record));
    if (store_values) all.insert(all.end(), row.begin(), row.end());
  }
  writer.append(0, std::move(records), std::move(all));
  writer.finish();
}

// Claim: through an archive text, JSON and CSV of `graze events` name the parameter, and `graze explain` asks the same
// question with the same answer to the bit.
TEST(BifurcationCauses, OfAnArchiveStandInEventsAndInExplain) {
  const synthetic::Folder folder;
  write_campaign(folder / "a.graze", true, false);
  const Archive archive(folder / "a.graze");
  const CampaignEvents events = campaign_events(archive, {});
  ASSERT_THAT(events.policies[0].causes, SizeIs(1));
  const Causes& causes = events.policies[0].causes[0][0].causes;
  EXPECT_THAT(format_events(events, 5), HasSubstr("more often where robot.link.LF_SHIN.length is "));
  const auto json = nlohmann::json::parse(events_json(events));
  const auto& node = json["policies"][0]["bifurcations"][0];
  EXPECT_EQ(node["causes"][0]["effects"][0]["parameter"], "robot.link.LF_SHIN.length");
  EXPECT_EQ(node["causes"][0]["effects"][0]["p_holm"], causes.effects[0].p_holm);
  EXPECT_EQ(node["branches"][node["causes"][0]["branch"].get<std::size_t>()]["outcomes"]["n"], causes.ones);
  EXPECT_TRUE(json["no_causes"].is_null());
  EXPECT_THAT(branches_csv(events), HasSubstr("more often where robot.link.LF_SHIN.length is "));
  EXPECT_THAT(causes_csv(events), HasSubstr(",robot.link.LF_SHIN.length,rank-sum,"));

  const Explanation explanation = explain(archive);
  ASSERT_EQ(explanation.policies[0].bifurcations, 1u);
  const Causes& same = explanation.policies[0].causes.back();
  EXPECT_EQ(same.target, causes.target);
  ASSERT_EQ(same.effects.size(), causes.effects.size());
  for (std::size_t i = 0; i < same.effects.size(); ++i) EXPECT_EQ(same.effects[i].p_holm, causes.effects[i].p_holm);
  EXPECT_THAT(explanation_json(explanation), HasSubstr("\"bifurcation_causes\": 1"));
  EXPECT_THAT(format_explanation(explanation), HasSubstr("bifurcation at 1.500 s"));
}

// Claim: where chance decides all outputs say so; without stored values they say that there is nothing to ask.
TEST(BifurcationCauses, OfAnArchiveSayWhereThereAreNone) {
  const synthetic::Folder folder;
  write_campaign(folder / "noise.graze", true, true);
  const CampaignEvents noise = campaign_events(Archive(folder / "noise.graze"), {});
  ASSERT_THAT(noise.policies[0].causes, SizeIs(1));
  EXPECT_THAT(format_events(noise, 5), HasSubstr("no parameter explains it: RF_FOOT-"));
  EXPECT_THAT(branches_csv(noise), HasSubstr("no parameter explains it\n"));
  EXPECT_THAT(events_json(noise), HasSubstr("\"verdict\": \"no parameter explains it\""));
  write_campaign(folder / "none.graze", false, false);
  const CampaignEvents none = campaign_events(Archive(folder / "none.graze"), {});
  ASSERT_THAT(none.policies[0].tree.nodes, SizeIs(1));
  EXPECT_THAT(none.policies[0].causes, IsEmpty());
  EXPECT_THAT(format_events(none, 5), HasSubstr("no causes: the archive does not keep the particles' values"));
  EXPECT_THAT(branches_csv(none), HasSubstr("no causes: the archive does not keep"));
}

}  // namespace
}  // namespace graze
