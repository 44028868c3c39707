// Claim: a run can be branched. A trace that was saved at a control step goes on to the bits of the uninterrupted one,
// under every shipped scenario, back end and kind of policy, in any company and as often as one likes; it also goes on
// otherwise, under other noise or another policy of its kind. What does not fit is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "engine/control/policy.h"
#include "simulation/simulation.h"
#include "simulation/telemetry.h"
#include "tests/jobs/program.h"
#include "tests/message_of.h"
#include "tests/sanitized.h"
#include "tests/trace_bits.h"

namespace graze {
namespace {

using testing::message_of;

using ::testing::AllOf;
using ::testing::HasSubstr;
using Saved = std::shared_ptr<const SavedTrace>;

/// Everything of a trace.
std::string all_bits(const TraceRecord& trace) {
  std::string out = testing::all_bits_of(trace);
  out += fmt::format("{} {}", trace.objective_culprit.leaf, trace.objective_culprit.part);
  return out;
}

/// Saves the traces of all particles at some steps.
class Saver : public TraceObserver {
 public:
  explicit Saver(std::vector<std::uint32_t> steps) : steps_(std::move(steps)) {}
  bool see(const StepView& step) override {
    if (std::find(steps_.begin(), steps_.end(), step.step) == steps_.end()) return true;
    if (Saved saved = step.save()) saved_[step.step].push_back(std::move(saved));
    return true;
  }
  /// Those that had not ended by then.
  const std::vector<Saved>& at(std::uint32_t step) { return saved_[step]; }

