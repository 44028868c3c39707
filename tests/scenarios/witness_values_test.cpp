// Claim: in any state of any particle a witness is the least of what its parts have, computed here from poses and
// limits one by one; it names the part that has it, and lies within the range that it tells of itself.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "sampling/constants.h"
#include "scenarios/task_range.h"
#include "scenarios/witnesses.h"
#include "tests/reference_kinematics.h"
#include "tests/scenarios/task_bench.h"

namespace graze {
namespace {

/// A particle of the hopper, whose limits, axes and frames are its own, in one state after the other.
class WitnessValues : public testing::TaskBench {
 protected:
  WitnessValues() : own_model_(model_), random_(3) {
    for (Body& body : own_model_.bodies) {
      body.lower -= 0.2 * std::abs(between(0, 1)), body.upper += 0.2 * std::abs(between(0, 1));
      body.effort *= between(0.8, 1.2), body.velocity *= between(0.8, 1.2);
      body.axis = (body.axis + Vec3(between(-0.1, 0.1), between(-0.1, 0.1), between(-0.1, 0.1))).normalized();
    }
    for (Frame& frame : own_model_.frames) {
      frame.X_BF.translation() += Vec3(between(-0.1, 0.1), between(-0.1, 0.1), between(-0.1, 0.1));
      frame.X_BF.rotate(Eigen::AngleAxisd(between(-0.2, 0.2), Vec3::UnitX()));
    }
  }

  double between(double low, double high) { return low + (high - low) * random_() / 4294967295.0; }

  void anywhere() {
    for (double& x : q_) x = between(-1, 1);
    q_.head<4>().normalize();
    for (double& x : v_) x = between(-3, 3);
    for (int k = 0; k < model_.na(); ++k) tau_(k, kLane) = between(-20, 20), headroom_(k, kLane) = between(-1, 1);
    input();
    X_WB_ = reference_poses(own_model_, q_);
    testing::write_poses(X_WB_, kLane, state_);
  }

  ReadWitness read_one(const std::string& yaml, const Model& model) const {
    const Settings map = Settings::parse(yaml, "task.yaml");
    const auto [name, keys] = map.entries().front();
    const WitnessKind& kind = *kind_of(witness_kinds(), name);
    return kind.read(Described(keys, kind.text), model);
  }

  std::pair<double, int> value_of(const Witness& witness, const Model& particle) {
    BlockArray own(witness.numbers());
    witness.read(particle, kLane, own);
    const std::unique_ptr<WitnessMemory> memory = witness.remember();
    if (memory) memory->start(kLane, particle);
    const std::vector<ContactPoint> none;
    double out[kLanes], part[kLanes];
    witness.evaluate({state_, none, tau_, headroom_, {}, LaneMask(1u << kLane), memory.get()}, own, out, part);
    return {out[kLane], static_cast<int>(part[kLane])};
  }

  /// Holds a witness against `each`, which gives the value of part i of `parts`, in many states.
  template <typename Each>
  void hold_each(const std::string& yaml, int parts, const Each& each) {
    const ReadWitness read = read_one(yaml, model_);
    for (int state = 0; state < 60; ++state) {
      anywhere();
      double least = kInfinity;
      int which = -1;
      for (int i = 0; i < parts; ++i) {
        const double one = each(i);
        if (one < least) least = one, which = i;
      }
      const auto [value, part] = value_of(*read.witness, own_model_);
      ASSERT_NEAR(value, least, 1e-12 * (1 + std::abs(least))) << yaml;
      if (read.witness->parts() != PartKind::none) {
        ASSERT_EQ(part, which) << yaml;
      }
    }
  }

  Vec3 origin(int frame) const { return frame_pose(own_model_, X_WB_, frame).translation(); }
  const Body& joint_body(int k) const { return own_model_.bodies[own_model_.actuated[k]]; }

