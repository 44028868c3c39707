// Stories, sequences, cycles and novelties against plain counting over random contacts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "analysis/sequences.h"
#include "analysis/stories.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

struct Told {
  Outcome outcome = Outcome::success;
  int violated = -1;
  double end = 3;
  std::vector<ContactPhase> phases = {};
};

ContactPhase touch_event(int a, int b, double begin, double impulse = 1, double duration = 0.05) {
  ContactPhase out;
  out.a = a;
  out.b = b;
  out.begin = begin;
  out.end = begin + duration;
  out.impulse = impulse;
  return out;
}

constexpr std::uint32_t pair_word(std::uint32_t a, std::uint32_t b) { return a << 20 | b << 8; }

Stories stories_of(const std::vector<Told>& traces, const StoryRules& rules = {}, double step = 1e-3) {
  StoryTeller teller({"walk"}, rules, step);
  for (std::uint32_t i = 0; i < traces.size(); ++i) {
    teller.add(0, i, traces[i].outcome, traces[i].violated, traces[i].end, traces[i].phases);
  }
  return std::move(teller.take().at(0));
}

std::vector<std::uint32_t> told_words(const Story& story) {
  std::vector<std::uint32_t> out;
  for (const Token& token : story.tokens) out.push_back(token.word);
  return out;
}

/// Traces of a few contacts each, of four parts and a ground, well apart.
std::vector<Told> random_traces(std::mt19937_64& random, std::size_t n) {
  std::vector<Told> out(n);
  for (Told& trace : out) {
    const unsigned fate = static_cast<unsigned>(random() % 10);
    trace.outcome = fate < 5   ? Outcome::success
                    : fate < 7 ? Outcome::known_failure
                    : fate < 9 ? Outcome::unknown_failure
                               : Outcome::invalid;
    if (trace.outcome == Outcome::known_failure) trace.violated = static_cast<int>(random() % 3);
    const std::size_t contacts = random() % 5;
    for (std::size_t k = 0; k < contacts; ++k) {
      const int a = static_cast<int>(random() % 3), b = 3 + static_cast<int>(random() % 2);
      ContactPhase phase =
          touch_event(a, b, 0.1 + 0.2 * static_cast<double>(k) + 0.05 * static_cast<double>(random() % 2));
      phase.feature_b = random() % 4 == 0 ? Feature::side : Feature::top;
      trace.phases.push_back(phase);
    }
  }
  return out;
}

// Claim: a story has the trace's particle, end and contacts; invalid traces have none; what comes in any order stands
// by particle.
TEST(StoriesByHand, AreThoseOfTheTraces) {
  StoryTeller teller({"a", "b"}, {}, 1e-3);
  const std::vector<ContactPhase> one = {touch_event(0, 3, 0.2)},
                                  two = {touch_event(1, 3, 0.3), touch_event(2, 3, 0.6)};
  teller.add(1, 9, Outcome::known_failure, 2, 0.9, two);
  teller.add(1, 4, Outcome::success, -1, 3, one);
  teller.add(1, 5, Outcome::invalid, -1, 3, one);
  const std::vector<Stories> got = teller.take();
  ASSERT_THAT(got, SizeIs(2));
  EXPECT_EQ(got[0].size(), 0u);
  EXPECT_EQ(got[0].policy(), "a");
  EXPECT_EQ(got[1].policy(), "b");
  ASSERT_EQ(got[1].size(), 2u);
  EXPECT_EQ(got[1][0].particle, 4u);
  EXPECT_EQ(got[1][1].particle, 9u);
  EXPECT_EQ(got[1][1].violated, 2);
  EXPECT_EQ(got[1][1].end_time, 0.9);
  EXPECT_EQ(got[1][1].outcome, Outcome::known_failure);
  EXPECT_THAT(told_words(got[1][0]), ElementsAre(pair_word(0, 3)));
  EXPECT_THAT(told_words(got[1][1]), ElementsAre(pair_word(1, 3), pair_word(2, 3)));
}

