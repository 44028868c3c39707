// Controller, lag, trackers and the simple policies, without physics.

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

#include "engine/control/base_command.h"
#include "engine/control/gait_settings.h"
#include "engine/control/joint_table.h"
#include "engine/control/lag_buffer.h"
#include "engine/control/planar_motion.h"
#include "engine/dynamics/chain.h"
#include "engine/model/measures.h"
#include "tests/engine/control/leg_reference.h"
#include "tests/engine/control/support.h"
#include "tests/message_of.h"

namespace graze {
namespace {

class ControllerTest : public ::testing::Test, protected SensedAtRest {
 protected:
  Controller make(const std::string& yaml) { return Controller(scene.context(), Settings::parse(yaml, "test.yaml")); }
  std::string error(const std::string& yaml) {
    return input_error([&] { make(yaml); });
  }
  void act(Controller& controller, double t, LaneMask active = LaneMask::first(1)) {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (active[lane]) observation.time[lane] = t;
    }
    controller.act(observation, nullptr, active, command);
  }
};

// Policies and trackers are found by name. ("tosses_dice" is of the tests of draws, which share this program.)
TEST_F(ControllerTest, Names) {
  EXPECT_EQ(fmt::format("{}", fmt::join(policy_names(), " ")),
            "gait gait_switch hold joint_trajectory library network python tool_path torque tosses_dice");
  EXPECT_EQ(fmt::format("{}", fmt::join(tracker_names(), " ")),
            "inverse_dynamics joint_pd operational_inverse_dynamics operational_pd prescribed torque");
}

// hold with joint_pd asks the servos for the nominal initial positions, with gains by joint glob.
TEST_F(ControllerTest, HoldByJointPd) {
  Controller controller = make("{hold: {}, control: {joint_pd: {kp: {'*': 20, '*_Y_3': 30}, kd: 0.1}}}");
  controller.start(0, 0, 0);
  act(controller, 0);
  for (int k = 0; k < 12; ++k) {
    EXPECT_EQ(command.q(k, 0), observation.joint_position(k, 0));
    EXPECT_EQ(command.v(k, 0), 0);
    EXPECT_EQ(command.kp(k, 0), k % 3 == 2 ? 30 : 20);
    EXPECT_EQ(command.kd(k, 0), 0.1);
    EXPECT_EQ(command.kp(k, 1), 0);  // the lane was not active
  }
}

// q = q0 + a sin(f t + phase) and its rate, per joint glob, frozen after `until`.
TEST_F(ControllerTest, Sinusoid) {
  Controller controller = make(
      "{joint_trajectory: {sinusoid: {amplitude: {'*_Y_2': 0.3, '*_Y_3': 10 deg}, frequency: 6, phase: {'LF_*': 1}, "
      "until: 2 s}}, control: {joint_pd: {kp: 1}}}");
  controller.start(0, 0, 0);
  act(controller, 0.7);
  EXPECT_NEAR(command.q(1, 0), 0.8 + 0.3 * std::sin(6 * 0.7 + 1), 1e-14);
  EXPECT_NEAR(command.v(1, 0), 0.3 * 6 * std::cos(6 * 0.7 + 1), 1e-14);
  EXPECT_NEAR(command.q(5, 0), -1.2 + M_PI / 18 * std::sin(6 * 0.7), 1e-14);
  EXPECT_EQ(command.q(0, 0), 0.2);
  act(controller, 5);
  EXPECT_NEAR(command.q(1, 0), 0.8 + 0.3 * std::sin(6 * 2.0 + 1), 1e-14);
  EXPECT_EQ(command.v(1, 0), 0);
}

// Linear interpolation is exact on lines, cubic on parabolas away from the ends (Catmull-Rom slopes are exact there),
// on uneven times; both hold the ends.
TEST(JointTable, Interpolates) {
  std::string text = "time, B\n";
  const auto parabola = [](double t) { return 1 + 2 * t - 3 * t * t; };
  for (const double t : {0.0, 0.1, 0.3, 0.35, 0.6, 1.0}) {
    text += std::to_string(t) + "," + std::to_string(parabola(t)) + "\r\n";
  }
  const JointTable linear = JointTable::parse(text, "t.csv", {"A", "B"}, Interpolation::linear);
  const JointTable cubic = JointTable::parse(text, "t.csv", {"A", "B"}, Interpolation::cubic);
  ASSERT_EQ(linear.columns(), std::vector<int>{1});
  EXPECT_NEAR(linear.at(0, 0.2).value, (parabola(0.1) + parabola(0.3)) / 2, 2e-6);  // six decimals in the text
  EXPECT_NEAR(linear.at(0, 0.2).rate, (parabola(0.3) - parabola(0.1)) / 0.2, 2e-5);
  for (const double t : {0.1, 0.2, 0.33, 0.5, 0.59}) {
    EXPECT_NEAR(cubic.at(0, t).value, parabola(t), 1e-5);
    EXPECT_NEAR(cubic.at(0, t).rate, 2 - 6 * t, 1e-4);
  }
  for (const JointTable& table : {linear, cubic}) {
    EXPECT_EQ(table.at(0, -1).value, 1);
    EXPECT_EQ(table.at(0, 2).rate, 0);
    EXPECT_NEAR(table.at(0, 2).value, parabola(1), 1e-6);
  }
}

// A broken table names file, line and rule.
TEST(JointTable, Errors) {
  const auto error = [](const std::string& text) {
    return input_error([&] { JointTable::parse(text, "t.csv", {"LF_X_1", "LF_Y_2"}, Interpolation::linear); });
  };
  EXPECT_EQ(error("t,LF_X_1\n"), "t.csv:1:1: the header must be 'time' and at least one joint, separated by commas");
  EXPECT_EQ(error("time,LF_X_2\n"), "t.csv:1:6: 'LF_X_2' is no actuated joint; did you mean LF_X_1?");
  EXPECT_EQ(error("time,X_1\n"), "t.csv:1:6: 'X_1' is no actuated joint; did you mean LF_X_1?");
  EXPECT_EQ(error("time,LF_X_1,LF_X_1\n"), "t.csv:1:13: 'LF_X_1' stands twice");
  EXPECT_EQ(error("time,LF_X_1\n0,1\n0,2\n"), "t.csv:3:1: time 0 does not lie after the row before; times must grow");
  EXPECT_EQ(error("time,LF_X_1\n0,1\n1\n"), "t.csv:3:2: 1 values; the header has 2 columns");
  EXPECT_EQ(error("time,LF_X_1\n0,nan\n"), "t.csv:2:3: 'nan' is not a finite number");
  EXPECT_EQ(error("time,LF_X_1\n"), "t.csv:1:1: the table has no rows");
}

// The torque policy passes constants through the torque tracker, without any servo.
TEST_F(ControllerTest, Torque) {
  Controller controller = make("{torque: {constant: {'LF_*': 0.5}}, control: {torque: {}}}");
  controller.start(0, 0, 0);
  act(controller, 0);
  EXPECT_EQ(command.tau(0, 0), 0.5);
  EXPECT_EQ(command.tau(3, 0), 0);
  EXPECT_EQ(command.kp(0, 0), 0);
}

// What a tracker follows at t is the newest that was issued at or before t - lag; before that, the initial state. Lanes
// have their own lags and clocks.
TEST_F(ControllerTest, LagIsAZeroOrderHold) {
  Controller controller =
      make("{joint_trajectory: {sinusoid: {amplitude: 1, frequency: 1}}, control: {joint_pd: {kp: 1}}}");
  controller.start(0, 0.005, 0);
  controller.start(1, 0.0125, 0);
  LaneMask both = LaneMask::first(2);
  for (int k = 0; k < 400; ++k) {
    const double t = k * 1e-3;
    act(controller, t, both);
    const auto expected = [&](int steps) { return k < steps ? 0.2 : 0.2 + std::sin((k - steps) * 1e-3); };
    EXPECT_NEAR(command.q(0, 0), expected(5), 1e-12) << k;
    EXPECT_NEAR(command.q(0, 1), expected(13), 1e-12) << k;  // 12.5 ms: the command of 13 steps ago is the newest due
  }
  // Jitter adds to the lag; a sum below 0 counts as 0.
  const double jitter[kLanes] = {-1.0, 0.001};
  observation.time[0] = observation.time[1] = 0.4;
  controller.act(observation, jitter, both, command);
  EXPECT_NEAR(command.q(0, 0), 0.2 + std::sin(0.4), 1e-12);
  EXPECT_NEAR(command.q(0, 1), 0.2 + std::sin(0.4 - 0.014), 1e-12);
  // A lane that starts anew has forgotten everything, whatever its neighbour remembers.
  controller.start(0, 0.005, 0);
  act(controller, 0.0, LaneMask::first(1));
  EXPECT_EQ(command.q(0, 0), 0.2);
}

/// What a lag buffer gives at step k of a lane that is issued the target k, at 1 ms.
double followed(LagBuffer& buffer, int k, double lag, Targets& targets) {
  std::array<double, kLanes> time{}, lags{};
  time[0] = k * 1e-3;
  lags[0] = lag;
  targets.q(0, 0) = k;
  return buffer.pass(time, lags, LaneMask::first(1), targets).q(0, 0);
}

// Claim: however long the lag, memory is taken for no more than a trace, and only as that goes on; and while a lag
// jumps anywhere within the trace, what is followed is what was issued so long ago, as if all had been kept.
TEST(LagBuffer, KeepsNoMoreThanATrace) {
  const Targets none(1, 0);
  for (const double lag : {0.0, 0.18, 180.0, 1e300}) {
    LagBuffer buffer(none, 1e-3, 0.5, TargetKind::joint);
    buffer.start(0, lag);
    EXPECT_LE(buffer.slots(), 100u) << lag;
    Targets targets = none;
    for (int k = 0; k <= 500; ++k) {
      EXPECT_LE(buffer.slots(), std::max<std::size_t>(100, 2 * k)) << "at step " << k;
      if (lag < 0.5) {
        followed(buffer, k, lag, targets);
        continue;
      }
      const int back = (k * 7919) % 500;  // steps
      EXPECT_EQ(followed(buffer, k, back * 1e-3, targets), std::max(0, k - back)) << lag << " at step " << k;
    }
    EXPECT_LE(buffer.slots(), 601u) << lag;
  }
}

// operational_pd: tau = J^T (kp (x_des - x) + kd (xd_des - xd)) is the power-conjugate of a virtual spring and damper:
// tau . v = f . J v for any joint velocity.
TEST_F(ControllerTest, OperationalPdIsAVirtualSpring) {
  const std::string gait =
      "gait: {velocity: [0.1, 0, 0], duration: 0.3, duty: 75 %, liftoff: '[25, 75, 0, 50] %', step_height: 3 cm}";
  Controller controller = make("{" + gait + ", control: {operational_pd: {kp: 1000, kd: 20, implicit: false}}}");
  controller.start(0, 0, 0);
  act(controller, 0.0);  // feet are where they begin: no spring force on standing feet
  const Targets& targets = controller.targets();
  ASSERT_EQ(targets.x.rows(), 12);
  for (int k = 0; k < 12; ++k) observation.joint_position(k, 0) += 0.01 * (k + 1), observation.joint_velocity(k, 0) = k;
  act(controller, 0.001);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(scene.model.nq), v = Eigen::VectorXd::Zero(scene.model.nv);
  q[0] = 1;
  for (int k = 0; k < 12; ++k) {
    q[scene.model.bodies[scene.model.actuated[k]].q] = observation.joint_position(k, 0);
    v[scene.model.bodies[scene.model.actuated[k]].v] = observation.joint_velocity(k, 0);
  }
  const std::vector<Pose> X_WB = reference_poses(scene.model, q);
  double power_of_joints = 0, power_of_forces = 0;
  for (int k = 0; k < 12; ++k) power_of_joints += command.tau(k, 0) * observation.joint_velocity(k, 0);
  const char* feet[] = {"LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT"};
  for (int i = 0; i < 4; ++i) {
    const int frame = scene.model.frame(feet[i]);
    const Vec3 x = frame_pose(scene.model, X_WB, frame).translation();
    const Vec3 xd = reference_jacobian(scene.model, X_WB, scene.model.frames[frame].body, x) * v;
    const Vec3 f = 1000 * (targets.x.vec3(3 * i, 0) - x) + 20 * (targets.xd.vec3(3 * i, 0) - xd);
    power_of_forces += f.dot(xd);
  }
  EXPECT_NEAR(power_of_joints, power_of_forces, 1e-9 * std::abs(power_of_forces));
}

// The implicit damper is the fixed point of f = kd (xd_des - J (v + h M^-1 J^T f)) for the nominal leg, and tends to
// the explicit one as the control period shrinks.
TEST_F(ControllerTest, ImplicitDampingLooksOneStepAhead) {
  const auto make_at = [&](double period, const char* implicit) {
    return Controller(
        scene.context(period),
        Settings::parse(std::string("{gait: {velocity: [0, 0, 0], duration: 0.3, duty: 100 %, liftoff: 0, "
                                    "step_height: 3 cm}, control: {operational_pd: {kp: 0, kd: 20, "
                                    "implicit: ") +
                            implicit + "}}}",
                        "test.yaml"));
  };
  const double h = 1e-3;
  for (int k = 0; k < 12; ++k) observation.joint_velocity(k, 0) = 0.3 * k - 1;
  const auto torques = [&](double period, const char* implicit) {
    Controller controller = make_at(period, implicit);
    controller.start(0, 0, 0);
    act(controller, 0);
    return command.tau.column(0);
  };
  const Eigen::VectorXd implicit = torques(h, "true"), explicit_ = torques(h, "false");
  const char* feet[] = {"LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT"};
  for (int i = 0; i < 4; ++i) {
    const Chain leg(scene.model, scene.model.frame(feet[i]));
    const Chain::Values q = leg.select(scene.initial.q);
    const Eigen::Matrix3d J = leg_jacobian(scene.model, leg, q);
    const Eigen::Vector3d tau = implicit.segment(3 * i, 3), v = observation.joint_velocity.column(0, 3 * i, 3);
    const Eigen::Vector3d ahead = v + h * leg_inertia(scene.model, leg, q).inverse() * tau;
    EXPECT_LT((tau + J.transpose() * 20 * (J * ahead)).norm(), 1e-12 * tau.norm() + 1e-13);
  }
  EXPECT_GT((implicit - explicit_).norm(), 0.1 * explicit_.norm());
  EXPECT_LT((torques(1e-9, "true") - explicit_).norm(), 1e-5 * explicit_.norm());
}

// With a joint tracker the gait's joint targets put the nominal feet exactly on its effector targets, and the joint
// velocities move them as asked.
TEST_F(ControllerTest, GaitJointTargetsReachItsFootTargets) {
  Controller controller = make(
      "{gait: {velocity: [0.2, 0, -0.5], duration: 0.3, duty: 75 %, liftoff: '[25, 75, 0, 50] %', step_height: 4 cm, "
      "stance: {length: 120 %, width: 200 %, height: 90 %}, recovery: false}, control: {joint_pd: {kp: 20, kd: 0.1}}}");
  controller.start(0, 0, 0);
  for (int k = 0; k < 900; ++k) {
    act(controller, k * 1e-3);
    const Targets& targets = controller.targets();
    Eigen::VectorXd q = Eigen::VectorXd::Zero(scene.model.nq), v = Eigen::VectorXd::Zero(scene.model.nv);
    q[0] = 1;
    for (int j = 0; j < 12; ++j) {
      q[scene.model.bodies[scene.model.actuated[j]].q] = targets.q(j, 0);
      v[scene.model.bodies[scene.model.actuated[j]].v] = targets.v(j, 0);
      observation.joint_position(j, 0) = targets.q(j, 0);
    }
    const std::vector<Pose> X_WB = reference_poses(scene.model, q);
    const char* feet[] = {"LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT"};
    for (int i = 0; i < 4; ++i) {
      const int frame = scene.model.frame(feet[i]);
      const Vec3 x = frame_pose(scene.model, X_WB, frame).translation();
      ASSERT_LT((x - targets.x.vec3(3 * i, 0)).norm(), 1e-12) << k;
      const Vec3 xd = reference_jacobian(scene.model, X_WB, scene.model.frames[frame].body, x) * v;
      // Damping of 1 mm/rad against singular values above 2 cm/rad.
      ASSERT_LT((xd - targets.xd.vec3(3 * i, 0)).norm(), 3e-3 * targets.xd.vec3(3 * i, 0).norm() + 1e-12) << k;
    }
  }
}

// Wrong settings are refused where they stand.
TEST_F(ControllerTest, Errors) {
  EXPECT_NE(error("{holt: {}, control: {joint_pd: {kp: 1}}}").find("hold"), std::string::npos);
  EXPECT_NE(error("{control: {joint_pd: {kp: 1}}}")
                .find("names no policy; one of gait, gait_switch, hold, joint_trajectory, library, network, python, "
                      "tool_path, torque"),
            std::string::npos);
  EXPECT_NE(error("{hold: {}, gait: {}, control: {joint_pd: {kp: 1}}}").find("a second policy beside hold"),
            std::string::npos);
  EXPECT_NE(error("{hold: {}, control: {joint_pdd: {kp: 1}}}").find("joint_pd"), std::string::npos);
  EXPECT_NE(error("{hold: {}, control: {joint_pd: {kp: -1}}}").find("a gain is negative"), std::string::npos);
  EXPECT_NE(error("{hold: {}, control: {joint_pd: {kp: {'*_Y_4': 1}}}}").find("'*_Y_4' matches no actuated joint"),
            std::string::npos);
  EXPECT_NE(error("{hold: {}, control: {operational_pd: {kp: 1}}}").find("joint_pd"), std::string::npos);
  EXPECT_NE(error("{joint_trajectory: {table: none.csv}, control: {joint_pd: {kp: 1}}}").find("none.csv"),
            std::string::npos);
}

// Wrong gaits are refused with the rule that they break.
TEST_F(ControllerTest, GaitErrors) {
  const auto gait = [&](const std::string& change) {
    return error("{gait: {duration: 0.3, step_height: 3 cm, " + change + "}, control: {operational_pd: {kp: 1000}}}");
  };
  const std::string timing = "duty: 75 %, liftoff: '[25, 75, 0, 50] %'";
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(gait(timing), "gait: either 'velocity' or 'waypoints' or 'commands' must stand here");
  has(gait("velocity: [0.2, 0], " + timing), "has 2 numbers");
  has(gait("velocity: [0.2, 0, 0], duty: 75 %"), "gait: either 'liftoff' or 'touchdown' must stand here");
  has(gait("velocity: [0.2, 0, 0], duty: 75 %, liftoff: '[25, 75, 0] %'"), "has 3 values; one per foot (4)");
  has(gait("velocity: [0.2, 0, 0], duty: 75, liftoff: '[25, 75, 0, 50] %'"), "75 is not a fraction");
  has(gait("velocity: [0.2, 0, 0], stance: {height: 1 m}, " + timing), "height: 1 m: LF_FOOT would stand");
  has(gait("velocity: [0.2, 0, 0], stance: {height: 1 m}, " + timing), "the largest height that fits is 0.");
  has(gait("velocity: [0.2, 0, 0], orientation: [0, 0, 90], " + timing),
      "orientation: with the base at [0, 0, 90] rad");
  // A height that no attitude allows is not the attitude's fault.
  for (const char* level : {"[0, 0, 0]", "[0, 0, 90, deg]"}) {
    has(gait("velocity: [0.2, 0, 0], stance: {height: 1 m}, orientation: " + std::string(level) + ", " + timing),
        "gait.stance.height: 1 m: LF_FOOT would stand");
  }
  has(gait("velocity: [0.2, 0, 0], waypoints: {points: [[1, 0]], speed: {forward: 1, turn: 1}}, " + timing),
      "gait.waypoints: stands beside 'velocity'; only one of the two may");
  has(gait("velocity: [0.2, 0, 0], feet: [LF_FOOT, LF_FOOT], " + timing), "'LF_FOOT' stands twice");
  has(gait("velocity: [0.2, 0, 0], feet: LF_FOOT, " + timing), "feet: LF_FOOT: must be a list of links: [LF_FOOT]");
  has(gait("velocity: [0.2 rad/s, 0, 0], " + timing), "velocity[0]: 0.2 rad/s: the unit 'rad/s' does not fit");
  has(gait("velocity: [0.2, 0, 0], contact_force: -2 %, " + timing), "contact_force: -2 %: must be >= 0");
  has(gait("velocity: [0.2, 0, 0], feet: [LF_FOOT, RF_FOT], " + timing), "did you mean RF_FOOT?");
  has(gait("velocity: [0.2, 0, 0], feet: [BODY0], " + timing), "does not move relative to the base");
  has(gait("velocity: [0.2, 0, 0], step_hight: 1, " + timing), "step_height");
  EXPECT_NO_THROW(make("{gait: {velocity: [20 cm/s, 0, -30 deg/s], duration: 0.3, step_height: 3 cm, " + timing +
                       "}, control: {operational_pd: {kp: 1000}}}"));
  has(gait("waypoints: {points: [], speed: {forward: 0.1, turn: 0.5}}, " + timing), "has no points");
}

// The height that a refusal names is accepted when it is typed, and no greater one with as many decimals is.
TEST_F(ControllerTest, TheLargestHeightIsNamedExactly) {
  const auto answer = [&](const std::string& height) {
    return testing::message_of([&] {
      make(
          "{gait: {duration: 0.3, step_height: 3 cm, velocity: [0.2, 0, 0], duty: 75 %, liftoff: "
          "'[25, 75, 0, 50] %', stance: {length: 121.7 %, height: " +
          height + "}}, control: {operational_pd: {kp: 1000}}}");
    });
  };
  const std::string message = answer("1 m"), before = "the largest height that fits is ";
  const std::size_t at = message.find(before) + before.size(), open = message.find(" m (", at);
  ASSERT_NE(open, std::string::npos) << message;
  const std::string height = message.substr(at, open - at);
  const std::string factor = message.substr(open + 4, message.find(" of", open) - open - 4);
  EXPECT_EQ(answer(height + " m"), "(accepted)");
  EXPECT_EQ(answer(factor), "(accepted)");
  EXPECT_NE(answer(fmt::format("{} m", std::stod(height) + 1e-4)), "(accepted)");
}

// A foot carries from 2 % of the robot's weight on, whatever else is movable in its world.
TEST_F(ControllerTest, GaitWeighsTheRobotAlone) {
  const Settings gait = Settings::parse(
      "{velocity: [0.2, 0, 0], duration: 0.3, step_height: 3 cm, duty: 75 %, liftoff: '[25, 75, 0, 50] %'}",
      "test.yaml");
  const Scene crowded{links_world_with_anvil()};
  const double force = read_gait(crowded.context(), Described(gait, gait_description())).parameters.contact_force;
  EXPECT_EQ(force, read_gait(scene.context(), Described(gait, gait_description())).parameters.contact_force);
  EXPECT_DOUBLE_EQ(force, 0.02 * robot_weight(scene.model));
  const Settings share = gait.with("contact_force", Settings::parse("value: 5 %", "test.yaml").at("value"));
  EXPECT_DOUBLE_EQ(read_gait(scene.context(), Described(share, gait_description())).parameters.contact_force,
                   0.05 * robot_weight(scene.model));
}

// Waypoints: a base that moves as commanded passes every point and stops behind the last; driving and cars never
// strafe, holonomic steering does; none exceeds the largest speeds, and a car goes along no narrower a curve than it
// can.
TEST_F(ControllerTest, SteersToWaypoints) {
  for (const std::string steering : {"driving", "holonomic", "car, radius: 0.42"}) {
    const auto way = read_steering(
        Settings::parse(
            "waypoints: {points: [[0.5, 0], [0.5, -0.5], [-0.5, 0]], tolerance: 5 cm, speed: {forward: 0.2, "
            "strafe: 0.1, turn: 0.5}, steering: " +
                steering + "}",
            "way.yaml"),
        true);
    way->start(0);
    Vec3 base = Vec3::Zero();  // x, y, yaw
    double strafed = 0;
    std::array<double, 3> least = {1, 1, 1};
    BlockArray command(kCommandRows);
    for (int k = 0; k < 40000; ++k) {
      for (int i = 0; i < 2; ++i) observation.base_position(i, 0) = base[i];
      observation.base_rpy(2, 0) = std::remainder(base[2], 2 * M_PI);
      way->steer(observation, LaneMask::first(1), command);
      const BaseCommandT<double> twist{{command(0, 0), command(1, 0), command(2, 0)},
                                       {command(3, 0), command(4, 0), command(5, 0)}};
      const PlanarPoseT<double> step = predict(twist, 1e-3);
      base += Vec3(std::cos(base[2]) * step.x - std::sin(base[2]) * step.y,
                   std::sin(base[2]) * step.x + std::cos(base[2]) * step.y, step.yaw);
      strafed = std::max(strafed, std::abs(command(1, 0)));
      if (steering.starts_with("car") && command(0, 0) != 0) {
        EXPECT_EQ(command(0, 0), 0.2) << "it never slows down";
        EXPECT_LE(std::abs(command(5, 0)) * 0.42, 0.2 * (1 + 1e-12));
      }
      EXPECT_LE(std::abs(command(0, 0)), 0.2);
      EXPECT_LE(std::abs(command(5, 0)), 0.5);
      const double points[3][2] = {{0.5, 0}, {0.5, -0.5}, {-0.5, 0}};
      for (int i = 0; i < 3; ++i) {
        least[i] = std::min(least[i], std::hypot(base[0] - points[i][0], base[1] - points[i][1]));
      }
    }
    for (const double distance : least) EXPECT_LT(distance, 0.0502) << steering;  // tolerance and one step's way
    EXPECT_TRUE(command.column(0).isZero(0)) << steering;
    EXPECT_EQ(strafed > 1e-9, steering == "holonomic");
    EXPECT_LE(strafed, 0.1);
  }
}

/// LINKS with its base fixed to the world at a pose.
World fixed_links(const Vec3& position, const Vec3& rpy) {
  World world = links_world();
  world.robot.floating_base = false;
  world.initial.on_ground = false;
  world.initial.position = position;
  world.initial.rpy = rpy;
  return world;
}

/// Joint targets of a gait over half a second, [control step][joint], when the joints are wherever they are asked to
/// be.
std::vector<std::vector<double>> gait_targets(const World& world, const std::string& up) {
  const Scene scene(world);
  Controller controller(scene.context(),
                        Settings::parse("{gait: {velocity: [0.2, 0.05, 0.3], duration: 0.3 s, duty: 75 %, liftoff: "
                                        "'[25, 75, 0, 50] %', step_height: 3 cm, recovery: false, global_up: " +
                                            up + "}, control: {joint_pd: {kp: 20}}}",
                                        "test.yaml"));
  Sensors sensors(scene.model, channel_names(scene.world.robot), SensorNoise{}, controller.reads());
  FakePhysics physics(scene.model);
  const Particle particle = scene.particle();
  physics.start(0, particle);
  sensors.start(0, particle);
  controller.start(0, 0, 0);
  Observation observation;
  ActuatorCommand command(scene.model.na());
  const BlockArray tau(scene.model.na());
  const LaneMask lane = LaneMask::first(1);
  std::vector<std::vector<double>> out;
  for (std::uint32_t k = 0; k < 500; ++k) {
    sensors.sense(physics, tau, 1e-3, {k}, {k * 1e-3}, lane, observation);
    controller.act(observation, nullptr, lane, command);
    std::vector<double>& q = out.emplace_back();
    for (int i = 0; i < scene.model.na(); ++i) {
      q.push_back(command.q(i, 0));
      physics.mutable_state().q(scene.model.bodies[scene.model.actuated[i]].q, 0) = command.q(i, 0);
    }
  }
  return out;
}

double largest_difference(const std::vector<std::vector<double>>& a, const std::vector<std::vector<double>>& b) {
  double out = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    for (std::size_t i = 0; i < a[k].size(); ++i) out = std::max(out, std::abs(a[k][i] - b[k][i]));
  }
  return out;
}

