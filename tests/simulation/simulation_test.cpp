// Claim: the simulator can be called. Simulations know nothing of each other; a trace has the bits that a campaign
// gives it; it can be watched, ended early and begun from any state at any control step, in any company.
#include "simulation/simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <thread>

#include "simulation/invalid_reason.h"
#include "tests/jobs/program.h"
#include "tests/message_of.h"
#include "tests/trace_bits.h"

namespace graze {
namespace {

using testing::message_of;

using testing::all_bits_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

Scenario curb(const std::string& end = "0.15 s") {
  ScenarioOptions options;
  options.overrides = {{"time.end", end}};
  return load_scenario(testing::data("scenarios/quadruped_curb.yaml"), options);
}

Scenario pendulum() { return load_scenario(testing::data("scenarios/pendulum.yaml")); }

std::vector<std::string> bits(const std::vector<TraceRecord>& traces) {
  std::vector<std::string> out;
  for (const TraceRecord& trace : traces) out.push_back(all_bits_of(trace));
  return out;
}

/// Keeps the state of every step by particle; ends the traces of one particle at a step.
class Keeper : public TraceObserver {
 public:
  bool see(const StepView& step) override {
    State& state = states[{step.particle, step.step}];
    const BlockState& all = step.physics.state();
    state.q.resize(all.q.rows());
    state.v.resize(all.v.rows());
    for (int i = 0; i < all.q.rows(); ++i) state.q[i] = all.q(i, step.lane);
    for (int i = 0; i < all.v.rows(); ++i) state.v[i] = all.v(i, step.lane);
    return step.particle != ended || step.step < at;
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, State> states;
  std::uint32_t ended = 0xffffffff, at = 0;
};

TEST(Simulation, GivesTheSameBitsBesideAnother) {
  const Simulation legs(curb());
  const Simulation rod(pendulum());
  const std::string policy = legs.scenario().policies.front().name;
  const auto expected_legs = bits(Simulator(legs, policy).run(0, 11));
  const auto expected_rod = bits(Simulator(rod, rod.scenario().policies.front().name).run(0, 50));
  std::vector<std::string> a, b, c;
  const Simulation again(curb());
  std::thread one([&] { a = bits(Simulator(legs, policy).run(0, 11)); });
  std::thread two([&] { b = bits(Simulator(again, policy).run(0, 11)); });
  std::thread three([&] { c = bits(Simulator(rod, rod.scenario().policies.front().name).run(0, 50)); });
  one.join();
  two.join();
  three.join();
  EXPECT_EQ(a, expected_legs);
  EXPECT_EQ(b, expected_legs);
  EXPECT_EQ(c, expected_rod);
}

TEST(Simulation, NamesTheNearestPolicy) {
  const Simulation simulation(curb());
  EXPECT_THAT(message_of([&] { Simulator(simulation, "step/3c"); }),
              HasSubstr("step/3c: no such policy; nearest: step/3cm"));
}

TEST(Simulation, EndsTracesThatHaveBeenSeenEnough) {
  const Simulation simulation(curb());
  Simulator simulator(simulation, simulation.scenario().policies.front().name);
  const std::vector<TraceRecord> whole = simulator.run(0, 9);
  Keeper keeper;
  keeper.ended = 4;
  keeper.at = 7;
  const std::vector<TraceRecord> cut = simulator.run(0, 9, {.observer = &keeper});
  for (std::size_t i = 0; i < whole.size(); ++i) {
    EXPECT_EQ(cut[i].stopped, i == 4);
    if (i == 4) continue;
    EXPECT_EQ(all_bits_of(cut[i]), all_bits_of(whole[i])) << i;
  }
  EXPECT_DOUBLE_EQ(cut[4].end_time, 7 * simulation.scenario().timing.step);
  EXPECT_FALSE(keeper.states.contains({4, 8}));
  EXPECT_EQ(cut[4].q, std::vector<double>(keeper.states[{4, 7}].q.begin(), keeper.states[{4, 7}].q.end()));
}

/// A ball in flight has no memory but its state: from any moment on it flies on with the same bits.
TEST(Simulation, BeginsFromAnyStateAtAnyControlStep) {
  testing::TemporaryFolder folder;
  testing::write_ball(folder);
  const Simulation simulation(load_scenario(folder / "ball.yaml"));
  const std::string policy = simulation.scenario().policies.front().name;
  Simulator simulator(simulation, policy);
  Keeper keeper;
  const std::vector<TraceRecord> whole = simulator.run(0, 12, {.observer = &keeper});
  std::vector<Beginning> beginnings;
  for (std::uint32_t i = 0; i < 12; ++i) beginnings.push_back({i * 1e-3, keeper.states[{i, i}]});
  const std::vector<TraceRecord> later = simulator.run(0, 12, {.beginnings = beginnings});
  for (std::uint32_t i = 0; i < 12; ++i) {
    EXPECT_EQ(later[i].q, whole[i].q) << i;
    EXPECT_EQ(later[i].v, whole[i].v) << i;
    EXPECT_EQ(later[i].end_time, whole[i].end_time);
    EXPECT_EQ(later[i].outcome, whole[i].outcome);
    const Particle particle = simulation.particle(i);
    const auto alone = Simulator(simulation, policy).run({&particle, 1}, {.beginnings = {&beginnings[i], 1}});
    EXPECT_EQ(all_bits_of(alone.front()), all_bits_of(later[i])) << "alone";
  }
}

/// On a robot with a gait, contacts and noise: the same bits in any company.
TEST(Simulation, BeginsARobotInMotionTheSameInAnyCompany) {
  const Simulation simulation(curb());
  const std::string policy = simulation.scenario().policies.front().name;
  Simulator simulator(simulation, policy);
  Keeper keeper;
  simulator.run(0, 10, {.observer = &keeper});
  const auto per_control = static_cast<std::uint32_t>(simulation.scenario().timing.steps_per_control());
  std::vector<Beginning> beginnings;
  for (std::uint32_t i = 0; i < 10; ++i) {
    const std::uint32_t step = 3 * (i % 4) * per_control;
    beginnings.push_back({step * simulation.scenario().timing.step, keeper.states[{i, step}]});
  }
  const std::vector<TraceRecord> together = simulator.run(0, 10, {.beginnings = beginnings});
  for (std::uint32_t i = 0; i < 10; ++i) {
    const auto alone = Simulator(simulation, policy).run(i, 1, {.beginnings = {&beginnings[i], 1}});
    EXPECT_EQ(all_bits_of(alone.front()), all_bits_of(together[i])) << i;
    EXPECT_DOUBLE_EQ(together[i].end_time, simulation.scenario().timing.end) << together[i].invalid_reason;
  }
}

TEST(Simulation, RefusesBeginningsThatNoTraceCanHave) {
  const Simulation simulation(curb());
  Simulator simulator(simulation, simulation.scenario().policies.front().name);
  const State state = simulation.particle(0).initial;
  const auto refused = [&](const Beginning& beginning) {
    return message_of([&] { simulator.run(0, 1, {.beginnings = {&beginning, 1}}); });
  };
  EXPECT_THAT(refused({0.0001, state}), HasSubstr("cannot begin at 0.0001 s"));
  EXPECT_THAT(refused({-0.01, state}), HasSubstr("cannot begin at -0.01 s"));
  EXPECT_THAT(refused({0.15, state}), HasSubstr("before the end (0.15 s)"));
  EXPECT_THAT(refused({std::nan(""), state}), HasSubstr("cannot begin at nan s"));
  State wrong = state;
  wrong.q.conservativeResize(3);
  EXPECT_THAT(refused({0, wrong}), HasSubstr("a state of 3 positions"));
  wrong = state;
  wrong.v[0] = std::nan("");
  EXPECT_THAT(refused({0, wrong}), HasSubstr("all finite"));
  wrong = state;
  wrong.q[0] = 3;
  EXPECT_THAT(refused({0, wrong}), HasSubstr("quaternion of length"));
  EXPECT_THAT(message_of([&] {
                const std::vector<Beginning> two(2, Beginning{0, state});
                simulator.run(0, 3, {.beginnings = two});
              }),
              HasSubstr("2 beginnings for 3 particles"));
  EXPECT_EQ(all_bits_of(simulator.run(0, 1, {.beginnings = {}}).front()), all_bits_of(simulator.run(0, 1).front()));
}

TEST(Simulation, SaysWhyAParticleCannotBe) {
  testing::TemporaryFolder folder;
  testing::write_ball(folder);
  ScenarioOptions options;
  options.overrides = {{"uncertain.robot.link.ball.density", "{choice: [200, 1e-323]}"}};
  const Simulation simulation(load_scenario(folder / "ball.yaml", options));
  const std::vector<TraceRecord> traces = Simulator(simulation, "still").run(0, 20);
  ASSERT_EQ(traces.size(), 20u);
  int impossible = 0;
  for (std::uint32_t i = 0; i < 20; ++i) {
    EXPECT_EQ(traces[i].particle, i);
    if (traces[i].outcome != Outcome::invalid) continue;
    ++impossible;
    EXPECT_THAT(traces[i].invalid_reason, HasSubstr("ball"));
  }
  EXPECT_GT(impossible, 0);
  EXPECT_LT(impossible, 20);
}

// Beyond 1e6 m a double hides gaps: a robot that has gone there is not judged.
TEST(Simulation, ATraceThatGoesAstrayIsInvalid) {
  testing::TemporaryFolder folder;
  testing::write_ball(folder);
  const auto outcome = [&](const std::string& velocity) {
    ScenarioOptions options;
    options.overrides = {{"robot.initial.velocity", "[" + velocity + ", 0, 0]"}};
    return Simulator(Simulation(load_scenario(folder / "ball.yaml", options)), "still").run(0, 1).front();
  };
  EXPECT_NE(outcome("1.9e7").outcome, Outcome::invalid) << "950 km in 50 ms";
  const TraceRecord astray = outcome("1e8");
  EXPECT_EQ(astray.outcome, Outcome::invalid);
  EXPECT_THAT(astray.invalid_reason, HasSubstr("step 11 (0.011 s), nothing touched: base.x is"));
  EXPECT_THAT(astray.invalid_reason, HasSubstr("beyond 1e+06 m"));
  EXPECT_NEAR(astray.end_time, 0.010, 0.0015);
}

// A gain of a controller that is far too large: the reason tells whose torque it was.
TEST(Simulation, NamesTheJointOfATorqueBeyondAllMotors) {
  ScenarioOptions options;
  options.overrides = {{"uncertain", "!replace {}"},
                       {"time.end", "0.9 s"},
                       {"policies.direct.control", "!replace {inverse_dynamics: {kp: 1e15, kd: 60, model: none}}"}};
  const Simulation arm(load_scenario(testing::data("scenarios/pick_ball.yaml"), options));
  const TraceRecord trace = Simulator(arm, "direct").run(0, 1).front();
  EXPECT_EQ(trace.outcome, Outcome::invalid);
  EXPECT_THAT(trace.invalid_reason,
              ::testing::ContainsRegex("the controller asks joint [A-Z0-9_]+ for -?[0-9.e+]+ N m"));
}

TEST(Simulation, NamesAControllerThatAsksForTooMuch) {
  ActuatorCommand command(3);
  const Model model = load_scenario(testing::data("scenarios/quadruped_trot.yaml")).model;
  EXPECT_EQ(controller_failure(model, command, 0), "");
  command.tau(2, 0) = -3e10, command.tau(1, 0) = 9e4;
  EXPECT_EQ(controller_failure(model, command, 0),
            "the controller asks joint " + model.bodies[model.actuated[2]].joint + " for -3e+10 N m: ");
  command.q(1, 0) = std::nan("");
  EXPECT_EQ(
      controller_failure(model, command, 0),
      "the controller asks joint " + model.bodies[model.actuated[1]].joint + " for a position that is not finite: ");
}

// A controller that asks for what is no number makes its traces invalid, and the reason names it and the joint.
TEST(Simulation, NamesAControllerThatFails) {
  ScenarioOptions options;
  options.overrides = {{"time.end", "0.1 s"}, {"policies.trot.control", "{inverse_dynamics: {kp: 1e308, kd: 1e308}}"}};
  const Simulation robot(load_scenario(testing::data("scenarios/quadruped_trot.yaml"), options));
  for (const TraceRecord& trace : Simulator(robot, "trot").run(0, 3)) {
    EXPECT_EQ(trace.outcome, Outcome::invalid);
    EXPECT_THAT(trace.invalid_reason, HasSubstr("the controller asks joint LF_X_1 for a torque that is not finite"));
  }
}

/// The scenario of a robot of its own: what a designer would write of it.
Scenario own_scenario(const Scenario& scenario, const World& world) {
  Scenario out = scenario;
  out.world = std::make_shared<const World>(world);
  out.model = compile(world);
  return out;
}

/// State and memory at 50 ms.
class MomentTaker : public TraceObserver {
 public:
  bool see(const StepView& step) override {
    if (step.step < 50) return true;
    const BlockState& all = step.physics.state();
    taken = {step.time, {all.q.column(step.lane), all.v.column(step.lane)}, step.remember()};
    return false;
  }
  Beginning taken;
};

/// Of trackers of joints, of one that computes with the nominal legs and of one that computes with the nominal masses.
const std::vector<std::string> kPlanners = {"{joint_pd: {kp: 20, kd: 0.5}}", "{prescribed: {}}",
                                            "{operational_pd: {kp: 1000, kd: 20}}",
                                            "{inverse_dynamics: {kp: 1e4, kd: 200}}"};

// Designs that plan with their own numbers share blocks: each has the bits that it has alone, in a scenario of its own,
// also where more of them than lanes take turns and some fall early.
TEST(Simulation, InformedDesignsHaveTheirBitsInSharedBlocks) {
  for (const std::string& planner : kPlanners) {
    ScenarioOptions options;
    options.overrides = {{"time.end", "0.12 s"}, {"policies.trot.control", planner}};
    Scenario trot = load_scenario(testing::data("scenarios/quadruped_trot.yaml"), options);
    trot.space = {};
    const Fabricator fabricator(trot.world,
                                {"robot.link.LF_LEG_2.length", "robot.link.BODY0.mass", "contact.friction"});
    const PolicySpec& policy = trot.policies.front();
    std::vector<Particle> designs;
    std::vector<Scenario> own_scenarios;
    std::vector<std::string> alone;
    for (int i = 0; i < 11; ++i) {
      const std::vector<double> values = {0.077 + 1e-3 * i, i % 3 ? 2.6 : 4.0 + i, i == 4 ? 0.05 : 1.0};
      designs.push_back(fabricator.fabricate(0, values));
      const Scenario own = own_scenario(trot, fabricator.perturbed(values));
      const Particle nominal = Fabricator(own.world, {}).nominal();
      alone.push_back(all_bits_of(BlockRun(own, own.policies.front(), 1).run({&nominal, 1}).front()));
      own_scenarios.push_back(own);
    }
    const auto later = [&](const Beginning& from) {
      std::vector<std::string> out;
      for (const Scenario& own : own_scenarios) {
        const Particle robot = Fabricator(own.world, {}).nominal();
        BlockRun one(own, own.policies.front(), 1);
        out.push_back(all_bits_of(one.run({&robot, 1}, nullptr, {.beginnings = {&from, 1}}).front()));
      }
      return out;
    };
    BlockRun run(trot, policy, 1);
    EXPECT_EQ(bits(run.run(designs, nullptr, {.informed = true})), alone);
    // The same from a moment that the nominal robot has come to, with what its controller knew then.
    MomentTaker taker;
    const Particle nominal = Fabricator(trot.world, {}).nominal();
    run.run({&nominal, 1}, nullptr, {.observer = &taker});
    const std::vector<Beginning> beginnings(designs.size(), taker.taken);
    EXPECT_EQ(bits(run.run(designs, nullptr, {.beginnings = beginnings, .informed = true})), later(taker.taken));
    EXPECT_NE(bits(run.run(designs)), alone) << "who knows the nominal robot alone plans otherwise";
    EXPECT_EQ(bits(run.run(designs)), bits(BlockRun(trot, policy, 1).run(designs))) << "and knows no other any more";
    EXPECT_EQ(bits(run.run(designs, nullptr, {.informed = true})), alone);
  }
}

}  // namespace
}  // namespace graze
