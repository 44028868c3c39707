// Claim: a particle that throws, takes too long or hangs harms nobody but itself. Its neighbours in the block have the
// bits that they have without it; the one that throws is `invalid` with the reason, the others are left unfinished and
// tried again by resume.
#include "simulation/contained.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "archive/directory/finished.h"
#include "archive/directory/unfinished.h"
#include "engine/control/policy.h"
#include "jobs/campaign/campaign.h"
#include "jobs/campaign/describe_campaign.h"
#include "jobs/cli/simulate.h"
#include "simulation/watchdog.h"
#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using testing::digests;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

std::atomic<bool> mended{false};  // the machine behaves: nothing is slow, nothing hangs

void doze(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

/// Policy `faulty`: {does: throw | throw_int | exhaust | sleep | hang, above: m}. Commands nothing; from 10 ms on it
/// does it in every lane whose base was higher than that then.
class Faulty : public Policy {
 public:
  explicit Faulty(const Settings& settings)
      : does_(settings.at("does").text()), above_(settings.at("above").number(Quantity::length)) {}
  void start(int lane) override { bad_[lane] = false; }
  void act(const Observation& observation, LaneMask active, Targets&) override {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane] || observation.time[lane] < 0.01) continue;
      if (observation.base_position(2, lane) > above_) bad_[lane] = true;
      if (bad_[lane]) err();
    }
  }

 private:
  void err() const {
    if (does_ == "throw") throw std::runtime_error("the gripper has no fingers");
    if (does_ == "throw_int") throw 42;
    if (does_ == "exhaust") throw std::bad_alloc();
    if (does_ == "sleep" && !mended) doze(0.1);
    while (does_ == "hang" && !mended) doze(0.001);
  }
  std::string does_;
  double above_;
  std::array<bool, kLanes> bad_{};
};

const PolicyRegistration registration("faulty",
                                      {"errs as it is told",
                                       {{"does", {Form::text("WHAT")}, Default::required(), "the fault"},
                                        {"above", {Form::number()}, Default::required(), "m, where it has it"}}},
                                      [](const ControlContext&, const Described& own, TargetKind) {
                                        return std::make_unique<Faulty>(own.settings());
                                      });

/// What came out of a campaign.
struct Outcomes {
  std::map<std::uint32_t, TraceRecord> traces;
  std::map<std::uint32_t, double> height;  // m, of each trace's particle above the nominal one
  std::map<std::uint32_t, std::string> unfinished;
  CampaignEnd end;
};

Outcomes simulate(const Scenario& scenario, double watchdog = 0) {
  CampaignOptions options;
  options.particles = scenario.particles;
  options.threads = 2;
  options.watchdog = watchdog;
  Outcomes out;
  std::mutex mutex;
  options.unfinished = [&](const std::string&, const UnfinishedParticle& particle) {
    const std::lock_guard lock(mutex);
    out.unfinished[particle.particle] = particle.reason;
  };
  const std::unique_ptr<Communicator> comm = make_local_communicator();
  out.end = run_campaign(scenario, options, *comm,
                         [&](int, std::vector<TraceRecord> traces, const std::vector<double>& values) {
                           const std::lock_guard lock(mutex);
                           const std::size_t width = values.size() / traces.size();
                           for (std::size_t i = 0; i < traces.size(); ++i) {
                             out.height[traces[i].particle] = values[(i + 1) * width - 1];
                             out.traces[traces[i].particle] = std::move(traces[i]);
                           }
                         });
  return out;
}

/// 40 balls that fall for 50 ms; those that begin higher than `above` find the policy faulty.
struct ThrownBalls {
  TemporaryFolder folder;
  Scenario load(const std::string& does, double above, const std::string& physics = "lanes") const {
    std::string text = testing::ball_scenario("sampling: {particles: 40}\nphysics: " + physics + "\n");
    const std::string still = "{hold: {}, control: {torque: {}}}";
    text.replace(text.find(still), still.size(),
                 "{faulty: {does: " + does + ", above: " + std::to_string(above) + "}, control: {torque: {}}}");
    testing::write_file(folder / "ball.urdf", testing::kBallUrdf);
    testing::write_file(folder / "ball.yaml", text);
    return load_scenario((folder / "ball.yaml").string());
  }
};

constexpr double kNobody = 10;       // m
constexpr double kFall = 0.0004905;  // m, in the 10 ms before the fault

