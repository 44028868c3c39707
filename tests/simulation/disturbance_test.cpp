// Claim: pushes give the momentum that they say, payloads the mass, under both back ends, at any time within steps, and
// whoever is in the block beside them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "simulation/disturbances.h"
#include "simulation/simulation.h"
#include "tests/jobs/program.h"
#include "tests/trace_bits.h"

namespace graze {
namespace {

/// A box of 2 kg in free space, inertia 0.02, 0.03 and 0.04 kg m^2 about its origin.
Scenario box(const std::string& physics, const std::string& disturbances, const std::string& more = "") {
  const std::string urdf = std::string(GRAZE_SOURCE_DIR) + "/tests/simulation/robots/box.urdf";
  return parse_scenario("graze: 1\nrobot: {urdf: " + urdf +
                            ", initial: {position: [0, 0, 1]}}\ngravity: 0\ntime: {end: 0.1 s, step: 1 ms}\n"
                            "policies: {still: {hold: {}, control: {torque: {}}}}\nphysics: " +
                            physics + "\ndisturbances: {" + disturbances + "}\n" + more,
                        "box.yaml");
}

/// v at the end: angular, then linear.
Eigen::VectorXd end_velocity(const Scenario& scenario) {
  const Simulation simulation{Scenario(scenario)};
  const TraceRecord trace = Simulator(simulation, simulation.scenario().policies[0].name).run(0, 1).front();
  EXPECT_NE(trace.outcome, Outcome::invalid) << trace.invalid_reason;
  return Eigen::Map<const Eigen::VectorXd>(trace.v.data(), static_cast<Eigen::Index>(trace.v.size()));
}

class Disturbances : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(BackEnds, Disturbances, ::testing::Values("lanes", "bullet"));

// An impulse p gives p / m, whenever it comes; a force f its f t / m, also where it begins and ends within steps.
TEST_P(Disturbances, GiveTheMomentumThatTheySay) {
  constexpr double kRounding = 1e-12;
  for (const char* at : {"0 s", "20 ms", "33.4 ms"}) {
    const Eigen::VectorXd v =
        end_velocity(box(GetParam(), std::string("a: {push: box, impulse: 0.6 N s, azimuth: 90 deg, at: ") + at + "}"));
    EXPECT_NEAR((v.tail<3>() - Vec3(0, 0.3, 0)).norm(), 0, kRounding) << at;
    EXPECT_NEAR(v.head<3>().norm(), 0, kRounding);
  }
  const Eigen::VectorXd v =
      end_velocity(box(GetParam(), "a: {push: box, force: 10 N, duration: 25.5 ms, elevation: -90 deg, at: 40.25 ms}"));
  EXPECT_NEAR((v.tail<3>() - Vec3(0, 0, -0.1275)).norm(), 0, kRounding);
  EXPECT_NEAR(end_velocity(box(GetParam(), "a: {push: box, impulse: 0.6 N s, duration: 50 ms, at: 80 ms}"))[3], 0.12,
              kRounding)
      << "the trace ends in the middle of it";
}

// Beside the centre of mass an impulse turns the body: I w = r x p, at the instant. Here r is along x, p along y.
TEST_P(Disturbances, TurnWhatTheyMiss) {
  const Eigen::VectorXd v =
      end_velocity(box(GetParam(), "a: {push: box, impulse: 0.2 N s, azimuth: 90 deg, at: 99 ms, point: [0.1, 0, 0]}"));
  EXPECT_NEAR(v[2], 0.1 * 0.2 / 0.04, 1e-9);
  EXPECT_NEAR(v[4], 0.1, 1e-9);
}

// A payload takes nothing from the velocity when it comes, and is pushed with the rest from then on. At the origin of a
// box of 2 kg, 1 kg makes it 3 kg; at 0.3 m above it the same push turns it about the common centre, 0.1 m above it.
TEST_P(Disturbances, LoadTheBody) {
  const char* first = "a: {push: box, impulse: 0.6 N s, at: 10 ms}, ";
  Eigen::VectorXd v = end_velocity(box(GetParam(), std::string(first) + "sack: {payload: box, mass: 1 kg, at: 50 ms}"));
  EXPECT_NEAR(v[3], 0.3, 1e-12) << "the payload came with the box's velocity";
  v = end_velocity(box(GetParam(), std::string(first) + "sack: {payload: box, mass: 1 kg, at: 50 ms}, "
                                                        "b: {push: box, impulse: 0.6 N s, at: 70 ms}"));
  EXPECT_NEAR(v[3], 0.5, 1e-12);
  v = end_velocity(box(GetParam(),
                       "sack: {payload: box, mass: 1 kg, at: 50 ms, point: [0, 0, 0.3]}, "
                       "b: {push: box, impulse: 0.6 N s, at: 99 ms}"));
  // About the common centre: I_yy = 0.03 + 2 0.1^2 + 1 0.2^2 = 0.09; the push passes 0.1 m below it, along x.
  EXPECT_NEAR(v[1], -0.1 * 0.6 / 0.09, 1e-9);
  EXPECT_NEAR(v[3], 0.2 + 0.1 * v[1] * -1 * 1, 2e-3) << "origin: that of the centre, 0.2 m/s, and w x r";
}

// A link of a tree takes what its joint lets it: the pendulum's ball, L from the hinge, gets w = L p / I, and the rest
// goes into the post. I = 0.0172 kg m^2 as the URDF has it.
TEST_P(Disturbances, PushALinkOfATree) {
  ScenarioOptions options;
  options.overrides = {{"physics", GetParam()},
                       {"uncertain", "~"},
                       {"gravity", "0"},
                       {"robot.initial.joints.hinge", "0"},
                       {"time", "{end: 50 ms, step: 1 ms}"},
                       {"task", "~"},
                       {"disturbances", "{a: {push: ball, impulse: 0.01 N s, at: 49 ms}}"}};
  const Scenario scenario = load_scenario(testing::data("scenarios/pendulum.yaml"), options);
  const double rod = 0.0407150408 * 0.15 * 0.15 + 0.000305525666, ball = 0.176714587 * 0.09 + 4.41786467e-05;
  // The damper of 0.01 N m s/rad, implicit, takes 1 / (1 + h d / I) of it; the rod hangs down, +x is against its axis.
  const double inertia = rod + ball, w = -0.3 * 0.01 / inertia / (1 + 1e-3 * 0.01 / inertia);
  EXPECT_NEAR(end_velocity(scenario)[0], w, 1e-6 * std::abs(w));
}

/// What a trace shows of the box at the end of one step.
class Glance : public TraceObserver {
 public:
  explicit Glance(std::uint32_t step) : step_(step) {}
  bool see(const StepView& view) override {
    if (view.step != step_) return true;
    acceleration = view.physics.state().a(3, view.lane);
    for (const Contact& contact : view.physics.contacts(view.lane)) pressed += contact.normal_impulse();
    return true;
  }
  double acceleration = 0, pressed = 0;  // m/s^2 along x; N s

