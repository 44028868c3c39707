// Event trees, sequences and novelties of campaigns with a planted truth: what is there is found where it is, and
// nothing where nothing is.
#include "analysis/events.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "tests/analysis/planted_archive.h"
#include "tests/message_of.h"

namespace graze {
namespace {

using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

enum Part { LF, RF, LH, RH, body, ground, curb };
constexpr double kEnd = 3, kStep = 1e-3;

CampaignInfo planted_info() {
  CampaignInfo info = synthetic::info();
  info.colliders = {"LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT", "BODY", "ground", "curb"};
  info.links = {"LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT", "BODY"};
  info.policies = {"walk"};
  info.end = kEnd;
  info.step = kStep;
  return info;
}

ContactPhase phase(int a, int b, double begin, double duration = 0.1, double impulse = 1,
                   Feature of_b = Feature::surface) {
  ContactPhase out;
  out.a = a;
  out.b = b;
  out.begin = begin;
  out.end = begin + duration;
  out.impulse = impulse;
  out.feature_b = of_b;
  return out;
}

struct Trace {
  Outcome outcome = Outcome::success;
  int violated = -1;
  double end = kEnd;
  std::vector<ContactPhase> phases;
};

void sort(std::vector<ContactPhase>& phases) {
  std::sort(phases.begin(), phases.end(), [](const auto& x, const auto& y) { return x.begin < y.begin; });
}

/// Eight steps of a walk with jitter, brushes that carry little, and a third foot that comes down once more or not.
Trace walk(std::mt19937_64& random) {
  std::normal_distribution<double> jitter(0, 0.004);
  std::uniform_real_distribution<double> uniform(0, 1);
  Trace out;
  for (int step = 0; step < 8; ++step) {
    const int feet[] = {LF, RH, RF, LH};
    for (int k = 0; k < 4; ++k) {
      const double time = 0.3 * step + 0.075 * k + 0.02 + jitter(random);
      out.phases.push_back(phase(feet[k], ground, time, 0.1, 0.9 + 0.2 * uniform(random)));
      if (uniform(random) < 0.3) out.phases.push_back(phase(feet[k], ground, time + 0.15, 0.01, 0.02));
    }
  }
  if (uniform(random) < 0.4) out.phases.push_back(phase(LH, ground, 2.61, 0.1, 0.8));
  sort(out.phases);
  return out;
}

/// RF's contacts from its `k`th on are with the curb for once, then as before.
void strike(Trace& trace, int k) {
  int seen = 0;
  for (ContactPhase& phase : trace.phases) {
    if (phase.a == RF && phase.impulse > 0.5 && seen++ == k) phase.b = curb;
  }
}

Stories tell(const std::vector<Trace>& traces, const StoryRules& rules = {}) {
  StoryTeller teller({"walk"}, rules, kStep);
  std::uint32_t particle = 0;
  for (const Trace& trace : traces) {
    teller.add(0, particle++, trace.outcome, trace.violated, trace.end, trace.phases);
  }
  return std::move(teller.take().front());
}

EventTree grow(const Stories& stories, const EventTreeRules& rules = {}) {
  return event_tree(stories, {LF, RF, LH, RH, body}, 2, kEnd, rules);
}

std::uint32_t word(int a, int b) { return static_cast<std::uint32_t>(a) << 20 | static_cast<std::uint32_t>(b) << 8; }

// Claim: where traces part into those that touch nothing more and rare contacts of all kinds, the node has the time of
// these, though some of them touch nothing either.
TEST(EventTree, OfRareContactsAlone) {
  std::vector<Trace> traces(40);
  for (std::size_t i = 0; i < 12; ++i) {
    traces[i].outcome = Outcome::unknown_failure;
    const int struck[] = {RF, LH, RH, body};
    traces[i].phases.push_back(phase(LF, struck[i % 4], 1.0 + 0.01 * static_cast<double>(i)));
  }
  for (std::size_t i = 12; i < 16; ++i) {  // a thread of its own ends in nothing more, four times
    traces[i].outcome = Outcome::unknown_failure;
    traces[i].phases = {phase(LF, RF, 1.05), phase(LF, LH, 1.3)};
  }
  const EventTree tree = event_tree(tell(traces), {LF}, 2, kEnd);
  ASSERT_FALSE(tree.nodes.empty());
  for (const EventNode& node : tree.nodes) EXPECT_TRUE(std::isfinite(node.time)) << node.time;
  EXPECT_NEAR(tree.nodes[0].time, 1.06, 0.06);
}

// Claim: a contact that half of the traces have, and that decides most of their ends, is found at its node and time.
TEST(EventTree, FindsAPlantedBifurcation) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Trace> traces;
  std::uint64_t strikes = 0, saved = 0;
  for (int i = 0; i < 400; ++i) {
    Trace trace = walk(random);
    const bool strikes_now = uniform(random) < 0.5;
    if (strikes_now) strike(trace, 3);
    trace.outcome = uniform(random) < (strikes_now ? 0.2 : 0.9) ? Outcome::success : Outcome::unknown_failure;
    strikes += strikes_now;
    saved += strikes_now && trace.outcome == Outcome::success;
    traces.push_back(std::move(trace));
  }
  const EventTree tree = grow(tell(traces));
  ASSERT_THAT(tree.nodes, SizeIs(1));
  const EventNode& node = tree.nodes[0];
  EXPECT_EQ(node.part, RF);
  EXPECT_THAT(node.past, ElementsAre(word(RF, ground), word(RF, ground), word(RF, ground)));
  EXPECT_NEAR(node.time, 0.3 * 3 + 0.15 + 0.02, 0.002);
  EXPECT_LT(node.p_value, 1e-20);
  ASSERT_THAT(node.branches, SizeIs(2));
  for (const EventBranch& branch : node.branches) {
    ASSERT_EQ(branch.kind, EventBranch::Kind::contact);
    if (branch.word != word(RF, curb)) continue;
    EXPECT_EQ(branch.outcomes.n, strikes);
    EXPECT_EQ(branch.outcomes.success, saved);
    EXPECT_EQ(branch.outcomes.unknown, strikes - saved);
    EXPECT_NEAR(branch.impulse.median, 1.0, 0.03);
  }
}

// Claim: what follows from a bifurcation tells more about the outcome than it does, and is not taken for it.
TEST(EventTree, TakesTheCauseAndNotItsConsequence) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Trace> traces;
  for (int i = 0; i < 300; ++i) {
    Trace trace = walk(random);
    const bool strikes_now = i % 2 == 0;
    if (strikes_now) strike(trace, 2);
    const bool falls = strikes_now ? uniform(random) < 0.85 : uniform(random) < 0.05;
    if (falls) {
      trace.phases.push_back(phase(body, ground, 2.8));
      trace.outcome = Outcome::unknown_failure;
    }
    traces.push_back(std::move(trace));
  }
  const EventTree tree = grow(tell(traces));
  ASSERT_FALSE(tree.nodes.empty());
  EXPECT_EQ(tree.nodes[0].part, RF);
  EXPECT_THAT(tree.nodes[0].past, SizeIs(2));
  ASSERT_GE(tree.nodes.size(), 2u);
  EXPECT_EQ(tree.nodes[1].part, body) << "within the branches the fall tells the rest";
  EXPECT_EQ(tree.nodes[1].parent, 0);
}