/// The height above which the highest `guilty` particles of a campaign are, and who they are.
struct Bar {
  double above;
  std::vector<std::uint32_t> guilty;
};
Bar bar_for(const Outcomes& all, std::size_t guilty) {
  std::vector<std::pair<double, std::uint32_t>> order;
  for (const auto& [particle, height] : all.height) order.emplace_back(-height, particle);
  std::sort(order.begin(), order.end());
  Bar bar{0.2 - kFall - (order[guilty - 1].first + order[guilty].first) / 2, {}};
  for (std::size_t i = 0; i < guilty; ++i) bar.guilty.push_back(order[i].second);
  return bar;
}

void expect_same_bits_but(const std::vector<std::uint32_t>& guilty, const Outcomes& all, const Outcomes& some) {
  for (const auto& [particle, trace] : all.traces) {
    if (std::count(guilty.begin(), guilty.end(), particle)) continue;
    ASSERT_TRUE(some.traces.count(particle)) << particle;
    EXPECT_EQ(trace.digest, some.traces.at(particle).digest) << particle;
    EXPECT_EQ(trace.outcome, some.traces.at(particle).outcome) << particle;
    EXPECT_EQ(all.height.at(particle), some.height.at(particle)) << particle;
  }
}

TEST(ContainedThreads, WhoThrowsIsInvalidAndHarmsNobody) {
  const ThrownBalls balls;
  for (const std::string physics : {"lanes", "bullet"}) {
    SCOPED_TRACE(physics);
    const Outcomes all = simulate(balls.load("throw", kNobody, physics));
    ASSERT_EQ(all.traces.size(), 40u);
    const Bar bar = bar_for(all, 3);
    for (const auto& [does, reason] :
         {std::pair{"throw", "the gripper has no fingers"}, std::pair{"throw_int", "an exception of unknown type"}}) {
      const Outcomes some = simulate(balls.load(does, bar.above, physics));
      EXPECT_TRUE(some.end.complete());
      EXPECT_EQ(some.traces.size(), 40u);
      expect_same_bits_but(bar.guilty, all, some);
      for (const std::uint32_t particle : bar.guilty) {
        const TraceRecord& trace = some.traces.at(particle);
        EXPECT_EQ(trace.outcome, Outcome::invalid);
        EXPECT_EQ(trace.invalid_reason, reason);
        EXPECT_TRUE(std::isnan(trace.end_time));
        EXPECT_EQ(some.height.at(particle), all.height.at(particle));
      }
    }
  }
}

TEST(ContainedThreads, MemoryIsAMatterOfTheMachine) {
  const ThrownBalls balls;
  const Outcomes all = simulate(balls.load("exhaust", kNobody));
  const Bar bar = bar_for(all, 1);
  const Outcomes some = simulate(balls.load("exhaust", bar.above));
  EXPECT_FALSE(some.end.complete());
  EXPECT_THAT(some.unfinished, ::testing::ElementsAre(::testing::Pair(bar.guilty[0], "out of memory")));
  EXPECT_EQ(some.traces.size(), 39u);
  expect_same_bits_but(bar.guilty, all, some);
}

TEST(ContainedThreads, WhoTakesTooLongIsCutOff) {
  mended = false;
  const ThrownBalls balls;
  const Outcomes all = simulate(balls.load("sleep", kNobody));
  const Bar bar = bar_for(all, 1);
  const Outcomes some = simulate(balls.load("sleep", bar.above), 1);
  EXPECT_FALSE(some.end.complete());
  EXPECT_TRUE(some.end.hanging.empty());
  EXPECT_THAT(some.unfinished,
              ::testing::ElementsAre(::testing::Pair(bar.guilty[0], "took longer than the watchdog allows")));
  EXPECT_EQ(some.traces.size(), 39u);
  expect_same_bits_but(bar.guilty, all, some);
}

TEST(ContainedThreads, WhoHangsIsGivenUp) {
  mended = false;
  const ThrownBalls balls;
  const Outcomes all = simulate(balls.load("hang", kNobody));
  const Bar bar = bar_for(all, 1);
  const Scenario scenario = balls.load("hang", bar.above);
  Outcomes some = simulate(scenario, 0.5);
  EXPECT_FALSE(some.end.complete());
  EXPECT_EQ(some.end.hanging.size(), 2u) << "one in the block, one alone";
  ASSERT_EQ(some.unfinished.size(), 1u);
  EXPECT_THAT(some.unfinished.at(bar.guilty[0]), HasSubstr("did not come back"));
  EXPECT_EQ(some.traces.size(), 39u);
  expect_same_bits_but(bar.guilty, all, some);
  mended = true;  // they come back, and find that they are not needed any more
  for (std::thread& thread : some.end.hanging) thread.join();
}

// Claim: a trace on a thread that was started late (in place of one that hangs) has as long as any other; it is not cut
// off by the first look at it.
TEST(ContainedThreads, WhoJoinsLateHasItsWholeTime) {
  Watchdog watchdog(1);
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));  // more ticks than a trace may last
  const auto watch = std::make_shared<TraceWatch>();
  watchdog.add(watch, [] {});
  watch->enter();
  watch->begin(0);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // some looks, and far from a second
  EXPECT_NO_THROW(watch->check());
  watch->leave();
}