 private:
  std::vector<std::uint32_t> steps_;
  std::map<std::uint32_t, std::vector<Saved>> saved_;
};

class FirstStep : public TraceObserver {
 public:
  bool see(const StepView& step) override {
    first = std::min(first, step.step);
    return true;
  }
  std::uint32_t first = 0xffffffff;
};

std::vector<Particle> particles_of(const Simulation& simulation, const std::vector<Saved>& saved) {
  std::vector<Particle> out;
  for (const Saved& one : saved) out.push_back(simulation.particle(one->particle));
  return out;
}

Scenario load(const std::filesystem::path& path, std::vector<Override> overrides) {
  ScenarioOptions options;
  options.overrides = std::move(overrides);
  return load_scenario(path.string(), options);
}

/// Those that are shipped, and one that has all kinds of parts.
std::vector<std::filesystem::path> scenarios() {
  std::vector<std::filesystem::path> out;
  for (const auto& entry : std::filesystem::directory_iterator(testing::data("scenarios"))) {
    if (entry.path().extension() == ".yaml") out.push_back(entry.path());
  }
  std::sort(out.begin(), out.end());
  std::erase_if(out, [i = std::size_t{0}](const auto&) mutable { return !test::tried(i++, 4); });
  out.push_back(std::filesystem::path(GRAZE_SOURCE_DIR) / "tests/jobs/golden_kinds.yaml");
  return out;
}

/// Every policy of a scenario: saved at some steps, gone on from there in a fresh simulator, last ones first, beside
/// a watching observer, and once more in the simulator that saved.
void expect_the_same_bits(const Scenario& scenario, std::uint32_t count) {
  const Simulation simulation{Scenario(scenario)};
  const auto control = static_cast<std::uint32_t>(scenario.timing.steps_per_control());
  const auto total = static_cast<std::uint32_t>(scenario.timing.steps()) / control;
  const std::vector<std::uint32_t> steps = {0, control, total / 3 * control, total * 3 / 4 * control};
  for (const PolicySpec& policy : simulation.scenario().policies) {
    SCOPED_TRACE(policy.name);
    Simulator simulator(simulation, policy.name);
    Saver keeper(steps);
    const std::vector<TraceRecord> whole = simulator.run(0, count, {.observer = &keeper});
    for (const std::uint32_t step : steps) {
      std::vector<Saved> saved = keeper.at(step);
      if (step == 0) {
        ASSERT_EQ(saved.size(), count);
      }
      std::reverse(saved.begin(), saved.end());
      const std::vector<Particle> particles = particles_of(simulation, saved);
      FirstStep watcher;
      const auto fresh = Simulator(simulation, policy.name).run(particles, {.observer = &watcher, .saved = saved});
      const auto again = simulator.run(particles, {.saved = saved});
      for (std::size_t i = 0; i < saved.size(); ++i) {
        const std::string expected = all_bits(whole[saved[i]->particle]);
        EXPECT_EQ(all_bits(fresh[i]), expected) << "particle " << saved[i]->particle << " from step " << step;
        EXPECT_EQ(all_bits(again[i]), expected) << "particle " << saved[i]->particle << " from step " << step;
      }
      if (!saved.empty()) {
        EXPECT_EQ(watcher.first, step + 1);
      }
    }
  }
}

TEST(SavedTrace, GoesOnToTheBitsOfTheWhole) {
  for (const auto& path : scenarios()) {
    SCOPED_TRACE(path.stem().string());
    for (const char* record :
         {"{telemetry: all, every: 3, events: true}", "{telemetry: last, last: 20 ms, every: 1}"}) {
      expect_the_same_bits(load(path, {{"time.end", GRAZE_SANITIZED ? "0.05 s" : "0.15 s"}, {"record", record}}), 11);
    }
  }
}

// A ring of frames goes on where it was when it was saved, before and after it was full.
TEST(SavedTrace, GoesOnWithItsRingOfFrames) {
  const Scenario scenario = load(testing::data("scenarios/quadruped_curb.yaml"),
                                 {{"time.end", "0.15 s"}, {"record", "{telemetry: last, last: 20 ms, every: 1}"}});
  const Simulation simulation{Scenario(scenario)};
  for (const TraceRecord& trace : Simulator(simulation, scenario.policies.front().name).run(0, 11)) {
    EXPECT_EQ(trace.outcome, Outcome::unknown_failure);
    EXPECT_EQ(trace.telemetry.size(), 41u);  // 20 ms of 0.5 ms steps, of a trace of 150 ms
  }
  expect_the_same_bits(scenario, 11);
}

// Every particle has its own springs.
TEST(SavedTrace, GoesOnWithItsSprings) {
  expect_the_same_bits(load(testing::data("scenarios/quadruped_curb.yaml"),
                            {{"time.end", GRAZE_SANITIZED ? "0.05 s" : "0.4 s"},
                             {"uncertain.contact.model", "~"},
                             {"contact.model", "compliant"},
                             {"uncertain.contact.stiffness", "{log_uniform: [1e4, 1e6]}"},
                             {"uncertain.environment.curb.damping", "{uniform: [100, 1000]}"}}),
                       11);
}

TEST(SavedTrace, GoesOnUnderBullet) {
  for (const auto& path : scenarios()) {
    if (testing::is_for_lanes_alone(load(path, {}))) continue;
    SCOPED_TRACE(path.stem().string());
    const std::vector<Override> overrides = {{"physics", "bullet"},
                                             {"contact.model", "~"},
                                             {"uncertain.contact.model", "~"},
                                             {"time.end", GRAZE_SANITIZED ? "0.03 s" : "0.06 s"}};
    expect_the_same_bits(load(path, overrides), 5);
  }
}

// To the end, over impacts, violated requirements and impulses that add up; with control steps of several physics
// steps.
TEST(SavedTrace, GoesOnToTheEndOfALongRun) {
  if (GRAZE_SANITIZED) GTEST_SKIP() << "too long for a sanitizer";
  const std::filesystem::path curb = testing::data("scenarios/quadruped_curb.yaml");
  expect_the_same_bits(load(curb, {{"time.end", "1.2 s"}}), 5);
  expect_the_same_bits(load(curb, {{"time.end", "0.6 s"}, {"time.control", "5 ms"}}), 5);
}

Scenario short_curb(std::vector<Override> overrides = {}) {
  overrides.insert(overrides.begin(), {"time.end", "0.3 s"});
  return load(testing::data("scenarios/quadruped_curb.yaml"), std::move(overrides));
}

// The same past, another future: other noise, another policy. Neither disturbs what was saved.
TEST(SavedTrace, GoesOnOtherwise) {
  const Simulation simulation(short_curb());
  Scenario reseeded = short_curb();
  reseeded.seed += 1;
  const Simulation noise(std::move(reseeded));
  const std::string one = simulation.scenario().policies.front().name, two = simulation.scenario().policies.back().name;
  Simulator simulator(simulation, one);
  Saver keeper({100});
  const std::vector<TraceRecord> whole = simulator.run(0, 8, {.observer = &keeper});
  const std::vector<Saved>& saved = keeper.at(100);
  ASSERT_EQ(saved.size(), 8u);
  const std::vector<Particle> particles = particles_of(simulation, saved);
  const auto in_noise = Simulator(noise, one).run(particles, {.saved = saved});
  const auto in_noise_again = Simulator(noise, one).run(particles, {.saved = saved});
  const auto as_two = Simulator(simulation, two).run(particles, {.saved = saved});
  const auto as_before = simulator.run(particles, {.saved = saved});
  for (std::size_t i = 0; i < saved.size(); ++i) {
    const TraceRecord& original = whole[saved[i]->particle];
    EXPECT_NE(in_noise[i].digest, original.digest);
    EXPECT_EQ(all_bits(in_noise[i]), all_bits(in_noise_again[i]));
    EXPECT_NE(as_two[i].digest, original.digest);
    EXPECT_NE(as_two[i].digest, in_noise[i].digest);
    EXPECT_EQ(all_bits(as_before[i]), all_bits(original));
  }
}

/// The trace of particle 0 at a step.
Saved saved_of(const Simulation& simulation, const std::string& policy, std::uint32_t step) {
  Saver keeper({step});
  Simulator(simulation, policy).run(0, 1, {.observer = &keeper});
  return keeper.at(step).empty() ? nullptr : keeper.at(step).front();
}

TEST(SavedTrace, OfAnotherIsRefused) {
  const Simulation curb(short_curb());
  const std::string policy = curb.scenario().policies.front().name;
  const std::vector<Saved> saved = {saved_of(curb, policy, 20)}, none = {nullptr}, two = {saved[0], saved[0]};
  const auto refused = [&](const Simulation& where, const std::string& under, std::uint32_t particle,
                           const std::vector<Saved>& from) {
    return message_of([&] { Simulator(where, under).run(particle, 1, {.saved = from}); });
  };
  EXPECT_EQ(refused(curb, policy, 0, saved), "(accepted)");
  EXPECT_THAT(refused(curb, policy, 1, saved), HasSubstr("particle 1 cannot go on from a trace that was saved of "
                                                         "particle 0"));
  EXPECT_THAT(refused(curb, policy, 0, none), HasSubstr("particle 0 has no saved trace"));
  EXPECT_THAT(refused(curb, policy, 0, two), HasSubstr("2 saved traces for 1 particles"));
  const Simulation bullet(short_curb({{"physics", "bullet"}, {"uncertain.contact.model", "~"}}));
  EXPECT_THAT(refused(bullet, policy, 0, saved), HasSubstr("saved under physics 'lanes' cannot go on under 'bullet'"));
  const Simulation rod(load(testing::data("scenarios/pendulum.yaml"), {}));
  EXPECT_THAT(refused(rod, rod.scenario().policies.front().name, 0, saved), HasSubstr("another robot or world"));
  const Simulation slower(short_curb({{"time.control", "2 ms"}}));
  EXPECT_THAT(refused(slower, policy, 0, saved), HasSubstr("control steps of 0.0005 s cannot go on"));
  const Simulation held(
      short_curb({{"policies", "!replace {stand: {hold: {}, control: {joint_pd: {kp: 5, kd: 1}}}}"}}));
  EXPECT_THAT(refused(held, "stand", 0, saved),
              HasSubstr("of the kind 'gait, control operational_pd' cannot go on "
                        "under stand, which is of the kind 'hold, control joint_pd'"));
  const std::vector<Beginning> beginnings = {{0, curb.particle(0).initial}};
  EXPECT_THAT(message_of([&] { Simulator(curb, policy).run(0, 1, {.beginnings = beginnings, .saved = saved}); }),
              HasSubstr("give one of the two"));
}

// With another task, record or physics step the past cannot be judged on.
TEST(SavedTrace, OfAnotherTaskOrRecordIsRefused) {
  const std::string ring = "{telemetry: last, last: 20 ms, every: 1}";
  const Simulation curb(short_curb({{"record", ring}}));
  const std::string policy = curb.scenario().policies.front().name;
  const std::vector<Saved> saved = {saved_of(curb, policy, 100)};
  const auto refused = [&](std::vector<Override> overrides) {
    overrides.insert(overrides.begin(), {"record", ring});
    const Simulation other(short_curb(std::move(overrides)));
    return message_of([&] { Simulator(other, policy).run({{curb.particle(0)}}, {.saved = saved}); });
  };
  EXPECT_EQ(refused({}), "(accepted)");
  EXPECT_EQ(refused({{"time.end", "0.4 s"}}), "(accepted)") << "the end is yet to come";
  EXPECT_THAT(
      refused({{"record", "{telemetry: all, every: 2}"}}),
      AllOf(HasSubstr("record: a trace that was saved under {telemetry: last, every: 1, last: 0.02 s, events: "),
            HasSubstr(" cannot go on under {telemetry: all, every: 2, events: ")));
  EXPECT_THAT(refused({{"record.last", "10 ms"}}), HasSubstr("under {telemetry: last, every: 1, last: 0.01 s, "));
  EXPECT_THAT(refused({{"record.events", "true"}}), HasSubstr("cannot go on under {telemetry: last, every: 1, last: "
                                                              "0.02 s, events: true, phases: {gap: 0.02 s, "));
  EXPECT_THAT(refused({{"record.phases", "{gap: 5 ms}"}}), HasSubstr("events: false, phases: {gap: 0.005 s, dwell: "));
  EXPECT_THAT(refused({{"record.phases", "{dwell: 5 ms}"}}), HasSubstr("dwell: 0.005 s, impulse: "));
  EXPECT_THAT(refused({{"record.phases", "{impulse: 5 mN s}"}}), HasSubstr("impulse: 0.005 N s}}"));
  EXPECT_THAT(refused({{"record.phases", "false"}}), HasSubstr("phases: false}"));
  EXPECT_THAT(refused({{"time.step", "0.25 ms"}}),
              HasSubstr("time.step: a trace that was saved with physics steps of 0.0005 s cannot go on with steps of "
                        "0.00025 s"));
  for (const Override& other :
       {Override{"task.requirements.upright.tilt.below", "80 deg"}, Override{"task.stop_at_violation", "true"},
        Override{"task.requirements.upright.window", "[0.1, 0.2]"},
        Override{"task.objective", "{low: {position: {link: BODY0, z: {below: 1}}}}"}}) {
    EXPECT_THAT(refused({other}), HasSubstr("task: a trace that was judged by another task")) << other.path;
  }
}

// What is past is not drawn anew: under another seed a particle of this number has other masses and another friction.
TEST(SavedTrace, OfAnotherDrawIsRefused) {
  const Simulation curb(short_curb());
  const std::string policy = curb.scenario().policies.front().name;
  const std::vector<Saved> saved = {saved_of(curb, policy, 20)};
  Scenario scenario = short_curb();
  scenario.seed += 1;
  const Simulation reseeded(std::move(scenario));
  EXPECT_THAT(message_of([&] { Simulator(reseeded, policy).run(0, 1, {.saved = saved}); }),
              HasSubstr("particle 0 has other numbers"));
  Particle slower = curb.particle(0), biased = slower, softer = slower;
  slower.control_lag += 1e-3;
  biased.sensor_bias.front() += 1e-3;
  softer.model.pairs.front().spring.stiffness = 1e4;
  for (const Particle& other : {slower, biased, softer}) {
    EXPECT_THAT(message_of([&] { Simulator(curb, policy).run({{other}}, {.saved = saved}); }),
                HasSubstr("give the particle of the simulation that it was saved in"));
  }
}

// The last line of defence, where two runs were taken for alike: what was saved fits or is refused.
TEST(SavedTrace, RingOfAnotherSizeIsRefused) {
  Recording recording;
  recording.telemetry = Telemetry::last;
  recording.every = 1;
  TelemetryRecorder one(recording, 1e-3);
  LaneTape written;
  one.carry(0, written);
  const LaneTape::Content content = written.take();
  LaneTape again(content), other(content), finer(content);
  EXPECT_NO_THROW(TelemetryRecorder(recording, 1e-3).carry(0, again));
  EXPECT_THROW(TelemetryRecorder(recording, 5e-4).carry(0, finer), std::invalid_argument);
  recording.last /= 2;
  EXPECT_THROW(TelemetryRecorder(recording, 1e-3).carry(0, other), std::invalid_argument);
}

TEST(SavedTrace, IsSavedAtControlStepsOnly) {
  const Simulation curb(short_curb({{"time.step", "1 ms"}, {"time.control", "5 ms"}}));
  const std::string policy = curb.scenario().policies.front().name;
  Saver keeper({12});
  EXPECT_THAT(message_of([&] { Simulator(curb, policy).run(0, 1, {.observer = &keeper}); }),
              HasSubstr("saved at a control step, one in 5 steps; step 12 is none"));
  EXPECT_NE(saved_of(curb, policy, 15), nullptr);
  EXPECT_EQ(saved_of(curb, policy, 300), nullptr) << "nothing goes on from the end";
}

/// A policy that counts its steps, and does not tell.
class Secretive : public Policy {
 public:
  void start(int lane) override { count_[lane] = 0; }
  void act(const Observation&, LaneMask active, Targets& targets) override {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (active[lane]) targets.tau(0, lane) = 1e-3 * ++count_[lane];
    }
  }

 private:
  std::array<int, kLanes> count_{};
};

const PolicyRegistration secretive_registration("secretive", {"counts its steps, and does not tell", {}},
                                                [](const ControlContext&, const Described&, TargetKind) {
                                                  return std::make_unique<Secretive>();
                                                });

TEST(SavedTrace, NeedsAPolicyThatTells) {
  const Simulation curb(
      short_curb({{"policies", "!replace {s: {secretive: {}, control: {joint_pd: {kp: 5, kd: 1}}}}"}}));
  Saver keeper({10});
  EXPECT_THAT(
      message_of([&] { Simulator(curb, "s").run(0, 3, {.observer = &keeper}); }),
      HasSubstr("particle 0, s: the policy does not tell what it keeps of a trace (Policy::carry), so it cannot "
                "be saved"));
}

}  // namespace
}  // namespace graze
