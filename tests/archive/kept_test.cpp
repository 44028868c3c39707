// What margins and culprits say: whether a measure was kept, and who is to blame.
#include "archive/schema/kept.h"

#include <gmock/gmock.h>

#include <map>

#include "archive/outcomes.h"
#include "archive/schema/culprit.h"
#include "sampling/constants.h"
#include "tests/archive/compare.h"

namespace graze {
namespace {

using namespace synthetic;

// Claim: only a violation cuts a trace short, and only one before the last step, whatever the last bits of its time.
TEST(Kept, OnlyAViolationCutsShort) {
  const CampaignInfo facts = info();  // 1500 steps
  EXPECT_TRUE(cut_short(Outcome::known_failure, 1.499, facts));
  EXPECT_TRUE(cut_short(Outcome::known_failure, kNaN, facts));
  EXPECT_FALSE(cut_short(Outcome::known_failure, 1.5, facts));
  EXPECT_FALSE(cut_short(Outcome::known_failure, std::nextafter(1.5, 0), facts));
  for (const Outcome other : {Outcome::success, Outcome::unknown_failure, Outcome::invalid}) {
    EXPECT_FALSE(cut_short(other, 1.0, facts));
  }
}

// Claim: a measure is kept if its margin was never below 0 throughout its window; a cut before the window's last step
// leaves that open, and so does a window without a step.
TEST(Kept, IsDecidedByTheWholeWindow) {
  const CampaignInfo facts = info();
  CampaignInfo::RequirementRow measure{"m", "", "m", true, "", {0.2, 0.6}};
  const auto kept = [&](double margin, Outcome outcome, double end) {
    return std::string(kept_name(kept_by(measure, margin, outcome, end, facts)));
  };
  EXPECT_EQ(kept(0, Outcome::success, 1.5), "yes");
  EXPECT_EQ(kept(-1e-300, Outcome::success, 1.5), "no");
  EXPECT_EQ(kept(kNaN, Outcome::success, 1.5), "no");
  EXPECT_EQ(kept(-1, Outcome::known_failure, 0.3), "no");
  EXPECT_EQ(kept(1, Outcome::unknown_failure, 0.3), "yes");
  EXPECT_EQ(kept(1, Outcome::known_failure, 0.1), "undecided");
  EXPECT_EQ(kept(1, Outcome::known_failure, 0.598), "undecided");
  EXPECT_EQ(kept(1, Outcome::known_failure, 0.599), "undecided") << "the step at 0.6 s was still to come";
  EXPECT_EQ(kept(1, Outcome::known_failure, 0.6), "yes");
  measure.window = {0.2002, 0.2008};
  EXPECT_EQ(kept(1, Outcome::success, 1.5), "undecided");
  measure.window = {};
  EXPECT_EQ(kept(1, Outcome::known_failure, 1.499), "undecided");
  EXPECT_EQ(kept(1, Outcome::known_failure, 1.5), "yes");
}

// Claim: a part is told by the names of what it is a number of; what the campaign does not have has no name.
TEST(CulpritText, TellsPartsByName) {
  CampaignInfo facts = info();
  facts.actuator_names = {"LF_X_1", "LF_Y_3"};
  for (const PartKind kind : {PartKind::link, PartKind::joint, PartKind::pair, PartKind::none}) {
    const std::uint64_t counts[] = {0, 3, 2, 9};
    EXPECT_EQ(part_count(part_kind_name(kind), facts), counts[static_cast<int>(kind)]);
  }
  EXPECT_EQ(part_name("links", 2, facts), "LF_FOOT");
  EXPECT_EQ(part_name("links", 3, facts), "");
  EXPECT_EQ(part_name("joints", 1, facts), "LF_Y_3");
  EXPECT_EQ(part_name("joints", 2, facts), "");
  EXPECT_EQ(part_name("pairs", 5, facts), "curb and ground");
  EXPECT_EQ(part_name("pairs", 8, facts), "ground and ground");
  EXPECT_EQ(part_name("pairs", 9, facts), "");
  EXPECT_EQ(part_name("", 0, facts), "");
  EXPECT_EQ(part_name("links", kNoPart, facts), "");
}

TEST(CulpritText, TellsWhoViolatedOrWhatTheObjectiveLacked) {
  CampaignInfo facts = info();
  EXPECT_EQ(culprit_text(1, {-1, 1}, facts), "LF_FOOT and curb");
  EXPECT_EQ(culprit_text(0, {-1, 1}, facts), "");
  EXPECT_EQ(culprit_text(2, {-1, 1}, facts), "") << "there are two requirements";
  EXPECT_EQ(culprit_text(-1, {0, kNoPart}, facts), "height of BODY0");
  EXPECT_EQ(culprit_text(-1, {1, 2}, facts), "place of the feet: LF_FOOT");
  EXPECT_EQ(culprit_text(-1, {2, 0}, facts), "");
  EXPECT_EQ(culprit_text(-1, {-1, 0}, facts), "");
  facts.leaves.erase(facts.leaves.begin());
  EXPECT_EQ(culprit_text(-1, {0, 2}, facts), "LF_FOOT");
  EXPECT_EQ(culprit_text(-1, {0, kNoPart}, facts), "place of the feet") << "what is missed, where nobody is to blame";
}

/// Two requirements and two measures, the second with a window.
CampaignInfo measured() {
  CampaignInfo facts = info();
  facts.scenario_text = "graze: 1";
  facts.requirements.push_back({"smooth", "", "m", true});
  facts.requirements.push_back({"slow", "", "m", true, "", {0.5, 0.7}});
  return facts;
}

// Claim: what scores ask of an archive is what was written: the cut, each measure in a bit of its own, the culprit.
TEST(Outcomes, JudgeEachMeasure) {
  const Folder folder;
  const CampaignInfo facts = measured();
  const std::vector<std::pair<Outcome, double>> fates = {
      {Outcome::success, 1.5}, {Outcome::known_failure, 0.6}, {Outcome::known_failure, 0.9}};
  std::map<std::uint32_t, TraceRecord> want;
  for (std::uint32_t id = 0; id < 12; ++id) {
    TraceRecord one = trace(facts, 0, id);
    std::tie(one.outcome, one.end_time) = fates[id % 3];
    one.violated = one.outcome == Outcome::known_failure ? 1 : -1;
    one.violation_parts = {kNoPart, 2, kNoPart, kNoPart};
    one.objective_culprit = {1, 2};
    one.invalid_reason.clear();
    one.margins = {1, -1, id / 3 % 2 == 0 ? 1.0 : -1.0, id / 6 == 0 ? 1.0 : -1.0};
    want[id] = one;
  }
  {
    CampaignWriter writer(folder / "a.graze", facts, false);
    std::vector<TraceRecord> traces;
    for (const auto& [id, one] : want) traces.push_back(one);
    writer.append(0, std::move(traces), std::vector<double>(12 * facts.parameters.size()));
    writer.finish();
  }
  const Archive archive(folder / "a.graze");
  EXPECT_EQ(count_traces(archive, "step/1cm"), 12u);
  EXPECT_EQ(count_traces(archive, "hold"), 0u);
  std::size_t seen = 0;
  visit_outcomes(archive, "step/1cm", [&](std::span<const TraceOutcome> some) {
    for (const TraceOutcome& got : some) {
      SCOPED_TRACE(got.particle);
      const bool cut = got.particle % 3 != 0, smooth = got.particle / 3 % 2 == 0, slow = got.particle / 6 == 0;
      const bool before = got.particle % 3 == 1;  // the second window's end
      EXPECT_EQ(got.outcome, want[got.particle].outcome);
      EXPECT_EQ(got.cut, cut);
      EXPECT_EQ(got.kept, (smooth && !cut ? 1u : 0u) | (slow && !before ? 2u : 0u));
      EXPECT_EQ(got.undecided, (smooth && cut ? 1u : 0u) | (slow && before ? 2u : 0u));
      EXPECT_EQ(got.culprit.part, 2);
      EXPECT_EQ(got.culprit.leaf, cut ? -1 : 1);
      ++seen;
    }
  });
  EXPECT_EQ(seen, 12u);
}

}  // namespace
}  // namespace graze