// A gait knows its stance from the base, wherever that is fixed: at every pose the joints move as at the origin. Steps
// that rise along the world's vertical are the same on every upright base, and others on a tilted one.
TEST(FixedBase, GaitMovesTheJointsAsAtTheOrigin) {
  const Vec3 none = Vec3::Zero();
  for (const char* up : {"true", "false"}) {
    const auto origin = gait_targets(fixed_links(none, none), up);
    EXPECT_LT(largest_difference(origin, gait_targets(fixed_links({3, -2, 1.5}, none), up)), 1e-11) << up;
    EXPECT_LT(largest_difference(origin, gait_targets(fixed_links({-1, 0.5, 0}, {0, 0, 2.5}), up)), 1e-11) << up;
    const double tilted = largest_difference(origin, gait_targets(fixed_links({0.2, 0.3, 1}, {0.4, -0.3, 1}), up));
    EXPECT_EQ(tilted > 0.01, std::string(up) == "true") << tilted;
    EXPECT_EQ(tilted < 1e-11, std::string(up) == "false") << tilted;
    EXPECT_GT(largest_difference(origin, {500, origin[0]}), 0.1);  // it does walk
  }
}

// The base of a robot that hangs on a link called `world` is the link that is fixed to it.
TEST(FixedBase, IsTheLinkThatIsFixedToTheWorld) {
  Model model;
  model.floating_base = false;
  Pose X_WB = Pose::Identity();
  X_WB.translation() = Vec3(1, 2, 3);
  model.frames = {{"world", -1, Pose::Identity()}, {"base", -1, X_WB}, {"plate", -1, Pose::Identity()}};
  EXPECT_EQ(fixed_base_pose(model).translation(), Vec3(1, 2, 3));
  model.frames.resize(1);
  model.frames[0].X_BF = X_WB;
  EXPECT_EQ(fixed_base_pose(model).translation(), Vec3(1, 2, 3));
  model.floating_base = true;
  EXPECT_EQ(fixed_base_pose(model).translation(), Vec3(0, 0, 0));
}

}  // namespace
}  // namespace graze
