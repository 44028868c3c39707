// Claim: a prediction is what simulating the particles from the estimate on gives: analytic where the physics is, the
// same for any number of threads, again by its number of particles, and none of it from blocks that were cut off.
#include "simulation/predictor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/jobs/program.h"
#include "tests/message_of.h"

namespace graze {
namespace {

using ::testing::HasSubstr;
using testing::message_of;

/// A ball in the air, and the same policy by two names.
struct Balls : ::testing::Test {
  Balls() { testing::write_ball(folder); }
  Simulation simulation(std::vector<Override> overrides = {}) const {
    ScenarioOptions options;
    options.overrides = {{"policies.again", "{hold: {}, control: {torque: {}}}"}};
    options.overrides.insert(options.overrides.end(), overrides.begin(), overrides.end());
    return Simulation(load_scenario(folder / "ball.yaml", options));
  }
  /// At rest 20 cm up, its height known to 1 cm.
  static StateEstimate estimate(const Simulation& of) {
    StateEstimate out;
    out.state = initial_state(*of.scenario().world, of.nominal());
    out.covariance = Eigen::MatrixXd::Zero(12, 12);
    out.covariance(5, 5) = 1e-4;
    return out;
  }
  testing::TemporaryFolder folder;
};

void expect_same(const Prediction& a, const Prediction& b) {
  EXPECT_EQ(a.particles, b.particles);
  EXPECT_EQ(a.best, b.best);
  ASSERT_EQ(a.candidates.size(), b.candidates.size());
  for (std::size_t i = 0; i < a.candidates.size(); ++i) {
    const CandidatePrediction &one = a.candidates[i], &other = b.candidates[i];
    EXPECT_EQ(one.by_particle, other.by_particle);
    EXPECT_EQ(one.outcomes, other.outcomes);
    EXPECT_EQ(one.objective.mean(), other.objective.mean()) << "to the last bit";
    EXPECT_EQ(one.objective.std(), other.objective.std());
    EXPECT_EQ(one.place, other.place);
  }
}

// It falls by g t^2 / 2 = 12.3 mm in 50 ms (explicit steps of 1 ms: 12.5 mm), so it ends below 20 cm if it is no more
// than that above its estimate: Phi(1.25) = 89.4 %. Four standard errors of 2000 particles are 2.7 %: a false alarm in
// 16000.
TEST_F(Balls, FallAsTheirEstimateSays) {
  const Simulation balls = simulation();
  const Prediction told = Predictor(balls, {"still", "again"}).predict(estimate(balls), {.particles = 2000});
  ASSERT_EQ(told.candidates.size(), 2u);
  const CandidatePrediction& one = told.candidates.front();
  EXPECT_EQ(told.particles, 2000u);
  EXPECT_EQ(one.valid(), 2000u);
  EXPECT_NEAR(one.rate, 0.8944, 0.027);
  EXPECT_LT(one.low, 0.8944 + 0.027);
  EXPECT_GT(one.high, one.rate);
  EXPECT_NEAR(one.objective.mean(), 0.0125, 4 * 0.01 / std::sqrt(2000.0));
  EXPECT_NEAR(one.objective.std(), 0.01, 4 * 0.01 / std::sqrt(4000.0));
  EXPECT_NEAR(one.place, 0.01, 4 * 0.01 / std::sqrt(4000.0));
  EXPECT_DOUBLE_EQ(one.lasted.mean(), 0.05);
  EXPECT_EQ(one.by_particle, told.candidates.back().by_particle) << "common particles";
  EXPECT_EQ(told.best, 0) << "of equals the first";
}

TEST_F(Balls, AreToldTheSameByAnyThreadsAndAgainByTheirNumber) {
  const Simulation balls = simulation();
  const StateEstimate state = estimate(balls);
  Predictor one(balls, {"still", "again"}, 1), three(balls, {"still", "again"}, 3);
  expect_same(one.predict(state, {.particles = 77}), three.predict(state, {.particles = 77}));
  const Prediction hurried = three.predict(state, {.horizon = 0.03, .deadline = 0.2});
  EXPECT_EQ(hurried.particles % 8, 0u);
  ASSERT_GT(hurried.particles, 0u) << "0.2 s for 8 balls in 30 steps";
  expect_same(hurried, one.predict(state, {.horizon = 0.03, .particles = hurried.particles}));
  const Prediction fewer = one.predict(state, {.deadline = 100, .particles = 24});
  EXPECT_EQ(fewer.particles, 24u);
  EXPECT_TRUE(fewer.in_time);
  expect_same(fewer, three.predict(state, {.particles = 24}));
}

// A block that is cut off between two steps leaves nothing behind.
TEST_F(Balls, WhatIsCutOffDoesNotCount) {
  const Simulation balls = simulation({{"time.end", "100 s"}, {"gravity", "0"}});
  const StateEstimate state = estimate(balls);
  Predictor predictor(balls, {"still", "again"}, 2);
  const Prediction none = predictor.predict(state, {.deadline = 2e-3});
  EXPECT_EQ(none.particles, 0u);
  EXPECT_EQ(none.best, -1);
  EXPECT_GE(none.seconds, 1e-3) << "it has tried";
  EXPECT_LT(none.seconds, 1) << "of some 100,000 steps for each";
  EXPECT_TRUE(std::isnan(none.candidates.front().rate));
  const PredictionLimits some = {.horizon = 0.05, .particles = 16};
  expect_same(predictor.predict(state, some), Predictor(balls, {"still", "again"}, 1).predict(state, some));
}

TEST_F(Balls, TheLongerLastingAndThenTheBetterOneIsTheBest) {
  std::vector<CandidatePrediction> told(4);
  for (CandidatePrediction& one : told) one.outcomes = {0, 10, 0, 0};
  const double seconds[] = {1, 2, 2, 2}, margins[] = {0, -2, -1, -3};
  for (std::size_t i = 0; i < told.size(); ++i) {
    told[i].lasted.add(seconds[i]);
    told[i].objective.add(margins[i]);
  }
  EXPECT_EQ(best_of(told), 2);
  told[3].rate = 0.1;
  EXPECT_EQ(best_of(told), 3);
  told[3].outcomes = {0, 0, 0, 10};
  EXPECT_EQ(best_of(told), 2) << "not one without a valid trace";
}

// Mean and covariance of the drawn errors, with what two coordinates have in common: 4000 draws, five standard errors.
TEST_F(Balls, BeginScatteredAsTheCovarianceSays) {
  const Simulation balls = simulation();
  StateEstimate state = estimate(balls);
  Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(12, 12);
  factor(0, 0) = 2e-3, factor(1, 0) = 1e-3, factor(1, 1) = 1e-3;    // rad, about x and y
  factor(5, 5) = 0.01, factor(11, 5) = -0.3, factor(11, 11) = 0.1;  // height and its speed
  state.covariance = factor * factor.transpose();
  const EstimateDraws draws(balls.scenario(), state);
  constexpr int kDraws = 4000;
  Eigen::MatrixXd errors(12, kDraws);
  for (int i = 0; i < kDraws; ++i) {
    const auto [q, v] = draws.draw(balls.particle(static_cast<std::uint32_t>(i)));
    EXPECT_NEAR(q.head<4>().norm(), 1, 1e-12);
    errors.col(i) << 2 * q.segment<3>(1), q.tail<3>() - state.state.q.tail<3>(), v - state.state.v;
  }
  const Eigen::VectorXd mean = errors.rowwise().mean();
  const Eigen::MatrixXd covariance = errors * errors.transpose() / kDraws;
  for (int i = 0; i < 12; ++i) {
    EXPECT_LE(std::abs(mean[i]), 5 * std::sqrt(state.covariance(i, i) / kDraws)) << i;
    for (int k = 0; k <= i; ++k) {
      const double scale = std::sqrt(state.covariance(i, i) * state.covariance(k, k));
      EXPECT_NEAR(covariance(i, k), state.covariance(i, k), 5 * scale * std::sqrt(2.0 / kDraws)) << i << " " << k;
    }
  }
  const Particle particle = balls.particle(7);
  StateEstimate later = state;
  later.time = 0.01;
  EXPECT_EQ(draws.draw(particle).v, draws.draw(particle).v);
  EXPECT_NE(EstimateDraws(balls.scenario(), later).draw(particle).v, draws.draw(particle).v);
}

TEST_F(Balls, SayWhatIsWrongWithAnEstimate) {
  const Simulation balls = simulation();
  Predictor predictor(balls, {"still"}, 1);
  const auto refused = [&](const auto& change, const PredictionLimits& limits = {.particles = 8}) {
    StateEstimate wrong = estimate(balls);
    change(wrong);
    return message_of([&] { predictor.predict(wrong, limits); });
  };
  EXPECT_THAT(refused([](auto& e) { e.covariance(11, 11) = -1; }),
              HasSubstr("row 11 (velocity.base.vz): a variance of -1"));
  EXPECT_THAT(refused([](auto& e) { e.covariance(6, 5) = e.covariance(5, 6) = 1e-4; }),
              HasSubstr("row 6 (velocity.base.wx): the matrix is not positive semi-definite here"));
  EXPECT_THAT(refused([](auto& e) { e.covariance(6, 5) = 1e-5; }), HasSubstr("in column 5, but 0 the other way"));
  EXPECT_THAT(refused([](auto& e) { e.covariance.resize(3, 3); }), HasSubstr("it has 12 of each"));
  EXPECT_THAT(refused([](auto& e) { e.state.q.resize(2); }), HasSubstr("a state of 2 positions"));
  EXPECT_THAT(refused([](auto& e) { e.time = 0.0123456; }), HasSubstr("cannot begin at 0.0123456 s"));
  const auto none = [](auto&) {};
  EXPECT_THAT(refused(none, {.horizon = 0.06, .particles = 8}), HasSubstr("let it be 0.05 s, or time.end 0.06 s"));
  EXPECT_THAT(refused(none, {}), HasSubstr("without a deadline needs a number of particles"));
  EXPECT_THAT(refused(none, {.deadline = -1}), HasSubstr("a deadline of -1 s"));
  EXPECT_THAT(message_of([&] { Predictor(balls, {"still", "still"}); }), HasSubstr("still: is a candidate twice"));
  EXPECT_THAT(message_of([&] { Predictor(balls, {"stil"}); }), HasSubstr("nearest: still"));
}

/// What the sensors read as traces begin, by particle.
class FirstReadings : public TraceObserver {
 public:
  explicit FirstReadings(const Simulation& of) : simulation_(of), readings(64) {}
  bool see(const StepView& view) override {
    if (view.step == view.first) return true;
    readings[view.particle] = read_estimate(simulation_.scenario(), view.sensed, view.lane, view_state(view));
    return false;
  }
  static State view_state(const StepView& view) {
    return {Eigen::VectorXd::Zero(view.physics.state().q.rows()), Eigen::VectorXd::Zero(view.physics.state().v.rows())};
  }