// Claim: two planted bifurcations, one below the other, are found as such.
TEST(EventTree, FindsOneBifurcationBelowAnother) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Trace> traces;
  for (int i = 0; i < 600; ++i) {
    Trace trace = walk(random);
    const bool first = uniform(random) < 0.5, second = uniform(random) < 0.5;
    if (first) strike(trace, 1);
    if (second) {
      trace.phases.push_back(phase(LF, curb, 2.55));
      sort(trace.phases);
    }
    const double chance = first ? (second ? 0.9 : 0.1) : 0.95;
    trace.outcome = uniform(random) < chance ? Outcome::success : Outcome::unknown_failure;
    traces.push_back(std::move(trace));
  }
  const EventTree tree = grow(tell(traces));
  ASSERT_THAT(tree.nodes, SizeIs(2));
  EXPECT_EQ(tree.nodes[0].part, RF);
  EXPECT_EQ(tree.nodes[1].part, LF);
  EXPECT_EQ(tree.nodes[1].parent, 0);
  const EventBranch& above = tree.nodes[0].branches[static_cast<std::size_t>(tree.nodes[1].parent_branch)];
  EXPECT_EQ(above.word, word(RF, curb));
  EXPECT_EQ(above.node, 1);
}

// Claim: where outcomes hang on nothing, a bifurcation is told in at most so many campaigns as the error rate says. Of
// 400 campaigns at 5 %, more than 35 would be told with a probability of 0.1 % if the rate were exactly 5 %.
TEST(EventTree, FindsNothingWhereNothingIs) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform(0, 1);
  int told = 0;
  for (int campaign = 0; campaign < 400; ++campaign) {
    std::vector<Trace> traces;
    for (int i = 0; i < 60; ++i) {
      Trace trace = walk(random);
      if (uniform(random) < 0.3) strike(trace, 2);
      if (uniform(random) < 0.3) trace.phases.push_back(phase(body, ground, 2.8));
      const double fate = uniform(random);
      trace.outcome = fate < 0.4 ? Outcome::success : fate < 0.8 ? Outcome::known_failure : Outcome::unknown_failure;
      if (trace.outcome == Outcome::known_failure) trace.violated = fate < 0.6;
      traces.push_back(std::move(trace));
    }
    EventTreeRules rules;
    rules.error_rate = 0.05;
    told += !grow(tell(traces), rules).nodes.empty();
  }
  EXPECT_LE(told, 35);
}

