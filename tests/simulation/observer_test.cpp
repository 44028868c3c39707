// Claim: whoever watches a block sees every step of every trace, at whatever time and in whatever lane it runs, with
// the numbers that it is judged by; and watching changes nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "simulation/block_run.h"
#include "simulation/particles.h"
#include "tests/jobs/program.h"

namespace graze {
namespace {

/// What an observer saw of one trace.
struct Seen {
  std::vector<std::uint32_t> steps;
  double time = -1;
  std::vector<double> q, v, least;  // of the last step, and the least of each requirement's witness
  std::vector<double> objective;
};

std::vector<double> column(const BlockArray& array, int lane) {
  std::vector<double> out;
  for (int i = 0; i < array.rows(); ++i) out.push_back(array(i, lane));
  return out;
}

class Watcher : public TraceObserver {
 public:
  bool see(const StepView& step) override {
    Seen& seen = traces[step.particle];
    seen.steps.push_back(step.step);
    seen.time = step.time;
    seen.q = column(step.physics.state().q, step.lane);
    seen.v = column(step.physics.state().v, step.lane);
    seen.objective = column(step.objective, step.lane);
    const std::vector<double> now = column(step.requirements, step.lane);
    if (seen.least.empty()) seen.least = now;
    for (std::size_t i = 0; i < now.size(); ++i) seen.least[i] = std::min(seen.least[i], now[i]);
    return true;
  }
  std::map<std::uint32_t, Seen> traces;
};

/// The curb on a back end; traces end one by one, so that lanes are refilled.
Scenario scenario_on(const std::string& physics) {
  ScenarioOptions options;
  options.overrides = {{"physics", physics},
                       {"time.end", "60 ms"},
                       {"task.stop_at_violation", "true"},
                       {"task.requirements.level", "{height: {link: BODY0, above: 17.5 cm}}"}};
  if (physics == "bullet") options.overrides.push_back({"uncertain.contact.model", "{choice: [dantzig]}"});
  return load_scenario(testing::data("scenarios/quadruped_curb.yaml"), options);
}

void check(const std::string& physics) {
  const Scenario scenario = scenario_on(physics);
  const ParticleSource source(scenario, 3, 21);
  std::vector<Particle> particles;
  for (std::uint32_t i = 0; i < 21; ++i) particles.push_back(source.fabricate(i, source.draw(i)));
  BlockRun run(scenario, scenario.policies.back(), 3);
  const std::vector<TraceRecord> unwatched = run.run(particles);
  Watcher watcher;
  const std::vector<TraceRecord> watched = run.run(particles, nullptr, {.observer = &watcher});
  ASSERT_EQ(watcher.traces.size(), particles.size());
  std::map<double, int> ends;
  for (std::size_t i = 0; i < watched.size(); ++i) {
    const TraceRecord& trace = watched[i];
    EXPECT_EQ(trace.digest, unwatched[i].digest);
    EXPECT_EQ(trace.margins, unwatched[i].margins);
    const Seen& seen = watcher.traces.at(trace.particle);
    EXPECT_EQ(seen.time, trace.end_time);
    for (std::uint32_t k = 0; k < seen.steps.size(); ++k) ASSERT_EQ(seen.steps[k], k);
    EXPECT_EQ(seen.steps.size() - 1, std::lround(trace.end_time / scenario.timing.step));
    EXPECT_EQ(seen.q, trace.q);
    EXPECT_EQ(seen.v, trace.v);
    EXPECT_EQ(seen.least, trace.margins) << "no requirement of the curb has a window";
    EXPECT_EQ(seen.objective.size(), leaves(scenario.task.objective).size());
    ++ends[trace.end_time];
  }
  EXPECT_GT(ends.size(), 2u) << "the traces are meant to end at different times";
}

TEST(Observer, SeesEveryStepOnLanes) { check("lanes"); }
TEST(Observer, SeesEveryStepOnBullet) { check("bullet"); }

/// Says what it sees of the sensors.
class Sighted : public TraceObserver {
 public:
  explicit Sighted(bool looks) : looks_(looks) {}
  bool see(const StepView& step) override {
    if (step.step != 2) return true;
    sensed = step.sensed.joint_position.rows(), truth = step.truth.joint_position.rows();
    return true;
  }
  bool senses() const override { return looks_; }
  int sensed = -1, truth = -1;

 private:
  bool looks_;
};

// Claim: who does not look at sensors is shown none, whoever has looked before in the same block; and traces are the
// same.
TEST(Observer, SensorsAreReadForThoseWhoLook) {
  const Scenario scenario = scenario_on("lanes");
  const ParticleSource source(scenario, 3, 2);
  const std::vector<Particle> particles = {source.fabricate(0, source.draw(0)), source.fabricate(1, source.draw(1))};
  BlockRun run(scenario, scenario.policies.back(), 3);
  const std::uint64_t digest = run.run(particles)[0].digest;
  for (const bool looks : {false, true, false}) {
    Sighted observer(looks);
    EXPECT_EQ(run.run(particles, nullptr, {.observer = &observer})[0].digest, digest);
    EXPECT_EQ(observer.sensed, looks ? scenario.model.na() : 0);
    EXPECT_EQ(observer.truth, looks ? scenario.model.na() : 0);
  }
}

// Claim: a run in parts has the bits of a whole one, is judged by them, and tells events as they happen; stop() ends
// the traces that are meant, where they are, and no others.
TEST(Observer, RunsInPartsAreTheSame) {
  Scenario scenario = scenario_on("lanes");
  scenario.recording.events = true;
  const ParticleSource source(scenario, 3, 11);
  std::vector<Particle> particles;
  for (std::uint32_t i = 0; i < 11; ++i) particles.push_back(source.fabricate(i, source.draw(i)));
  BlockRun run(scenario, scenario.policies.back(), 3);
  const std::vector<TraceRecord> whole = run.run(particles);
  run.begin(particles);
  std::size_t steps = 1, events = 0;
  for (; run.step(); ++steps) events = std::max(events, run.events(0).size());
  EXPECT_FALSE(run.step()) << "all have ended";
  EXPECT_GT(events, 0u);
  EXPECT_GE(steps, std::lround(whole[0].end_time / scenario.timing.step));
  for (std::size_t i = 0; i < whole.size(); ++i) {
    EXPECT_EQ(run.records()[i].digest, whole[i].digest);
    EXPECT_EQ(run.records()[i].outcome, whole[i].outcome);
    EXPECT_EQ(run.records()[i].margins, whole[i].margins);
    EXPECT_EQ(run.records()[i].events.size(), whole[i].events.size());
  }

  const std::vector<Particle> eight(particles.begin(), particles.begin() + kLanes);
  run.begin(eight);
  for (int k = 0; k < 5; ++k) ASSERT_TRUE(run.step());
  run.stop(LaneMask(0b10));
  EXPECT_TRUE(run.records()[1].stopped);
  EXPECT_EQ(run.records()[1].end_time, 5 * scenario.timing.step);
  while (run.step()) continue;
  run.stop(LaneMask::all());  // nothing is left to be stopped
  for (std::size_t i = 0; i < eight.size(); ++i) {
    EXPECT_EQ(run.records()[i].stopped, i == 1);
    EXPECT_EQ(run.records()[i].digest == whole[i].digest, i != 1);
  }
  EXPECT_EQ(run.run(particles)[5].digest, whole[5].digest) << "nothing of it is left";
}

}  // namespace
}  // namespace graze