 private:
  std::uint32_t step_;
};

Glance glance(const Scenario& scenario, std::uint32_t step) {
  const Simulation simulation{Scenario(scenario)};
  Glance out(step);
  Simulator(simulation, "still").run(0, 1, {.observer = &out});
  return out;
}

// Accelerometers feel a push: a = p / (m h) in the step that it falls into, and nothing in the next.
TEST_P(Disturbances, AreFeltAsAcceleration) {
  const Scenario scenario = box(GetParam(), "a: {push: box, impulse: 0.6 N s, at: 20 ms}");
  EXPECT_NEAR(glance(scenario, 21).acceleration, 0.6 / (2 * 1e-3), 1e-9);
  EXPECT_NEAR(glance(scenario, 22).acceleration, 0, 1e-9);
}

// On the ground a payload's weight is borne with the box's: 3 kg instead of 2. False to 1 %, which Bullet's contacts
// leave.
TEST_P(Disturbances, WeighWhatTheyWeigh) {
  ScenarioOptions options;
  options.overrides = {{"gravity", "9.81"},
                       {"environment", "{ground: {plane: z}}"},
                       {"robot.initial", "{height: on_ground}"},
                       {"time.end", "0.5 s"}};
  Scenario scenario = box(GetParam(), "sack: {payload: box, mass: 1 kg, at: 0.2 s}");
  scenario = parse_scenario(scenario.text, "box.yaml", options);
  EXPECT_NEAR(glance(scenario, 190).pressed, 2 * 9.81e-3, 0.01 * 2 * 9.81e-3);
  EXPECT_NEAR(glance(scenario, 490).pressed, 3 * 9.81e-3, 0.01 * 3 * 9.81e-3);
}

// What pushes give is no energy out of nothing, however strong they are.
TEST_P(Disturbances, AreNoEnergyOutOfNothing) {
  const Eigen::VectorXd v =
      end_velocity(box(GetParam(), "a: {push: box, force: 500 N, duration: 80 ms, at: 5 ms, point: [0, 0, 1 cm]}"));
  EXPECT_GT(v.tail<3>().norm(), 10);
}

// A trace's bits do not depend on its lane or its neighbours, pushed or not.
TEST_P(Disturbances, LeaveNeighboursAlone) {
  const Scenario scenario =
      box(GetParam(),
          "a: {push: box, impulse: 0.1 N s, duration: 10 ms, at: 20 ms}, sack: {payload: box, mass: 0.1 kg, "
          "at: 30 ms, point: [1 cm, 2 cm, 3 cm]}",
          "uncertain: {disturbances.a.at: {uniform: [0 s, 90 ms]}, disturbances.a.azimuth: {uniform: [-90 deg, 90 "
          "deg]}, disturbances.a.impulse: {uniform: [-1, 1]}, disturbances.a.point.x: {normal: {std: 1 cm}}, "
          "disturbances.sack.mass: {uniform: [0, 1]}, disturbances.sack.at: {uniform: [0 s, 0.2 s]}}\n");
  const Simulation simulation{Scenario(scenario)};
  Simulator together(simulation, "still"), alone(simulation, "still");
  const std::vector<TraceRecord> all = together.run(0, 13);
  for (std::uint32_t i = 0; i < 13; ++i) {
    EXPECT_EQ(testing::all_bits_of(alone.run(i, 1).front()), testing::all_bits_of(all[i])) << i;
  }
  EXPECT_NE(all[0].digest, all[1].digest);
}

// Claim: the shares of all steps make the whole push, wherever it begins.
TEST(PushShare, AddsUpToOne) {
  for (const double at : {0.0, 0.0125, 0.01371}) {
    for (const double duration : {0.0, 5e-324, 1e-13, 1e-11, 1e-9, 1e-7, 0.0004, 0.001, 0.0333}) {
      BodyDisturbance push;
      push.at = at;
      push.duration = duration;
      double sum = 0;
      for (int step = 0; step < 100; ++step) sum += push_share(push, step * 1e-3, 1e-3);
      EXPECT_NEAR(sum, 1, 1e-9) << at << " " << duration;
    }
  }
}

}  // namespace
}  // namespace graze