// Claim: the shortest limit that --watchdog takes is kept: a trace has its time, and is cut off soon after it.
TEST(ContainedThreads, TheShortestLimitIsKept) {
  Watchdog watchdog(kShortestWatchdog);
  const auto watch = std::make_shared<TraceWatch>();
  watchdog.add(watch, [] {});
  const auto cut_off_after = [&] {
    watch->enter();
    watch->begin(0);
    const auto begin = std::chrono::steady_clock::now();
    try {
      while (true) {
        watch->check();
        doze(1e-4);
      }
    } catch (const Overtime&) {
      watch->leave();
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    }
  };
  double soonest = 1e9;  // of some, as this machine may have other work to do meanwhile
  for (int trial = 0; trial < 10; ++trial) {
    const double seconds = cut_off_after();
    EXPECT_GE(seconds, kShortestWatchdog);
    soonest = std::min(soonest, seconds);
  }
  EXPECT_LT(soonest, 2 * kShortestWatchdog);
}

/// As `graze run` or `graze resume` do it.
void write_campaign(const Scenario& scenario, const std::filesystem::path& directory, double watchdog) {
  CampaignOptions options;
  options.particles = scenario.particles;
  options.seed = scenario.seed;
  options.threads = 2;
  options.watchdog = watchdog;
  const CampaignInfo info = describe_campaign(scenario, scenario.particles, "test");
  const std::unique_ptr<Communicator> comm = make_local_communicator();
  Start start(*comm);
  if (!std::filesystem::exists(directory)) {
    CampaignWriter writer(directory, info, false);
    simulate_into(writer, scenario, options, info, {false, true}, start);
    return;
  }
  CampaignWriter writer(directory, info, ExistingCampaign{});
  const FinishedTraces finished = repair_and_list(directory, info);
  simulate_into(writer, scenario, options, info, {false, true}, start, finished);
}

TEST(Contained, AHangingCampaignEndsIncompleteAndIsResumed) {
  mended = false;
  const ThrownBalls balls;
  const Outcomes all = simulate(balls.load("hang", kNobody));
  const Bar bar = bar_for(all, 1);
  const Scenario scenario = balls.load("hang", bar.above);
  const auto directory = balls.folder / "a.graze";
  EXPECT_EXIT(write_campaign(scenario, directory, 0.5), ::testing::ExitedWithCode(3),
              "a.graze: traces unfinished by the fault of this machine, not of the robot: 1; 'graze resume .*"
              "policy still, particle [0-9]+: did not come back.*graze replay .*--particle [0-9]+ --policy still "
              "--unverified");
  const std::vector<UnfinishedTrace> unfinished = read_unfinished(directory);
  ASSERT_EQ(unfinished.size(), 1u);
  EXPECT_EQ(unfinished[0].particle, bar.guilty[0]);
  EXPECT_EQ(unfinished[0].policy, "still");
  EXPECT_FALSE(Archive(directory).complete());
  EXPECT_EQ(digests(directory).at("still").size(), 39u);
  mended = true;
  write_campaign(scenario, directory, 0.5);
  EXPECT_TRUE(Archive(directory).complete());
  EXPECT_TRUE(read_unfinished(directory).empty());
  std::map<std::uint32_t, std::uint64_t> wanted;
  for (const auto& [particle, trace] : all.traces) wanted[particle] = trace.digest;
  EXPECT_EQ(digests(directory).at("still"), wanted);
}

// Claim: who watches hears of steps while a block is under way, of each step once, and knows at its end how many those
// were.
TEST(TraceWatch, TellsOfStepsWhileABlockRuns) {
  TraceWatch watch;
  std::uint64_t heard = 0;
  int times = 0;
  watch.teller = [&](std::uint64_t steps) { heard += steps, ++times; };
  const auto run_until_told = [&](int until) {
    watch.begin_block();
    const auto begin = std::chrono::steady_clock::now();
    std::uint64_t steps = 0;
    while (times < until && std::chrono::steady_clock::now() - begin < std::chrono::seconds(20)) {
      watch.count(steps += 8);
    }
    return steps;
  };
  const std::uint64_t first = run_until_told(1);
  EXPECT_EQ(heard, first);
  const std::uint64_t second = run_until_told(2);
  EXPECT_EQ(heard, first + second);
  EXPECT_EQ(watch.take_told(), first + second);
  EXPECT_EQ(watch.take_told(), 0u);
}

}  // namespace
}  // namespace graze
