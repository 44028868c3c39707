// Claim: every witness is the signed distance to its limit in SI units, and a task judges traces by them as §5.1.2
// says.
#include "scenarios/task.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "sampling/constants.h"
#include "tests/reference_kinematics.h"
#include "tests/scenarios/support.h"
#include "tests/scenarios/task_bench.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using testing::write_poses;
using Tasks = testing::TaskBench;

TEST_F(Tasks, TiltIsTheAngleOfTheLinksZAxis) {
  const double angle = 0.3;
  const Quat R(Eigen::AngleAxisd(1.1, Vec3::UnitZ()) * Eigen::AngleAxisd(angle, Vec3(1, 2, 0).normalized()));
  q_.head<4>() << R.w(), R.x(), R.y(), R.z();
  EXPECT_NEAR(margin("{tilt: {link: base, below: 90 deg}}"), std::numbers::pi / 2 - angle, 1e-14);
  // A turn of the hip about y in the base frame adds to none, but the thigh's own tilt is that of both turns.
  q_.head<4>() << 1, 0, 0, 0;
  q_[q_of("hip")] = -0.4;
  EXPECT_NEAR(margin("{tilt: {link: thigh, below: 0.1}}"), 0.1 - 0.4, 1e-14);
  EXPECT_NEAR(margin("{tilt: {link: \"*\", below: 1}}"), 1 - 0.4, 1e-14) << "the worst of all";
}

TEST_F(Tasks, PositionAndHeightAreDistancesToPlanes) {
  q_.segment<3>(4) << 1, 2, 3;
  EXPECT_DOUBLE_EQ(margin("{height: {link: base, above: 50 cm}}"), 2.5);
  EXPECT_DOUBLE_EQ(margin("{height: {link: base, below: 50 cm}}"), -2.5);
  EXPECT_DOUBLE_EQ(margin("{position: {link: base, x: {above: 0, below: 4}, y: {below: 2.5}}}"), 0.5);
  // The foot hangs 0.4 m below the base at q = 0.
  EXPECT_NEAR(margin("{height: {link: \"{base,foot}\", above: 2.5}}"), 0.1, 1e-14);
}

