// Claim: a campaign with --until ends with the same answer and the same particles whatever the threads, the order of
// work or interruptions, and they are those that a plain reading of the outcomes in particle order gives.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <thread>

#include "jobs/campaign/stopping_rule.h"
#include "sampling/stream.h"
#include "tests/archive/tables.h"
#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using testing::BallCampaign;
using testing::digests;
using ::testing::HasSubstr;
using ::testing::Not;

/// Whether the mixture martingale at rate p, as a bet particle by particle in order of counts, has grown to 1 / alpha.
bool excluded(std::uint64_t k, std::uint64_t n, double p, double confidence, double mass) {
  double stake = 0;
  for (std::uint64_t i = 0; i < n; ++i) {
    const bool success = i < k;
    const double hits = static_cast<double>(success ? i : k);
    const double predicted = (hits + mass * p) / (static_cast<double>(i) + mass);
    stake += std::log(success ? predicted / p : (1 - predicted) / (1 - p));
  }
  return stake >= -std::log(1 - confidence);
}

/// By bisection: the simplest thing that could work.
Interval plain_interval(std::uint64_t k, std::uint64_t n, double confidence, double mass) {
  const auto bisect = [&](double out, double in) {
    for (int i = 0; i < 45; ++i) (excluded(k, n, (out + in) / 2, confidence, mass) ? out : in) = (out + in) / 2;
    return in;
  };
  const double rate = static_cast<double>(k) / static_cast<double>(n);
  return {k == 0 ? 0 : bisect(0, rate), k == n ? 1 : bisect(1, rate)};
}

/// The particles at which all policies' intervals are narrower than `width`: outcomes in order, looks at multiples of
/// 64 that grow by a sixteenth. Also the looks at `most`.
std::uint64_t plain_answer(const std::vector<std::vector<Outcome>>& outcomes, double width, double confidence) {
  std::vector<std::uint64_t> k(outcomes.size()), n(outcomes.size());
  std::uint64_t particle = 0;
  for (std::uint64_t look = 64; look <= outcomes[0].size(); look += std::max<std::uint64_t>(64, look / 1024 * 64)) {
    bool all = true;
    for (; particle < look; ++particle) {
      for (std::size_t policy = 0; policy < outcomes.size(); ++policy) {
        n[policy] += outcomes[policy][particle] != Outcome::invalid;
        k[policy] += outcomes[policy][particle] == Outcome::success;
      }
    }
    for (std::size_t policy = 0; policy < outcomes.size(); ++policy) {
      const Interval interval = plain_interval(k[policy], n[policy], confidence, 0.4 / (width * width));
      all = all && interval.high - interval.low < width;
    }
    if (all) return look;
  }
  return 0;
}

/// Outcomes of two policies without a simulation: rates 0.7 and 0.9, every tenth trace invalid.
Outcome made_up(int policy, std::uint32_t particle) {
  const double fate = uniform(3, particle, static_cast<std::uint64_t>(policy), 0);
  if (fate < 0.1) return Outcome::invalid;
  return fate < (policy == 0 ? 0.73 : 0.91) ? Outcome::success : Outcome::known_failure;
}

CampaignInfo asked(const std::string& question, std::uint64_t most) {
  CampaignInfo info;
  info.policies = {"a", "b"};
  info.particles = most;
  info.until = {{question}, 0.95, most, 0, 0};
  return info;
}

// Claim: blocks of odd sizes, counted in random order by several threads, give the plain answer; and it is known as
// soon as the last trace before that look is counted, not later. Invalid traces are waited for and count in no rate.
TEST(StoppingRule, AnswerDoesNotDependOnTheOrderOfWork) {
  constexpr std::uint32_t kMost = 5000;
  std::vector<std::vector<Outcome>> outcomes(2);
  for (int policy = 0; policy < 2; ++policy) {
    for (std::uint32_t i = 0; i < kMost; ++i) outcomes[static_cast<std::size_t>(policy)].push_back(made_up(policy, i));
  }
  const std::uint64_t wanted = plain_answer(outcomes, 0.08, 0.95);
  ASSERT_GT(wanted, 1000u);
  ASSERT_LT(wanted, 4000u);
  std::mt19937 random(5);
  for (int round = 0; round < 20; ++round) {
    struct Piece {
      int policy;
      std::vector<TraceRecord> records;
    };
    std::vector<Piece> pieces;
    for (int policy = 0; policy < 2; ++policy) {
      for (std::uint32_t i = 0; i < kMost;) {
        Piece& piece = pieces.emplace_back();
        piece.policy = policy;
        for (const std::uint32_t end = std::min<std::uint32_t>(kMost, i + 1 + random() % 90); i < end; ++i) {
          piece.records.emplace_back().particle = i;
          piece.records.back().outcome = made_up(policy, i);
        }
      }
    }
    std::shuffle(pieces.begin(), pieces.end(), random);
    const auto comm = make_local_communicator();
    StoppingRule rule(*comm, asked("ci < 0.08", kMost));
    std::atomic<std::size_t> next{0};
    std::atomic<int> told{0};
    const auto work = [&] {
      for (std::size_t i = next++; i < pieces.size(); i = next++)
        told += rule.count(pieces[i].policy, pieces[i].records);
    };
    std::vector<std::thread> threads;
    for (int i = 0; i < 1 + round % 4; ++i) threads.emplace_back(work);
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(rule.answered_at(), wanted);
    EXPECT_GE(told, 1);
    StoppingRule elsewhere(*comm, asked("ci < 0.08", kMost));  // as another rank of the communicator sees it
    EXPECT_EQ(elsewhere.answered_at(), wanted);
  }
}