// Claim: a window takes contacts that begin in it, its first moment included and its last not.
TEST(StoriesByHand, OfAWindow) {
  StoryRules rules;
  rules.from = 0.5;
  rules.to = 1.5;
  const Stories got = stories_of(
      {{.phases = {touch_event(0, 3, 0.25), touch_event(0, 3, 0.5), touch_event(1, 3, 1.25), touch_event(2, 3, 1.5)}}},
      rules);
  EXPECT_THAT(told_words(got[0]), ElementsAre(pair_word(0, 3), pair_word(1, 3)));
}

// Claim: the mode in a word is the one with the largest share, sticking where shares are equal; features stand in their
// own bits; coarser details have none of it.
TEST(StoriesByHand, DetailsAreThoseOfThePhase) {
  ContactPhase phase = touch_event(2, 4, 0.1);
  phase.feature_a = Feature::cap;
  phase.feature_b = Feature::rim;
  const auto word = [&](Detail detail, double slip, double roll) {
    phase.slip = slip;
    phase.roll = roll;
    StoryRules rules;
    rules.detail = detail;
    return stories_of({{.phases = {phase}}}, rules)[0].tokens[0].word;
  };
  const std::uint32_t parts = pair_word(2, 4);
  const std::uint32_t features =
      parts | static_cast<std::uint32_t>(Feature::cap) << 5 | static_cast<std::uint32_t>(Feature::rim) << 2;
  EXPECT_EQ(word(Detail::parts, 0.9, 0), parts);
  EXPECT_EQ(word(Detail::features, 0.9, 0), features);
  EXPECT_EQ(word(Detail::modes, 0.9, 0), features | 1u);
  EXPECT_EQ(word(Detail::modes, 0.1, 0.8), features | 2u);
  EXPECT_EQ(word(Detail::modes, 0.2, 0.2), features);
  EXPECT_EQ(word(Detail::modes, 0.5, 0), features) << "half sticks, half slips";
  EXPECT_EQ(word(Detail::modes, 0, 0.5), features);
  EXPECT_EQ(word(Detail::modes, 0.45, 0.3), features | 1u);
}

// Claim: what is light is a share of the ninth decile of the pair's own contacts, counted here by sorting; a contact at
// that share stays; a pair is not measured by another pair's impulses.
TEST(StoriesByHand, LightContactsAreLeftOut) {
  std::mt19937_64 random(151);
  std::vector<Told> traces(40);
  std::vector<float> impulses;
  for (Told& trace : traces) {
    const double impulse = 0.05 * static_cast<double>(1 + random() % 60);
    impulses.push_back(static_cast<float>(impulse));
    trace.phases = {touch_event(0, 3, 0.2, impulse),
                    touch_event(1, 3, 0.6, 1e-6)};  // the other pair is faint throughout
  }
  std::sort(impulses.begin(), impulses.end());
  const float ninth = impulses[static_cast<std::size_t>(0.9 * 39)];
  StoryRules rules;
  rules.light = 0.4;
  std::size_t kept = 0, wanted = 0;
  const Stories got = stories_of(traces, rules);
  for (std::size_t i = 0; i < got.size(); ++i) {
    for (const Token& token : got[i].tokens) kept += part_a(token.word) == 0;
    EXPECT_EQ(part_a(got[i].tokens.back().word), 1) << "faint, as usual for that pair";
  }
  for (const float impulse : impulses) wanted += impulse >= 0.4f * ninth;
  EXPECT_EQ(kept, wanted);
  EXPECT_LT(wanted, 40u);
  EXPECT_GT(wanted, 5u);
}