// Claim: a description tells every bound, and the window.
TEST(TaskDescriptions, AreWhole) {
  const Scenario scenario = testing::read(testing::hopper(R"(task:
  requirements:
    lane: {position: {link: base, x: {above: -1}, y: {above: -0.5, below: 0.5}}}
    slow: {joint_speed: {joints: hip, below: 10}, window: [0.5 s, 1 s]}
    slider: {joint_speed: {joints: slide, below: 1}}
    rated: {joint_speed: {joints: hip}}
    spare: {joint_limits: {joints: hip, margin: 0.5}}
    free: {joint_limits: {joints: hip}}
  objective: {height: {link: base, above: 0, below: 1}, once: true, window: [0.25 s, 0.5 s]}
)"));
  std::vector<std::string> texts;
  for (const Requirement& one : scenario.task.requirements) texts.push_back(one.description);
  EXPECT_EQ(texts, (std::vector<std::string>{"base x > -1 m, y > -0.5 m and y < 0.5 m",
                                             "speed of hip below the URDF's limit, 5 rad/s, from 0.5 to 1 s",
                                             "speed of slide below 1 m/s", "speed of hip below the URDF's limits",
                                             "position limits of hip, less 0.5 rad", "position limits of hip"}));
  EXPECT_EQ(scenario.task.objective.description, "base z > 0 m and z < 1 m, from 0.25 to 0.5 s");
}

TEST_F(Tasks, SpeedIsThatOfTheLinksOrigin) {
  v_[2] = 2;                    // base turns about z, rad/s
  v_.segment<3>(3) << 3, 0, 0;  // and moves
  v_[v_of("hip")] = 5;          // about y: the foot, 0.2 m below the hip, moves at -1 m/s along x
  EXPECT_DOUBLE_EQ(margin("{speed: {link: base, below: 4}}"), 1);
  EXPECT_NEAR(margin("{speed: {link: foot, below: 4}}"), 4 - std::abs(3 - 5 * 0.2), 1e-12);
}

TEST_F(Tasks, ContactsAreGapsOrOverlaps) {
  const std::string forbidden = "{no_contact: [foot, \"*\"]}", needed = "{contact: [foot, ground]}";
  q_[6] = 5;  // base far above the ground
  EXPECT_DOUBLE_EQ(margin(forbidden), 0.02) << "nothing near";
  EXPECT_DOUBLE_EQ(margin(needed), -0.02);
  const double wide = margin("{no_contact: {between: [foot, ground], within: 10 m}}");
  q_[6] -= wide - 0.005;
  EXPECT_NEAR(margin(forbidden), 0.005, 1e-12) << "though the back end reports no near point";
  EXPECT_NEAR(margin(needed), -0.005, 1e-12);
  EXPECT_DOUBLE_EQ(margin("{no_contact: {between: [foot, ground], within: 4 mm}}"), 0.004);
  touch("foot", "ground", -0.001, 0);
  EXPECT_DOUBLE_EQ(margin(forbidden), -0.001);
  EXPECT_DOUBLE_EQ(margin(needed), 0.001);
  contacts_.clear();
  touch("foot", "ground", 1e-4, 0.2);  // pressed, though a gap is left: they touch
  EXPECT_LT(margin(forbidden), 0);
  EXPECT_GT(margin(needed), 0);
  contacts_.clear();
  q_[6] = 5;
  touch("base", "ground", -0.001, 1);
  EXPECT_DOUBLE_EQ(margin(forbidden), 0.02) << "another part";
}

TEST_F(Tasks, ContactsTellFeaturesApart) {
  touch("foot", "block", -0.001, 1, Feature::top);
  EXPECT_DOUBLE_EQ(margin("{no_contact: [foot, block.side]}"), 0.02);
  EXPECT_DOUBLE_EQ(margin("{no_contact: [foot, \"block.{side,top}\"]}"), -0.001);
  EXPECT_DOUBLE_EQ(margin("{no_contact: [block.top, foot]}"), -0.001) << "in either order";
  EXPECT_DOUBLE_EQ(margin("{no_contact: [foot, block]}"), -0.001);
}

TEST_F(Tasks, SelfCollisionIsBetweenPartsOfTheRobot) {
  touch("foot", "ground", -0.001, 1);
  EXPECT_DOUBLE_EQ(margin("{self_collision: true}"), 0.02);
  touch("foot", "base", -0.002, 1);
  EXPECT_DOUBLE_EQ(margin("{self_collision: {}}"), -0.002);
}

TEST_F(Tasks, JointWitnessesAreDistancesToTheUrdfsLimits) {
  q_[q_of("hip")] = -0.7;    // within [-1, 2]
  q_[q_of("slide")] = 0.08;  // within [-0.1, 0.1]
  EXPECT_NEAR(margin("{joint_limits: {joints: hip}}"), 0.3, 1e-15);
  EXPECT_NEAR(margin("{joint_limits: {joints: hip, margin: 0.5}}"), -0.2, 1e-15);
  EXPECT_NEAR(margin("{joint_limits: {}}"), 0.02, 1e-15) << "the wheel has no limits and does not count";
  v_[v_of("hip")] = -2;  // of 5 rad/s
  EXPECT_DOUBLE_EQ(margin("{joint_speed: {joints: hip}}"), 3);
  EXPECT_DOUBLE_EQ(margin("{joint_speed: {joints: hip, below: 1}}"), -1);
  headroom_(actuator_of("slide"), kLane) = -0.25;
  EXPECT_DOUBLE_EQ(margin("{torque_limits: {joints: hip}}"), 100);
  EXPECT_DOUBLE_EQ(margin("{torque_limits: {}}"), -0.25);
}

// A joint that its stop holds is beyond it by what the solver leaves, on either side.
TEST_F(Tasks, AJointAtItsStopKeepsItsLimits) {
  const std::string limits = "{joint_limits: {joints: hip}}", spare = "{joint_limits: {joints: hip, margin: 0.5}}";
  for (const double beyond : {4e-15, 4e-12, 2e-9, 0.9e-7}) {
    q_[q_of("hip")] = -1 - beyond;  // within [-1, 2]
    EXPECT_EQ(margin(limits), 0);
    q_[q_of("hip")] = 2 + beyond;
    EXPECT_EQ(margin(limits), 0);
    q_[q_of("hip")] = 1.5 + beyond;
    EXPECT_EQ(margin(spare), 0);
  }
  q_[q_of("hip")] = 2 + 1.1e-7;
  EXPECT_NEAR(margin(limits), -1.1e-7, 1e-15) << "all of it, and not what goes beyond the tolerance";
  q_[q_of("hip")] = 2 - 1e-12;
  EXPECT_NEAR(margin(limits), 1e-12, 1e-15);
}

// §6.1.1, all four quadrants: tau_max (1 - |v| / v_max) - |tau|, with tau_max 10 and v_max 5.
TEST_F(Tasks, TorqueSpeedFollowsTheLinearLine) {
  for (const double v : {-2.0, 2.0}) {
    for (const double tau : {-7.0, 7.0}) {
      v_[v_of("hip")] = v;
      tau_(actuator_of("hip"), kLane) = tau;
      EXPECT_DOUBLE_EQ(margin("{torque_speed: {joints: hip}}"), 10 * (1 - 2.0 / 5) - 7);
    }
  }
}

/// A block of particles that differ from each other, each in a state of its own.
struct RandomBlock {
  std::vector<Model> models;
  BlockState state;
  BlockArray tau, headroom;
  ContactLists contacts;
  std::mt19937 random{5};

  RandomBlock(const Model& model, const State& initial, const BlockState& like)
      : models(kLanes, model), state(like), tau(model.na()), headroom(model.na()) {
    for (int lane = 0; lane < kLanes; ++lane) {
      vary(models[lane]);
      place(lane, initial);
      touch(lane);
    }
  }

  double number() { return 2.0 * random() / 4294967296.0 - 1; }  // -1 .. 1
  Vec3 vector() { return {number(), number(), number()}; }

  void vary(Model& model) {
    for (Body& body : model.bodies) {
      body.upper += 0.1 * number();
      body.effort *= 1 + 0.1 * number();
      body.velocity *= 1 + 0.1 * number();
      body.axis = (body.axis + 0.1 * vector()).normalized();
    }
    for (Frame& frame : model.frames) frame.X_BF.translation() += 0.1 * vector();
  }

  void place(int lane, const State& initial) {
    Eigen::VectorXd q = initial.q, v(initial.v.size());
    for (int i = 0; i < q.size(); ++i) q[i] += 0.5 * number();
    q.head<4>().normalize();
    for (double& one : v) one = number();
    const std::vector<Pose> X_WB = reference_poses(models[lane], q);
    write_poses(X_WB, lane, state);
    state.q.set_column(lane, q);
    state.v.set_column(lane, v);
    for (int k = 0; k < tau.rows(); ++k) tau(k, lane) = 20 * number(), headroom(k, lane) = number();
  }

  void touch(int lane) {
    for (int i = 0; i < 10; ++i) {
      Contact c;
      c.a = static_cast<int>(random() % models[lane].colliders.size());
      c.b = static_cast<int>(random() % models[lane].colliders.size());
      if (c.a > c.b) std::swap(c.a, c.b);
      c.feature_b = random() % 2 ? Feature::side : Feature::top;
      c.phi = 0.01 * number();
      c.impulse_W = (random() % 2) * c.n_W;
      contacts[lane].push_back(c);
    }
  }
};

BlockArray only_lane(const BlockArray& array, int lane) {
  BlockArray out(array.rows());
  for (int i = 0; i < array.rows(); ++i) out(i, lane) = array(i, lane);
  return out;
}

BlockState only_lane(const BlockState& state, int lane) {
  return {only_lane(state.q, lane), only_lane(state.v, lane), only_lane(state.a, lane), only_lane(state.X, lane)};
}

/// A witness's value and the part that gave it.
struct Valued {
  double value, part;
  bool operator==(const Valued&) const = default;
};

void PrintTo(const Valued& v, std::ostream* out) { *out << v.value << " of part " << v.part; }

/// After a step of 1 ms.
const std::array<double, kLanes> kLater = [] {
  std::array<double, kLanes> out;
  out.fill(1e-3);
  return out;
}();

/// A witness in one lane of a block, beside lanes that hold nothing.
Valued alone(const Witness& witness, const RandomBlock& block, int lane) {
  BlockArray own(witness.numbers());
  witness.read(block.models[lane], lane, own);
  const std::unique_ptr<WitnessMemory> memory = witness.remember();
  if (memory) memory->start(lane, block.models[lane]);
  ContactLists contacts = block.contacts;
  for (int other = 0; other < kLanes; ++other) {
    if (other != lane) contacts[other].clear();
  }
  const std::vector<ContactPoint> points = contacts.gather();
  const BlockState state = only_lane(block.state, lane);
  const BlockArray tau = only_lane(block.tau, lane), headroom = only_lane(block.headroom, lane);
  double out[kLanes], part[kLanes];
  witness.follow({state, {}, tau, headroom, {}, LaneMask(1u << lane), memory.get()});  // at the start
  const WitnessInput input{state, points, tau, headroom, kLater, LaneMask(1u << lane), memory.get()};
  witness.follow(input);
  witness.evaluate(input, own, out, part);
  return {out[lane], part[lane]};
}

/// A witness in every lane of a block.
std::array<Valued, kLanes> together(const Witness& witness, RandomBlock& block) {
  BlockArray own(witness.numbers());
  const std::unique_ptr<WitnessMemory> memory = witness.remember();
  for (int lane = 0; lane < kLanes; ++lane) {
    witness.read(block.models[lane], lane, own);
    if (memory) memory->start(lane, block.models[lane]);
  }
  const std::vector<ContactPoint> points = block.contacts.gather();
  double value[kLanes], part[kLanes];
  witness.follow({block.state, {}, block.tau, block.headroom, {}, LaneMask::all(), memory.get()});  // at the start
  const WitnessInput input{block.state, points, block.tau, block.headroom, kLater, LaneMask::all(), memory.get()};
  witness.follow(input);
  witness.evaluate(input, own, value, part);
  std::array<Valued, kLanes> out;
  for (int lane = 0; lane < kLanes; ++lane) out[lane] = {value[lane], part[lane]};
  return out;
}

// Every witness gives a lane the same bits, and names the same part, beside other particles as alone.
TEST_F(Tasks, LanesAreJudgedApart) {
  const Task t = task(
      "requirements:\n"
      "  tilt: {tilt: {link: \"*\", below: 1}}\n"
      "  height: {height: {link: \"{base,foot}\", above: 0.3}}\n"
      "  position: {position: {link: foot, x: {above: -1, below: 1}, y: {below: 2}}}\n"
      "  speed: {speed: {link: \"*\", below: 3}}\n"
      "  apart: {no_contact: [foot, \"block.{side,top}\"]}\n"
      "  standing: {contact: [foot, ground]}\n"
      "  self: {self_collision: true}\n"
      "  far: {no_contact: {between: [\"{thigh,base}\", \"*\"], within: 50 m}}\n"
      "  struck: {contact_impulse: {between: [\"*\", \"*\"], below: 5}}\n"
      "  pushed: {contact_impulse: {between: [foot, \"*\"], below: 5, direction: [1, 2, 3], total: true}}\n"
      "  pressed: {contact_force: {between: [\"*\", \"*\"], below: 5, over: 2 ms}}\n"
      "  limits: {joint_limits: {}}\n"
      "  torque: {torque_limits: {}}\n"
      "  line: {torque_speed: {joints: hip}}\n"
      "  fast: {joint_speed: {}}\n");
  input();
  RandomBlock block(model_, initial_state(*scenario_.world, model_), state_);
  for (const Requirement& one : t.requirements) {
    const std::array<Valued, kLanes> value = together(*one.witness, block);
    EXPECT_THAT(value, ::testing::Contains(::testing::Ne(value[0]))) << one.name << ": all alike shows nothing";
    for (int lane = 0; lane < kLanes; ++lane) {
      EXPECT_EQ(alone(*one.witness, block, lane), value[lane]) << one.name << ", lane " << lane;
    }
  }
}

// The margin of a tilt is the least of all steps, though angles are computed only where a tilt may be the greatest yet.
TEST_F(Tasks, TiltKeepsItsLeastMargin) {
  const Task t = task("requirements: {tilt: {tilt: {link: \"*\", below: 1}}}");
  const Witness& witness = *t.requirements[0].witness;
  input();
  RandomBlock block(model_, initial_state(*scenario_.world, model_), state_);
  TaskMonitor monitor(t);
  std::array<double, kLanes> least;
  least.fill(kInfinity);
  for (int lane = 0; lane < kLanes; ++lane) monitor.start(lane, block.models[lane]);
  for (int step = 0; step < 200; ++step) {
    for (int lane = 0; lane < kLanes; ++lane) block.place(lane, initial_state(*scenario_.world, model_));
    const std::vector<ContactPoint> points;
    const WitnessInput in{block.state, points, block.tau, block.headroom, kLater, LaneMask::all()};
    monitor.update(in);
    const std::array<Valued, kLanes> value = together(witness, block);
    for (int lane = 0; lane < kLanes; ++lane) {
      least[lane] = std::min(least[lane], value[lane].value);
      EXPECT_EQ(monitor.margins(lane)[0], least[lane]) << "step " << step << ", lane " << lane;
    }
  }
}

// Speed is that of the Jacobian, over revolute, prismatic and floating joints about any axes.
TEST_F(Tasks, SpeedAgreesWithTheJacobian) {
  const Task t = task("requirements: {speed: {speed: {link: \"*\", below: 3}}}");
  input();
  RandomBlock block(model_, initial_state(*scenario_.world, model_), state_);
  const std::array<Valued, kLanes> value = together(*t.requirements[0].witness, block);
  for (int lane = 0; lane < kLanes; ++lane) {
    const Model& model = block.models[lane];
    std::vector<Pose> X_WB;
    for (std::size_t b = 0; b < model.bodies.size(); ++b) X_WB.push_back(block.state.pose(static_cast<int>(b), lane));
    double greatest = 0;
    for (std::size_t i = 0; i < model.frames.size(); ++i) {
      const Vec3 p_W = frame_pose(model, X_WB, static_cast<int>(i)).translation();
      const Eigen::Matrix3Xd J = reference_jacobian(model, X_WB, model.frames[i].body, p_W);
      greatest = std::max(greatest, (J * block.state.v.column(lane)).norm());
    }
    EXPECT_NEAR(value[lane].value, 3 - greatest, 1e-13 * (1 + greatest));
  }
}

TEST_F(Tasks, RequirementsKeepMarginAndFirstViolation) {
  const Task t = task(
      "requirements:\n"
      "  high: {height: {link: base, above: 1}}\n"
      "  late: {height: {link: base, above: 2}, window: [2 s, 4 s]}\n");
  TaskMonitor monitor(t);
  for (int lane = 0; lane < kLanes; ++lane) monitor.start(lane, model_);
  const double heights[] = {1.5, 1.2, 2.5, 2.1, 0.5, 3.0};  // at t = 0, 1, …
  std::vector<bool> violated;
  for (int i = 0; i < 6; ++i) {
    q_[6] = heights[i];
    violated.push_back(monitor.update(input(i))[kLane]);
  }
  EXPECT_THAT(violated, ElementsAre(false, false, false, false, true, true));
  EXPECT_THAT(monitor.margins(kLane), ElementsAre(-0.5, -1.5));
  EXPECT_THAT(monitor.first_violations(kLane), ElementsAre(4, 4));
  EXPECT_EQ(monitor.violated(kLane), 0) << "the first in the list within a step";
  EXPECT_EQ(monitor.violated(0), -1) << "other lanes know nothing of it";
  monitor.start(kLane, model_);
  EXPECT_EQ(monitor.violated(kLane), -1);
  EXPECT_THAT(monitor.margins(kLane), ElementsAre(kInfinity, kInfinity));
  EXPECT_TRUE(std::isnan(monitor.first_violations(kLane)[0]));
}

TEST_F(Tasks, MeasuresAreWatchedAndDecideNothing) {
  const Task t = task(
      "requirements: {low: {height: {link: base, below: 9}}}\n"
      "measures: {high: {height: {link: base, above: 1}}, late: {height: {link: base, above: 1}, window: [2, 3]}}\n");
  ASSERT_EQ(t.requirements.size(), 3u);
  EXPECT_FALSE(t.requirements[0].measure);
  EXPECT_TRUE(t.requirements[1].measure && t.requirements[2].measure);
  TaskMonitor monitor(t);
  monitor.start(kLane, model_);
  q_[6] = 0.25;
  EXPECT_FALSE(monitor.update(input(1)).any()) << "nor does it end a trace";
  q_[6] = 3;
  EXPECT_FALSE(monitor.update(input(2)).any());
  EXPECT_THAT(monitor.margins(kLane), ElementsAre(6, -0.75, 2));
  EXPECT_EQ(monitor.first_violations(kLane)[1], 1);
  EXPECT_EQ(monitor.violated(kLane), -1);
  q_[6] = 10;
  EXPECT_TRUE(monitor.update(input(3))[kLane]);
  EXPECT_EQ(monitor.violated(kLane), 0);
}

TEST_F(Tasks, ObjectivesAreJudgedAtTheirTimes) {
  const auto margin_of = [&](const std::string& objective) {
    const Task t = task("objective: " + objective);
    TaskMonitor monitor(t);
    monitor.start(kLane, model_);
    const double heights[] = {1.5, 3.0, 0.5, 2.0};  // at t = 0, 1, 2, 3
    for (int i = 0; i < 4; ++i) {
      q_[6] = heights[i];
      monitor.update(input(i));
    }
    monitor.finish(input(3));
    return monitor.objective_margin(kLane);
  };
  const std::string up = "height: {link: base, above: 1}", far = "position: {link: base, x: {above: 0.25}}";
  EXPECT_DOUBLE_EQ(margin_of("{" + up + "}"), 1.0);
  EXPECT_DOUBLE_EQ(margin_of("{" + up + ", at: end}"), 1.0);
  EXPECT_DOUBLE_EQ(margin_of("{" + up + ", always: true}"), -0.5);
  EXPECT_DOUBLE_EQ(margin_of("{" + up + ", once: true}"), 2.0);
  EXPECT_DOUBLE_EQ(margin_of("{" + up + ", once: true, window: [2, 3]}"), 1.0);
  EXPECT_DOUBLE_EQ(margin_of("{" + up + ", window: [0, 1]}"), 0.5);
  EXPECT_DOUBLE_EQ(margin_of("{all: [{" + up + "}, {" + far + "}]}"), -0.25);
  EXPECT_DOUBLE_EQ(margin_of("{any: [{" + up + "}, {" + far + "}]}"), 1.0);
  EXPECT_DOUBLE_EQ(margin_of("{not: {" + far + "}}"), 0.25);
  EXPECT_DOUBLE_EQ(margin_of("{done: {any: [{not: {all: [{" + up + "}]}}, {" + far + "}]}}"), -0.25);
  EXPECT_EQ(task("objective: {done: {" + up + "}}").objective.name, "done");
}

// A witness over several parts names the one that gave its value; one over a single part names none.
TEST_F(Tasks, GlobsNameTheCulprit) {
  const auto part_of = [&](const std::string& yaml) {
    const Task t = task("requirements: {w: " + yaml + "}");
    const Witness& w = *t.requirements[0].witness;
    BlockArray own(w.numbers());
    w.read(model_, kLane, own);
    const std::unique_ptr<WitnessMemory> memory = w.remember();
    if (memory) memory->start(kLane, model_);
    double out[kLanes], part[kLanes];
    WitnessInput in = input();
    in.memory = memory.get();
    w.evaluate(in, own, out, part);
    const int index = static_cast<int>(part[kLane]), colliders = static_cast<int>(model_.colliders.size());
    if (w.parts() == PartKind::none || index < 0) return std::string("none");
    if (w.parts() == PartKind::link) return model_.frames[index].name;
    if (w.parts() == PartKind::joint) return model_.bodies[model_.actuated[index]].joint;
    return model_.colliders[index / colliders].name + "+" + model_.colliders[index % colliders].name;
  };
  q_[q_of("hip")] = -0.4;
  EXPECT_EQ(part_of("{tilt: {link: \"{base,thigh}\", below: 1}}"), "thigh");
  EXPECT_EQ(part_of("{tilt: {link: thigh, below: 1}}"), "none");
  EXPECT_EQ(part_of("{height: {link: \"{base,foot}\", above: 0.3}}"), "foot");
  EXPECT_EQ(part_of("{height: {link: \"{base,foot}\", below: 0.3}}"), "base");
  v_[v_of("hip")] = 4;
  EXPECT_EQ(part_of("{speed: {link: \"*\", below: 3}}"), "foot");
  EXPECT_EQ(part_of("{joint_speed: {below: 5}}"), "hip");
  headroom_(actuator_of("slide"), kLane) = -1;
  EXPECT_EQ(part_of("{torque_limits: {}}"), "slide");
  const auto pair = [&](const char* a, const char* b) {
    return std::string(model_.collider(a) < model_.collider(b) ? a : b) + "+" +
           (model_.collider(a) < model_.collider(b) ? b : a);
  };
  q_.segment<3>(4) << 50, 0, 50;
  EXPECT_EQ(part_of("{no_contact: [foot, \"{block,ground}\"]}"), "none") << "nothing is near";
  q_[6] = 0.45;  // the foot's centre hangs at 5 cm, its radius is 3 cm
  EXPECT_EQ(part_of("{no_contact: {between: [\"{foot,base}\", \"{block,ground}\"], within: 10 cm}}"),
            pair("foot", "ground"));
  touch("foot", "block", -0.003, 1);
  touch("foot", "ground", -0.004, 1);
  EXPECT_EQ(part_of("{no_contact: [foot, \"*\"]}"), pair("foot", "ground"));
  contacts_.back().phi = -0.003;  // both overlap by as much: the first pair counts
  const std::string first = part_of("{no_contact: [foot, \"*\"]}");
  std::reverse(contacts_.begin(), contacts_.end());
  EXPECT_EQ(part_of("{no_contact: [foot, \"*\"]}"), first);
}

// Culprits of margins and of violations are kept apart: the first that falls below 0, and the one that falls lowest.
TEST_F(Tasks, CulpritsAreKeptWithMarginsAndViolations) {
  const Task t = task(
      "requirements: {fast: {joint_speed: {below: 1}}}\n"
      "objective: {any: [{height: {link: base, above: 9}}, {speed: {link: \"{base,foot}\", below: 0.1}}]}\n");
  const int base = model_.frame("base"), foot = model_.frame("foot");
  TaskMonitor monitor(t);
  monitor.start(kLane, model_);
  EXPECT_EQ(monitor.margin_parts(kLane)[0], kNoPart);
  const int hip = actuator_of("hip"), other = hip == 0 ? 1 : 0;
  const auto speed = [&](int k) -> double& { return v_[model_.bodies[model_.actuated[k]].v]; };
  speed(hip) = 0.5, monitor.update(input(0));
  EXPECT_EQ(monitor.violation_parts(kLane)[0], kNoPart);
  speed(hip) = 1.5, monitor.update(input(1));
  speed(other) = 2.5, monitor.update(input(2));
  monitor.finish(input(2));
  EXPECT_EQ(monitor.violation_parts(kLane)[0], hip);
  EXPECT_EQ(monitor.margin_parts(kLane)[0], other);
  EXPECT_EQ(monitor.objective_culprit(kLane).leaf, 1) << "speed misses by less than height";
  EXPECT_EQ(monitor.objective_culprit(kLane).part, foot);
  EXPECT_NE(base, foot);
}

TEST_F(Tasks, WithoutAnObjectiveTheEndIsEnough) {
  const Task t = task("{}");
  TaskMonitor monitor(t);
  monitor.start(kLane, model_);
  monitor.update(input());
  monitor.finish(input());
  EXPECT_TRUE(monitor.objective_met(kLane));
}

}  // namespace
}  // namespace graze