// Claim: that a failure ends its trace, so that no more contacts follow, is no bifurcation.
TEST(EventTree, DoesNotTakeTheEndOfAFailureForItsCause) {
  std::mt19937_64 random(5);
  std::vector<Trace> traces;
  for (int i = 0; i < 200; ++i) {
    Trace trace = walk(random);
    if (i % 3 == 0) {
      trace.outcome = Outcome::known_failure;
      trace.violated = 1;
      trace.end = 1.0;
      std::erase_if(trace.phases, [](const ContactPhase& p) { return p.begin > 1.0; });
    }
    traces.push_back(std::move(trace));
  }
  EXPECT_THAT(grow(tell(traces)).nodes, IsEmpty());
}

TEST(EventTree, TellsWhatIsMissing) {
  std::mt19937_64 random(6);
  std::vector<Trace> traces;
  for (int i = 0; i < 100; ++i) {
    Trace trace;
    trace.phases = {phase(LF, ground, 0.1), phase(RF, ground, 0.4)};
    if (i % 2 == 0) trace.phases.push_back(phase(LF, ground, 1.0));
    if (i % 2 == 1) trace.outcome = Outcome::unknown_failure;
    traces.push_back(std::move(trace));
  }
  const EventTree tree = grow(tell(traces));
  ASSERT_THAT(tree.nodes, SizeIs(1));
  EXPECT_EQ(tree.nodes[0].part, LF);
  EXPECT_NEAR(tree.nodes[0].time, 1.0, 1e-6);
  EXPECT_NEAR(tree.nodes[0].information, 1, 1e-12);
  EXPECT_EQ(tree.nodes[0].branches[1].kind == EventBranch::Kind::nothing ||
                tree.nodes[0].branches[0].kind == EventBranch::Kind::nothing,
            true);
}

TEST(Stories, LeaveOutWhatIsLightButNotWhatIsUnderWay) {
  std::vector<Trace> traces(10);
  for (Trace& trace : traces) trace.phases = {phase(LF, ground, 0.1), phase(LF, ground, 0.5, 0.1, 0.05)};
  traces[3].phases.push_back(phase(LF, ground, 0.8, 0.001, 0.01));
  traces[3].end = 0.801;
  const Stories stories = tell(traces);
  EXPECT_THAT(stories[0].tokens, SizeIs(1));
  ASSERT_THAT(stories[3].tokens, SizeIs(2));
  EXPECT_FLOAT_EQ(stories[3].tokens[1].impulse, 0.01f);
}