// Claim: what is usual may be given from elsewhere; then contacts here change nothing of it, and pairs that it does not
// know count whatever they carry. A contact that is under way within a step and a half of the end counts, too.
TEST(StoriesByHand, WhatIsUsualElsewhere) {
  StoryTeller teller({"walk"}, {}, 0.01, UsualImpulses{{{0, 3}, 10.0f}});
  const std::vector<ContactPhase> phases = {touch_event(0, 3, 0.2, 0.9), touch_event(0, 3, 0.4, 1.1),
                                            touch_event(1, 3, 0.6, 1e-9), touch_event(0, 3, 0.9, 0.5, 0.0899)};
  teller.add(0, 0, Outcome::success, -1, 1.0, phases);
  const std::vector<Stories> got = teller.take();
  ASSERT_THAT(told_words(got[0][0]), ElementsAre(pair_word(0, 3), pair_word(1, 3), pair_word(0, 3)));
  EXPECT_FLOAT_EQ(got[0][0].tokens[0].impulse, 1.1f);
  EXPECT_FLOAT_EQ(got[0][0].tokens[2].impulse, 0.5f) << "0.9899 s, of an end at 1 s less 0.015 s";
  EXPECT_EQ(teller.usual().at({0, 3}), 10.0f);
  EXPECT_THAT(teller.usual(), SizeIs(1));
}

// Claim: of tokens within the time of simultaneity from the first of them the order is that of their words, of others
// that of time; groups begin anew at the first token behind.
TEST(StoriesByHand, SimultaneousTokens) {
  std::vector<Token> tokens = {{9, 0.00f, 1}, {3, 0.01f, 1}, {5, 0.02f, 1},
                               {1, 0.03f, 1}, {0, 0.05f, 1}, {7, 0.10f, 1}};
  order_simultaneous(tokens, 0.0201);
  std::vector<std::uint32_t> words;
  for (const Token& token : tokens) words.push_back(token.word);
  EXPECT_THAT(words, ElementsAre(3, 5, 9, 0, 1, 7));
  order_simultaneous({}, 1);
  std::vector<Token> equal = {{4, 0.02f, 1}, {4, 0.01f, 2}};
  order_simultaneous(equal, 1);
  EXPECT_EQ(equal[0].begin, 0.01f) << "of one word the earlier first";
}

// Claim: told again by parts, stories are those that would have been told by parts from the beginning.
TEST(StoriesByHand, ToldAgainByParts) {
  std::mt19937_64 random(152);
  const std::vector<Told> traces = random_traces(random, 120);
  StoryRules fine;
  fine.detail = Detail::modes;
  const Stories again = told_by_parts(stories_of(traces, fine), fine.simultaneous), first = stories_of(traces);
  ASSERT_EQ(again.size(), first.size());
  for (std::size_t i = 0; i < again.size(); ++i) EXPECT_EQ(told_words(again[i]), told_words(first[i]));
}

// Claim: sequences, their traces by end and their first particle are those of a count over the traces, most first, and
// all valid traces are in one.
TEST(StoriesByHand, SequencesAreCounted) {
  std::mt19937_64 random(153);
  for (int round = 0; round < 10; ++round) {
    const std::vector<Told> traces = random_traces(random, 150);
    struct Count {
      std::uint64_t n = 0, success = 0, unknown = 0;
      std::vector<std::uint64_t> violated = {0, 0, 0};
      std::uint32_t first = 0;
    };
    std::map<std::vector<std::uint32_t>, Count> wanted;
    std::uint64_t valid = 0;
    for (std::uint32_t i = 0; i < traces.size(); ++i) {
      if (traces[i].outcome == Outcome::invalid) continue;
      std::vector<std::uint32_t> words;
      for (const ContactPhase& phase : traces[i].phases) {
        words.push_back(pair_word(static_cast<std::uint32_t>(phase.a), static_cast<std::uint32_t>(phase.b)));
      }
      Count& one = wanted[words];
      if (one.n++ == 0) one.first = i;
      one.success += traces[i].outcome == Outcome::success;
      one.unknown += traces[i].outcome == Outcome::unknown_failure;
      if (traces[i].violated >= 0) ++one.violated[static_cast<std::size_t>(traces[i].violated)];
      ++valid;
    }
    const std::vector<SequenceCount> got = count_sequences(stories_of(traces), 3);
    ASSERT_EQ(got.size(), wanted.size());
    std::uint64_t before = valid, all = 0;
    for (const SequenceCount& one : got) {
      const Count& count = wanted.at(one.words);
      EXPECT_EQ(one.outcomes.n, count.n);
      EXPECT_EQ(one.outcomes.success, count.success);
      EXPECT_EQ(one.outcomes.unknown, count.unknown);
      EXPECT_EQ(one.outcomes.violated, count.violated);
      EXPECT_EQ(one.example, count.first);
      EXPECT_LE(one.outcomes.n, before);
      before = one.outcomes.n;
      all += one.outcomes.n;
    }
    EXPECT_EQ(all, valid);
  }
  EXPECT_THAT(count_sequences(Stories{}, 3), IsEmpty());
}