 private:
  const Simulation& simulation_;

 public:
  std::vector<StateEstimate> readings;
};

// Sensors with persistent errors and no jitter read the very estimate where a particle begins that has taken its own
// errors out of it. Attitudes to second order in errors of 5 mrad.
TEST(Predictor, ParticlesBeginWhereTheirOwnSensorsWouldHaveReadTheEstimate) {
  ScenarioOptions options;
  options.overrides = {
      {"uncertain",
       "{robot.joint.*.zero: {normal: {std: 0.02}}, sensor.magnetometer.*: {normal: {std: 5e-3}}, "
       "sensor.gps.*: {normal: {std: 0.1}}, sensor.estimate.z: {normal: {std: 0.1}}, "
       "sensor.estimate.rate.*: {normal: {std: 0.1}}, sensor.estimate.velocity.*: {normal: {std: 0.1}}, "
       "sensor.encoder.*.velocity: {normal: {std: 0.1}}, sensor.encoder.*.position: {normal: {std: 0.1}}}"},
      {"robot.initial.rpy", "[0.3, -0.4, 1]"}};
  const Simulation simulation(load_scenario(testing::data("scenarios/quadruped_curb.yaml"), options));
  StateEstimate estimate;
  estimate.state = initial_state(*simulation.scenario().world, simulation.nominal());
  estimate.state.v.setLinSpaced(0, 1);
  estimate.read_by_sensors = true;
  const EstimateDraws draws(simulation.scenario(), estimate);
  std::vector<Beginning> beginnings;
  for (std::uint32_t i = 0; i < 16; ++i) beginnings.push_back({0, draws.draw(simulation.particle(i))});
  EXPECT_NE(beginnings[0].state.q, beginnings[1].state.q);
  FirstReadings seen(simulation);
  Simulator(simulation, "step/3cm").run(0, 16, {.observer = &seen, .beginnings = beginnings});
  for (std::uint32_t i = 0; i < 16; ++i) {
    const State& read = seen.readings[i].state;
    EXPECT_LT((read.q.head<4>() - estimate.state.q.head<4>()).norm(), 1e-4) << i;
    EXPECT_LT((read.q.tail(read.q.size() - 4) - estimate.state.q.tail(read.q.size() - 4)).norm(), 1e-12) << i;
    EXPECT_LT((read.v - estimate.state.v).norm(), 1e-12) << i;
    EXPECT_EQ(seen.readings[i].covariance.norm(), 0) << "no jitter";
  }
}

/// Keeps state and controller's memory at a step.
class Rememberer : public TraceObserver {
 public:
  explicit Rememberer(std::uint32_t step) : step_(step) {}
  bool see(const StepView& view) override {
    if (view.step != step_) return true;
    const BlockState& all = view.physics.state();
    kept.time = view.time;
    kept.state.q.resize(all.q.rows());
    kept.state.v.resize(all.v.rows());
    for (int i = 0; i < all.q.rows(); ++i) kept.state.q[i] = all.q(i, view.lane);
    for (int i = 0; i < all.v.rows(); ++i) kept.state.v[i] = all.v(i, view.lane);
    kept.memory = view.remember();
    return true;
  }
  Beginning kept;