TEST(Stories, GiveNoOrderToWhatIsSimultaneous) {
  std::vector<Trace> traces(2);
  traces[0].phases = {phase(LF, ground, 0.100), phase(RH, ground, 0.110), phase(RF, ground, 0.2)};
  traces[1].phases = {phase(RH, ground, 0.100), phase(LF, ground, 0.115), phase(RF, ground, 0.2)};
  EXPECT_THAT(count_sequences(tell(traces), 2), SizeIs(1));
  StoryRules strict;
  strict.simultaneous = 0;
  EXPECT_THAT(count_sequences(tell(traces, strict), 2), SizeIs(2));
}

TEST(Sequences, AreCountedWithTheirOutcomes) {
  std::vector<Trace> traces(5);
  for (int i = 0; i < 5; ++i) traces[i].phases = {phase(LF, i < 3 ? ground : curb, 0.1)};
  traces[1].outcome = Outcome::known_failure;
  traces[1].violated = 1;
  traces[4].outcome = Outcome::invalid;
  const std::vector<SequenceCount> got = count_sequences(tell(traces), 2);
  ASSERT_THAT(got, SizeIs(2));
  EXPECT_THAT(got[0].words, ElementsAre(word(LF, ground)));
  EXPECT_EQ(got[0].outcomes.n, 3u);
  EXPECT_EQ(got[0].outcomes.success, 2u);
  EXPECT_THAT(got[0].outcomes.violated, ElementsAre(0, 1));
  EXPECT_EQ(got[1].outcomes.n, 1u) << "invalid traces do not count";
  EXPECT_EQ(got[1].example, 3u);
}

// Claim: a gait's cycles are cut where no foot comes down, so that jitter moves no contact into the next one.
TEST(Sequences, OfCyclesShareOneInNineOfTenTraces) {
  std::mt19937_64 random(7);
  std::vector<Trace> traces;
  for (int i = 0; i < 100; ++i) {
    Trace trace = walk(random);
    for (ContactPhase& one : trace.phases) one.begin = std::max(0.0, one.begin - 0.02);  // cycles begin with LF
    traces.push_back(std::move(trace));
  }
  const std::vector<CycleCount> cycles = count_cycles(tell(traces), 0.3, 2.4);
  ASSERT_GE(cycles.size(), 6u);
  for (const CycleCount& one : cycles) {
    EXPECT_EQ(one.n, 100u);
    EXPECT_GE(one.alike, 90u) << one.from;
    EXPECT_THAT(one.words, SizeIs(4)) << one.from;
  }
}

TEST(Novelties, AreOfFourKinds) {
  StoryRules fine;
  fine.detail = Detail::features;
  std::vector<Trace> traces(10);
  for (int i = 0; i < 10; ++i) {
    Trace& trace = traces[i];
    trace.phases = {phase(LF, ground, 0.1), phase(RF, curb, 0.5, 0.1, 1, Feature::top)};
    if (i >= 6) trace.outcome = Outcome::unknown_failure;
    if (i == 3 || i == 4 || i == 6 || i == 7) trace.phases.push_back(phase(LH, ground, 0.7));
  }
  traces[8].phases.push_back(phase(body, ground, 0.9));
  traces[9].phases[1].feature_b = Feature::side;
  const Stories stories = tell(traces, fine);
  IsReference succeeded;
  for (std::size_t i = 0; i < stories.size(); ++i) succeeded.push_back(stories[i].outcome == Outcome::success);
  const std::vector<Novelty> got = novelties(stories, 2, succeeded);
  ASSERT_THAT(got, SizeIs(4));
  EXPECT_EQ(got[0].kind, Novelty::Kind::event);
  EXPECT_EQ(got[0].word, word(body, ground));
  EXPECT_EQ(got[0].example, 8u);
  EXPECT_EQ(got[1].kind, Novelty::Kind::sequence);
  EXPECT_EQ(got[1].outcomes.n, 2u) << "8 and 9; 6 and 7 did what 3 and 4 did";
  EXPECT_EQ(got[2].kind, Novelty::Kind::feature);
  EXPECT_EQ(got[2].example, 9u);
  EXPECT_EQ(got[3].kind, Novelty::Kind::outcomes);
  EXPECT_EQ(got[3].word, word(LH, ground));
  EXPECT_EQ(got[3].outcomes.success, 2u);
  const std::vector<Novelty> none = novelties(stories, 2, succeeded, &stories);
  ASSERT_THAT(none, SizeIs(1)) << "nothing is new against itself";
}