  Model own_model_;
  std::vector<Pose> X_WB_;
  std::mt19937 random_;
};

TEST_F(WitnessValues, OfPlaces) {
  const int frames = static_cast<int>(model_.frames.size());
  hold_each("{tilt: {link: \"*\", below: 2}}", frames, [&](int i) {
    return 2 - std::acos(std::clamp(frame_pose(own_model_, X_WB_, i).linear()(2, 2), -1.0, 1.0));
  });
  hold_each("{height: {link: \"*\", above: -0.4, below: 0.9}}", frames,
            [&](int i) { return std::min(origin(i).z() + 0.4, 0.9 - origin(i).z()); });
  hold_each("{position: {link: \"*\", x: {above: -1, below: 0.7}, y: {above: 0.3}, z: {below: 2}}}", frames,
            [&](int i) {
              const Vec3 p = origin(i);
              return std::min({p.x() + 1, 0.7 - p.x(), p.y() - 0.3, 2 - p.z()});
            });
}

TEST_F(WitnessValues, OfJoints) {
  const int joints = model_.na();
  const auto q = [&](int k) { return q_[joint_body(k).q]; };
  const auto speed = [&](int k) { return std::abs(v_[joint_body(k).v]); };
  hold_each("{joint_limits: {margin: 0.02}}", joints, [&](int k) {
    const double room = std::min(q(k) - joint_body(k).lower, joint_body(k).upper - q(k));
    return std::isfinite(room) ? room - 0.02 : kInfinity;
  });
  hold_each("{joint_speed: {below: 2.5}}", joints,
            [&](int k) { return std::min(2.5, joint_body(k).velocity) - speed(k); });
  hold_each("{joint_speed: {joints: slide, below: 9}}", 1,
            [&](int) { return joint_body(actuator_of("slide")).velocity - speed(actuator_of("slide")); });
  hold_each("{torque_speed: {}}", joints, [&](int k) {
    if (!std::isfinite(joint_body(k).effort)) return kInfinity;
    const double left = joint_body(k).effort - joint_body(k).effort * speed(k) / joint_body(k).velocity;
    return left - std::abs(tau_(k, kLane));
  });
  hold_each("{torque_limits: {}}", joints,
            [&](int k) { return std::isfinite(joint_body(k).effort) ? headroom_(k, kLane) : kInfinity; });
}

// No state goes beyond a range, and one comes to its greatest value where there is one.
TEST_F(WitnessValues, LieWithinTheirRanges) {
  for (const char* yaml : {"{tilt: {link: \"*\", below: 4}}", "{tilt: {link: base, below: 1}}",
                           "{height: {link: base, above: 1, below: 3}}",
                           "{position: {link: \"{foot,disc}\", x: {above: -1, below: 5}, y: {above: 0, below: 1}}}",
                           "{speed: {link: \"*\", below: 2}}", "{joint_limits: {margin: 0.01}}", "{joint_speed: {}}"}) {
    const ReadWitness read = read_one(yaml, model_);
    for (int state = 0; state < 100; ++state) {
      anywhere();
      testing::write_poses(reference_poses(model_, q_), kLane, state_);
      const double value = value_of(*read.witness, model_).first;
      EXPECT_GE(value, read.range.low) << yaml;
      EXPECT_LE(value, read.range.high) << yaml;
    }
  }
  const auto high = [&](const char* yaml) { return read_one(yaml, model_).range.high; };
  const auto reached = [&](const char* yaml) {
    input();
    return value_of(*read_one(yaml, model_).witness, model_).first;
  };
  q_ << 1, 0, 0, 0, 2, 0.5, 2, 0, 0, 0;
  v_.setZero();
  for (const char* yaml : {"{tilt: {link: \"*\", below: 1}}", "{height: {link: base, above: 1, below: 3}}",
                           "{position: {link: base, x: {above: -1, below: 5}, y: {above: 0, below: 1}}}",
                           "{speed: {link: \"*\", below: 2}}", "{joint_limits: {joints: slide, margin: 3 cm}}"}) {
    EXPECT_DOUBLE_EQ(reached(yaml), high(yaml)) << yaml;
  }
  EXPECT_DOUBLE_EQ(high("{joint_limits: {joints: hip, margin: 0.2}}"), 1.3) << "3 rad from limit to limit";
  EXPECT_DOUBLE_EQ(read_one("{tilt: {link: base, below: 1}}", model_).range.low, 1 - std::numbers::pi);
  q_[0] = 0, q_[1] = 1;  // upside down
  EXPECT_NEAR(reached("{tilt: {link: base, below: 1}}"), 1 - std::numbers::pi, 1e-14);
}

// What is welded to the world has one value, which is its whole range; beside it, what moves has the worse of both.
TEST_F(WitnessValues, OfWhatIsWeldedNeverChange) {
  const Scenario fixed = testing::read(
      "graze: 1\nrobot: {urdf: robots/hopper.urdf, base: fixed, initial: {position: [0.5, 0.25, 1], rpy: [0, 0.5, "
      "0]}}\n"
      "policies: {rest: {hold: {}, control: {joint_pd: {kp: 10}}}}\n");
  const auto range = [&](const char* yaml) { return read_one(yaml, fixed.model).range; };
  for (const auto& [yaml, value] : {std::pair{"{tilt: {link: base, below: 0.7}}", 0.2},
                                    {"{height: {link: base, above: 1.5}}", -0.5},
                                    {"{position: {link: base, x: {above: 0, below: 0.75}, y: {below: 9}}}", 0.25},
                                    {"{speed: {link: base, below: 3}}", 3.0}}) {
    EXPECT_NEAR(range(yaml).low, value, 1e-12) << yaml;
    EXPECT_NEAR(range(yaml).high, value, 1e-12) << yaml;
    EXPECT_TRUE(range(yaml).of_nominal) << yaml;
  }
  const WitnessRange both = range("{height: {link: \"{base,foot}\", above: 1.5}}");
  EXPECT_NEAR(both.high, -0.5, 1e-12) << "the foot may be higher than the base";
  EXPECT_TRUE(both.never_holds() && both.of_nominal);
  EXPECT_EQ(both.low, -kInfinity);
  const WitnessRange free = range("{tilt: {link: \"{base,foot}\", below: 4}}");
  EXPECT_TRUE(free.always_holds() && !free.never_holds());
  EXPECT_DOUBLE_EQ(free.low, 4 - std::numbers::pi);
}

// A force is no less than 0, unless it is that along a direction.
TEST_F(WitnessValues, OfForcesHaveASign) {
  const auto range = [&](const std::string& more) {
    return read_one("{contact_force: {between: [foot, ground], " + more + "}}", model_).range;
  };
  EXPECT_EQ(range("below: 5").high, 5);
  EXPECT_EQ(range("below: 5").low, -kInfinity);
  EXPECT_EQ(range("above: 2").low, -2) << "where nothing presses";
  EXPECT_EQ(range("above: 2").high, kInfinity);
  EXPECT_EQ(range("above: 2, below: 5").high, 1.5);
  EXPECT_EQ(range("above: -8, below: 5").high, 5) << "at 0 N, as the middle is not to be had";
  EXPECT_EQ(range("above: -8, below: 5, direction: [0, 0, 1]").high, 6.5);
  EXPECT_TRUE(range("above: -2").always_holds());
  EXPECT_FALSE(range("above: -2, direction: [0, 0, 1]").always_holds());
}

// Words: what a table says of a witness. Units follow the joints that are meant.
TEST_F(WitnessValues, AreToldInWords) {
  const std::tuple<const char*, const char*, const char*> cases[] = {
      {"{tilt: {link: thigh, below: 90 deg}}", "tilt of thigh below 1.5708 rad", "rad"},
      {"{height: {link: \"*\", above: 0, below: 2}}", "* z > 0 m and z < 2 m", "m"},
      {"{speed: {link: foot, below: 5 cm/s}}", "speed of foot below 0.05 m/s", "m/s"},
      {"{no_contact: [foot, block.side]}", "no contact between foot and block.side", "m"},
      {"{contact: {between: [foot, ground], within: 1 cm}}", "contact between foot and ground", "m"},
      {"{self_collision: true}", "no contact between non-adjacent links", "m"},
      {"{contact_impulse: {between: [foot, ground], below: 20 mN s}}", "impulse between foot and ground below 0.02 N s",
       "N s"},
      {"{contact_impulse: {between: [foot, ground], below: 1, total: true, during: 2 ms, direction: [0, 2, 0]}}",
       "total impulse between foot and ground along (0, 2, 0) below 1 N s within 0.002 s", "N s"},
      {"{contact_force: {between: [foot, ground], above: 1, below: 2}}",
       "force between foot and ground above 1 N and below 2 N", "N"},
      {"{joint_limits: {joints: slide, margin: 1 cm}}", "position limits of slide, less 0.01 m", "m"},
      {"{joint_limits: {joints: hip}}", "position limits of hip", "rad"},
      {"{joint_limits: {margin: 0.1}}", "position limits of all joints, less 0.1 rad or m", "rad or m"},
      {"{joint_speed: {joints: \"{hip,wheel}\", below: 7}}",
       "speed of {hip,wheel} below 7 rad/s or the URDF's limits, where they are lower", "rad/s"},
      {"{joint_speed: {joints: \"{hip,wheel}\", below: 5}}", "speed of {hip,wheel} below 5 rad/s", "rad/s"},
      {"{joint_speed: {joints: \"{hip,slide}\", below: 5}}", "speed of {hip,slide} below the URDF's limits",
       "rad/s or m/s"},
      {"{joint_speed: {joints: slide, below: 9}}", "speed of slide below the URDF's limit, 2 m/s", "m/s"},
      {"{torque_limits: {joints: slide}}", "torque limits of slide", "N"},
      {"{torque_limits: {joints: hip}}", "torque limits of hip", "N m"},
      {"{torque_speed: {}}", "torque-speed line of all joints", "N m or N"},
  };
  for (const auto& [yaml, text, unit] : cases) {
    const ReadWitness read = read_one(yaml, model_);
    EXPECT_EQ(read.description, text);
    EXPECT_EQ(read.unit, unit) << yaml;
  }
}

}  // namespace
}  // namespace graze