// Claim: one trace that is missing before the look keeps the question open, however many there are behind it.
TEST(StoppingRule, WaitForEveryTraceBeforeThem) {
  const auto comm = make_local_communicator();
  StoppingRule rule(*comm, asked("ci < 0.5", 1000));
  const auto count = [&](int policy, std::uint32_t first, std::uint32_t last) {
    std::vector<TraceRecord> records(last - first);
    for (std::uint32_t i = first; i < last; ++i) {
      records[i - first].particle = i;
      records[i - first].outcome = Outcome::success;
    }
    return rule.count(policy, records);
  };
  EXPECT_FALSE(count(0, 0, 1000));
  EXPECT_FALSE(count(1, 0, 17));
  EXPECT_FALSE(count(1, 18, 1000));
  EXPECT_EQ(rule.answered_at(), 0u);
  EXPECT_TRUE(count(1, 17, 18));
  EXPECT_EQ(rule.answered_at(), 64u);
}

/// The ball campaign in a folder.
struct UntilCampaign : BallCampaign {
  UntilCampaign() : BallCampaign("sampling: {design: random}\n") {}
  std::string packed(const std::string& name) const {
    EXPECT_EQ(graze("pack " + name + ".graze --force").code, 0);
    return testing::read_file(folder / (name + ".h5"));
  }
};

TEST(Until, SameParticlesForAnyThreadsAsAPlainReadingOfTheOutcomes) {
  const UntilCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 4000 --quiet -o plain.graze").code, 0);
  const Archive plain(campaign.folder / "plain.graze");
  const std::uint64_t wanted = plain_answer({table_of(plain, "still").outcome}, 0.07, 0.95);
  ASSERT_GT(wanted, 1500u);
  auto first = digests(campaign.folder / "plain.graze").at("still");
  first.erase(first.lower_bound(static_cast<std::uint32_t>(wanted)), first.end());
  for (const char* threads : {"1", "2", "4"}) {
    const std::string name = std::string("u") + threads;
    const testing::Result ran = campaign.graze("run ball.yaml --until 'ci < 0.07' --quiet --threads " +
                                               std::string(threads) + " -o " + name + ".graze");
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_THAT(ran.out, AllOf(HasSubstr("Asked by --until; " + std::to_string(wanted) + " particles"),
                               HasSubstr("ci < 0.07  still   holds")));
    EXPECT_EQ(digests(campaign.folder / (name + ".graze")).at("still"), first);
    EXPECT_THAT(campaign.graze("status " + name + ".graze").out, AllOf(HasSubstr("complete"), HasSubstr("100.0 %")));
  }
}

// Claim: killed at random instants and resumed, a campaign keeps its question, and ends with the same particles and
// bits as one that nobody disturbed.
TEST(Until, ResumesWithTheSameQuestionAfterAKill) {
  const UntilCampaign campaign;
  const std::string run = "run ball.yaml --until 'ci < 0.03' --confidence 90% --threads 2 --quiet -o ";
  ASSERT_EQ(campaign.graze(run + "whole.graze").code, 0);
  const auto wanted = digests(campaign.folder / "whole.graze");
  std::mt19937 random(11);
  std::uniform_real_distribution<double> instant(0.05, 0.5);
  int interrupted = 0;
  for (int round = 0; round < 6; ++round) {
    const std::string name = "k" + std::to_string(round) + ".graze";
    const std::string signal = round % 2 == 0 ? "KILL" : "TERM";
    // The first two as soon as there is a campaign, however fast the machine is.
    const std::string when =
        round < 2 ? "until [ -e " + name + "/campaign.h5 ]; do :; done" : "sleep " + std::to_string(instant(random));
    testing::shell(campaign.folder.path(), "'" GRAZE_PROGRAM "' " + run + name + " & program=$!; " + when + "; kill -" +
                                               signal + " $program; wait $program");
    if (!std::filesystem::exists(campaign.folder / name / "campaign.h5")) continue;
    interrupted += !Archive(campaign.folder / name).complete();
    const testing::Result end = campaign.graze("resume --quiet " + name);
    EXPECT_EQ(end.code, 0) << end.err;
    EXPECT_THAT(end.out, HasSubstr("ci < 0.03  still   holds"));
    EXPECT_EQ(digests(campaign.folder / name), wanted) << "round " << round;
  }
  EXPECT_GT(interrupted, 0);
}