// Claim: events, features and sequences that no success has are those of sets that are made without the program's, with
// the traces that have them and when they first do.
TEST(StoriesByHand, NoveltiesAreDifferencesOfSets) {
  std::mt19937_64 random(154);
  StoryRules rules;
  rules.detail = Detail::features;
  int found = 0;
  for (int round = 0; round < 12; ++round) {
    std::vector<Told> traces = random_traces(random, 24);
    traces[3].outcome = Outcome::unknown_failure;
    traces[3].phases.push_back(touch_event(2, 4, 2.0));  // on no feature, which no other trace does
    const Stories stories = stories_of(traces, rules);
    IsReference reference;
    std::set<std::uint32_t> words, parts;
    std::set<std::vector<std::uint32_t>> sequences;
    for (std::size_t i = 0; i < stories.size(); ++i) {
      reference.push_back(stories[i].outcome == Outcome::success);
      if (!reference[i]) continue;
      for (const std::uint32_t word : told_words(stories[i])) words.insert(word), parts.insert(parts_only(word));
      sequences.insert(told_words(stories[i]));
    }
    using Kind = Novelty::Kind;
    std::map<std::pair<Kind, std::uint32_t>, std::set<std::uint32_t>> wanted;  // particles
    std::map<std::pair<Kind, std::uint32_t>, float> first;
    const auto note = [&](Kind kind, std::uint32_t word, float time, std::uint32_t particle) {
      const auto key = std::pair(kind, word);
      wanted[key].insert(particle);
      first[key] = first.contains(key) ? std::min(first[key], time) : time;
    };
    for (std::size_t i = 0; i < stories.size(); ++i) {
      const Story story = stories[i];
      if (reference[i]) continue;
      for (const Token& token : story.tokens) {
        const std::uint32_t own = parts_only(token.word);
        if (!parts.contains(own)) note(Kind::event, own, token.begin, story.particle);
        if (parts.contains(own) && !words.contains(token.word))
          note(Kind::feature, token.word, token.begin, story.particle);
      }
      if (!sequences.contains(told_words(story)) && !story.tokens.empty()) {
        note(Kind::sequence, 0, story.tokens[0].begin, story.particle);
      }
    }
    for (const Novelty& one : novelties(stories, 3, reference)) {
      if (one.kind == Kind::outcomes) continue;
      ++found;
      const auto key = std::pair(one.kind, one.word);
      ASSERT_TRUE(wanted.contains(key)) << static_cast<int>(one.kind) << ", " << one.word;
      const std::size_t silent = one.kind == Kind::sequence && !sequences.contains({})
                                     ? static_cast<std::size_t>(std::count_if(traces.begin(), traces.end(),
                                                                              [](const Told& t) {
                                                                                return t.phases.empty() &&
                                                                                       t.outcome != Outcome::success &&
                                                                                       t.outcome != Outcome::invalid;
                                                                              }))
                                     : 0;
      EXPECT_EQ(one.outcomes.n, wanted[key].size() + silent);
      EXPECT_FLOAT_EQ(static_cast<float>(one.first), first[key]);
      EXPECT_TRUE(wanted[key].contains(one.example));
      wanted.erase(key);
    }
    EXPECT_THAT(wanted, IsEmpty()) << "all are told";
  }
  EXPECT_GT(found, 20);
}