// Claim: a new sequence is met first where its first contact within the window is; one without contacts has no time.
TEST(Novelties, OfAWindowAreFirstMetInIt) {
  StoryRules late;
  late.from = 0.3;
  std::vector<Trace> traces(12);
  for (int i = 0; i < 12; ++i) {
    traces[i].phases = {phase(LF, ground, 0.1), phase(RF, ground, 0.4)};
    if (i >= 6) traces[i].outcome = Outcome::unknown_failure, traces[i].phases.pop_back();
    if (i >= 9) traces[i].phases.push_back(phase(LH, ground, 0.7));
  }
  const auto first_of = [&](int begin, int end) {
    std::vector<Trace> some(traces.begin(), traces.begin() + 6);
    some.insert(some.end(), traces.begin() + begin, traces.begin() + end);
    const Stories stories = tell(some, late);
    IsReference succeeded(stories.size());
    for (std::size_t i = 0; i < stories.size(); ++i) succeeded[i] = stories[i].outcome == Outcome::success;
    for (const Novelty& one : novelties(stories, 2, succeeded)) {
      if (one.kind == Novelty::Kind::sequence) return one.first;
    }
    return -1.0;
  };
  EXPECT_TRUE(std::isnan(first_of(6, 9))) << "after 0.3 s they touch nothing";
  EXPECT_FLOAT_EQ(first_of(9, 12), 0.7F);
  EXPECT_FLOAT_EQ(first_of(6, 12), 0.7F) << "those without a contact have no time, the others do";
}

// Claim: through an archive, the verb's data are those of the traces; text and JSON name what was planted.
TEST(Events, OfAnArchiveNameTheBifurcation) {
  const synthetic::Folder folder;
  CampaignInfo info = planted_info();
  info.particles = 200;
  std::mt19937_64 random(8);
  planted::write(folder / "a.graze", info, [&](std::uint32_t i) {
    Trace trace = walk(random);
    if (i % 2 == 0) strike(trace, 3);
    if (i < 16 && i % 2 == 0) strike(trace, 0);  // so that they do not come to the node
    const Outcome outcome = i % 2 == 0 ? Outcome::unknown_failure : Outcome::success;
    TraceRecord record = planted::plain_trace(info, 0, i, outcome);
    record.phases = trace.phases;
    record.end_time = kEnd;
    return record;
  });
  const Archive archive(folder / "a.graze");
  EventsRequest request;
  request.cycle = 0.3;
  const CampaignEvents events = campaign_events(archive, request);
  ASSERT_THAT(events.policies, SizeIs(1));
  ASSERT_THAT(events.policies[0].tree.nodes, SizeIs(1));
  const std::string text = format_events(events, 5);
  EXPECT_THAT(text, HasSubstr("s: the 4th contact of RF_FOOT (p = "));
  EXPECT_THAT(text, HasSubstr("RF_FOOT-curb"));
  EXPECT_THAT(text, ContainsRegex("\\(another way before\\) +8 "));
  EXPECT_THAT(text, HasSubstr("new contact"));
  const std::string json = events_json(events);
  EXPECT_THAT(json, HasSubstr("\"label\": \"RF_FOOT-curb\""));
  EXPECT_THAT(sequences_csv(events), HasSubstr("policy,traces,success,unknown,rate,low,high,example,sequence\nwalk,"));
  EXPECT_EQ(moving_parts(info), (std::vector<int>{LF, RF, LH, RH, body}));
}

TEST(Events, NeedContactPhases) {
  const synthetic::Folder folder;
  CampaignInfo info = planted_info();
  info.particles = 1;
  planted::write(folder / "a.graze", info, [&](std::uint32_t i) { return planted::plain_trace(info, 0, i); });
  const Archive archive(folder / "a.graze");
  EXPECT_THAT(testing::message_of([&] { campaign_events(archive, {}); }), HasSubstr("no contact phases"));
}

}  // namespace
}  // namespace graze