TEST(Until, ExitCodesTellTheAnswer) {
  const UntilCampaign campaign;  // its success rate is about 0.63
  const testing::Result holds = campaign.graze("run ball.yaml --until 'p >= 0.5' --quiet -o a.graze");
  EXPECT_EQ(holds.code, 0);
  EXPECT_THAT(holds.out, HasSubstr("holds"));
  const testing::Result refuted = campaign.graze("run ball.yaml --until 'still: p >= 90 %' --quiet -o b.graze");
  EXPECT_EQ(refuted.code, 1);
  EXPECT_THAT(refuted.out, HasSubstr("refuted"));
  const testing::Result open = campaign.graze("run ball.yaml --until 'p < 0.6' -n 100 --quiet -o c.graze");
  EXPECT_EQ(open.code, 4);
  EXPECT_THAT(open.out, AllOf(HasSubstr("undecided"), HasSubstr("100 particles")));
  EXPECT_TRUE(Archive(campaign.folder / "c.graze").complete());
  // All of several questions have to be answered; one that is refuted makes the exit code.
  const testing::Result both =
      campaign.graze("run ball.yaml --until 'p >= 0.9' --until 'ci < 0.1' --json --quiet -o d.graze");
  EXPECT_EQ(both.code, 1);
  EXPECT_THAT(both.out, AllOf(HasSubstr("\"refuted\""), HasSubstr("\"holds\""), HasSubstr("confidence_sequence")));
}

TEST(Until, GrowsLikeAnyCampaign) {
  const UntilCampaign campaign;
  // Open at 100: goes on with its question, up to more particles.
  ASSERT_EQ(campaign.graze("run ball.yaml --until 'ci < 0.1' -n 100 --quiet -o a.graze").code, 4);
  ASSERT_EQ(campaign.graze("run ball.yaml --until 'ci < 0.1' -n 5000 --quiet -o b.graze").code, 0);
  EXPECT_EQ(campaign.graze("resume a.graze -n 5000 --quiet").code, 0);
  EXPECT_EQ(digests(campaign.folder / "a.graze"), digests(campaign.folder / "b.graze"));
  // Answered: resume has nothing to do; with -n it gets as many as it was asked for, and answers from these.
  const std::size_t answered = digests(campaign.folder / "b.graze").at("still").size();
  EXPECT_EQ(campaign.graze("resume b.graze --quiet").code, 0);
  EXPECT_EQ(digests(campaign.folder / "b.graze").at("still").size(), answered);
  EXPECT_EQ(campaign.graze("resume b.graze -n 4000 --quiet").code, 0);
  ASSERT_EQ(campaign.graze("run ball.yaml -n 4000 --quiet -o plain.graze").code, 0);
  EXPECT_EQ(digests(campaign.folder / "b.graze"), digests(campaign.folder / "plain.graze"));
  EXPECT_THAT(campaign.graze("score b.graze").out, HasSubstr("Asked by --until; 4000 particles"));
}

TEST(Until, MistakesAreRefusedBeforeAnythingIsSimulated) {
  const UntilCampaign campaign;
  const auto refused = [&](const std::string& arguments, const std::string& what) {
    const testing::Result result = campaign.graze("run ball.yaml -o x.graze " + arguments);
    EXPECT_EQ(result.code, 2) << arguments;
    EXPECT_THAT(result.err, HasSubstr(what));
    EXPECT_FALSE(std::filesystem::exists(campaign.folder / "x.graze"));
  };
  refused("--until 'ci > 0.02'", "nearest right answer: 'ci < 0.02'");
  refused("--until 'stil: p >= 0.9'", "nearest: still");
  refused("--until 'p >= 0.9' --confidence 95", "nearest right answer: '95%'");
  refused("--confidence 0.9", "--until");
  refused("--until 'p >= 0.9' --set sampling.design=latin_hypercube", "use --set sampling.design=random");
}

}  // namespace
}  // namespace graze