// Claim: against another campaign every trace is looked at, successes too; against itself nothing is new.
TEST(StoriesByHand, NoveltiesAgainstAnother) {
  StoryRules rules;
  rules.detail = Detail::features;
  const Stories here = stories_of({{.phases = {touch_event(0, 3, 0.5)}}, {.phases = {touch_event(1, 3, 0.25)}}}, rules);
  const Stories there = stories_of({{.phases = {touch_event(0, 3, 0.7)}}}, rules);
  const std::vector<Novelty> got = novelties(here, 0, {true, true}, &there);
  ASSERT_THAT(got, SizeIs(2));
  EXPECT_EQ(got[0].kind, Novelty::Kind::event);
  EXPECT_EQ(got[0].word, pair_word(1, 3));
  EXPECT_EQ(got[0].example, 1u);
  EXPECT_EQ(got[0].first, 0.25);
  EXPECT_EQ(got[1].kind, Novelty::Kind::sequence);
  EXPECT_THAT(novelties(here, 0, {true, true}, &here), IsEmpty());
  EXPECT_THAT(novelties(here, 0, {true, true}), IsEmpty());
}

// Claim: one contact with different outcomes is told if both ends have two traces and one in twenty, and fewer than
// nine in ten traces have it: at each of these borders.
TEST(StoriesByHand, OneContactWithDifferentOutcomes) {
  const auto told = [](std::size_t with_success, std::size_t with_failure, std::size_t without) {
    std::vector<Told> traces;
    for (std::size_t i = 0; i < with_success + with_failure + without; ++i) {
      Told one;
      if (i < with_success + with_failure) one.phases = {touch_event(0, 3, 0.5)};
      if (i >= with_success && i < with_success + with_failure) one.outcome = Outcome::unknown_failure;
      traces.push_back(one);
    }
    const Stories stories = stories_of(traces);
    const std::vector<Novelty> got = novelties(stories, 0, IsReference(stories.size(), true));
    return !got.empty() && got[0].kind == Novelty::Kind::outcomes && got[0].outcomes.n == with_success + with_failure;
  };
  EXPECT_TRUE(told(10, 2, 10));
  EXPECT_FALSE(told(10, 1, 10)) << "once may be chance";
  EXPECT_TRUE(told(38, 2, 10)) << "2 of 40: one in twenty";
  EXPECT_FALSE(told(39, 2, 10));
  EXPECT_TRUE(told(2, 38, 10));
  EXPECT_FALSE(told(1, 38, 10));
  EXPECT_FALSE(told(9, 9, 2)) << "nine in ten have it";
  EXPECT_TRUE(told(9, 9, 3));
}

// Claim: cycles of a strict gait have the contacts that begin in them, as many traces as last that long, and the words
// of the most frequent one; more than can be told are refused.
TEST(StoriesByHand, CyclesAreCut) {
  std::vector<Told> traces(10);
  for (std::size_t i = 0; i < 10; ++i) {
    for (int k = 0; k < 4; ++k) {
      if (i >= 8 && k >= 2) continue;  // these two end early
      traces[i].phases.push_back(touch_event(0, 3, 0.5 * k + 0.2));
      traces[i].phases.push_back(touch_event(i < 3 && k == 1 ? 2 : 1, 3, 0.5 * k + 0.3));
    }
    traces[i].end = i >= 8 ? 1.1 : 2;
    if (i >= 8) traces[i].outcome = Outcome::unknown_failure;
  }
  const std::vector<CycleCount> got = count_cycles(stories_of(traces), 0.5, 2);
  ASSERT_GE(got.size(), 3u);
  for (std::size_t k = 0; k < got.size(); ++k) {
    EXPECT_NEAR(got[k].to - got[k].from, 0.5, 1e-9);
    EXPECT_EQ(got[k].n, got[k].to <= 1.1 ? 10u : 8u) << k;
    EXPECT_THAT(got[k].words, ElementsAre(pair_word(0, 3), pair_word(1, 3)));
    const bool second = got[k].from < 0.7 && got[k].to > 0.8;
    EXPECT_EQ(got[k].distinct, second ? 2u : 1u) << k;
    EXPECT_EQ(got[k].alike, second ? 7u : got[k].n) << k;
  }
  EXPECT_THROW(count_cycles(stories_of(traces), 1e-5, 2), InputError);
  EXPECT_THAT(count_cycles(Stories{}, 0.5, 2), IsEmpty());
}

}  // namespace
}  // namespace graze