 private:
  std::uint32_t step_;
};

// An arm that touches nothing, under a lag: with what its controller remembers it goes on by the same bits, without it
// the lag's targets of before are missing. Its neighbour in the block has a lag of its own, and keeps it.
TEST(Predictor, ControllersGoOnWithWhatTheyRemember) {
  ScenarioOptions options;
  options.overrides = {{"time.end", "0.2 s"},
                       {"control", "{lag: {uniform: [10 ms, 40 ms]}}"},
                       {"policies.torque.control", "{joint_pd: {kp: 2000, kd: 60, implicit: false}}"}};
  const Simulation arms(load_scenario(testing::data("scenarios/arm_follow.yaml"), options));
  Simulator simulator(arms, "torque");
  Rememberer seen(100);
  const TraceRecord whole = simulator.run(5, 1, {.observer = &seen}).front();
  const std::vector<Beginning> with(2, seen.kept);
  const std::vector<TraceRecord> later = simulator.run(4, 2, {.beginnings = with});
  EXPECT_EQ(later[1].q, whole.q);
  EXPECT_EQ(later[1].v, whole.v);
  std::vector<Beginning> without = with;
  without[1].memory = nullptr;
  EXPECT_NE(simulator.run(4, 2, {.beginnings = without})[1].q, whole.q);
  ASSERT_NE(arms.particle(4).control_lag, arms.particle(5).control_lag);
  std::vector<Particle> slow = {arms.particle(5), arms.particle(5)};
  slow[1].control_lag = arms.particle(4).control_lag;
  const std::vector<TraceRecord> two = simulator.run(slow, {.beginnings = with});
  EXPECT_EQ(two[0].q, whole.q);
  EXPECT_NE(two[1].q, whole.q) << "by the lag alone";

  EXPECT_THAT(message_of([&] { Simulator(arms, "prescribed").run(4, 2, {.beginnings = with}); }),
              HasSubstr("what a policy of the kind 'joint_trajectory, control joint_pd' remembers is of no use to "
                        "prescribed, which is of the kind 'joint_trajectory, control prescribed'"));
  std::vector<Beginning> before = with;
  before[0].time = 0.05;
  EXPECT_THAT(message_of([&] { simulator.run(4, 2, {.beginnings = before}); }),
              HasSubstr("cannot begin at 0.05 s with what its controller knew at 0.1 s"));
}

TEST(Predictor, TracesEndWhenTheyShall) {
  const Simulation arms(load_scenario(testing::data("scenarios/pendulum.yaml")));
  Simulator simulator(arms, arms.scenario().policies.front().name);
  EXPECT_DOUBLE_EQ(simulator.run(0, 3, {.end = 0.013})[2].end_time, 0.013);
  EXPECT_DOUBLE_EQ(simulator.run(0, 3)[2].end_time, 0.2) << "the next run's own";
  EXPECT_THAT(message_of([&] { simulator.run(0, 3, {.end = 0.0135}); }), HasSubstr("traces cannot end at 0.0135 s"));
  EXPECT_THAT(message_of([&] { simulator.run(0, 3, {.end = 0.201}); }), HasSubstr("no later than the scenario's end"));
}

}  // namespace
}  // namespace graze
