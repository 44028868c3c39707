#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "engine/actuation/actuators.h"
#include "tests/engine/control/support.h"

namespace graze {
namespace {

constexpr int kJoints = 12;
constexpr double kStep = 1e-3;

/// A back end that solves servos without dampers by their formula, on joints that are moved by hand.
class Servos : public FakePhysics {
 public:
  explicit Servos(const Model& model) : FakePhysics(model), model_(model) {}
  bool solves_drives() const override { return true; }
  void drive(double, LaneMask active, const Drive& drive, DriveResult& result) override {
    for (int k = 0; k < kJoints; ++k) {
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!active[lane]) continue;
        const double error = drive.q(k, lane) - state_.q(model_.bodies[model_.actuated[k]].q, lane);
        result.demand(k, lane) = drive.tau(k, lane) + drive.kp(k, lane) * error;
        result.torque(k, lane) = std::clamp(result.demand(k, lane), drive.lower(k, lane), drive.upper(k, lane));
      }
    }
    last = drive;
  }
  Drive last;

 private:
  Model model_;
};

/// Numbers that differ in each row and lane.
class Random {
 public:
  void fill(BlockArray& array, double scale) {
    for (int i = 0; i < array.rows(); ++i) {
      for (int lane = 0; lane < kLanes; ++lane) array(i, lane) = scale * normal_(random_);
    }
  }

 private:
  std::mt19937_64 random_{5};
  std::normal_distribution<double> normal_;
};

/// Joints without a limit, without a no-load speed, and with both.
Particle particle_of(const Scene& scene, int lane) {
  Particle out = scene.particle(static_cast<std::uint32_t>(lane));
  for (int k = 0; k < kJoints; ++k) {
    Body& body = out.model.bodies[scene.model.actuated[static_cast<std::size_t>(k)]];
    body.effort = (k + lane) % 5 == 0 ? std::numeric_limits<double>::infinity() : 2.0 + k;
    body.velocity = (k + lane) % 4 == 0 ? 0.0 : 1.0 + lane;
    out.joint_zero[static_cast<std::size_t>(k)] = 0.01 * k * lane;
  }
  return out;
}

/// One walk of actuators under random commands; every second lane stands still from time to time.
struct ServoWalk {
  ServoWalk(const Scene& scene, bool torque_speed, Isa isa)
      : physics(scene.model),
        actuators(scene.model, torque_speed, false, isa),
        servo_torque(scene.model, torque_speed) {
    SensorNoise noise;
    const std::vector<std::string> names = channel_names(scene.world.robot);
    noise.jitter.resize(names.size());
    Sensors sensors(scene.model, names, noise);
    for (int lane = 0; lane < kLanes; ++lane) {
      const Particle particle = particle_of(scene, lane);
      physics.start(lane, particle), sensors.start(lane, particle);
      actuators.start(lane, particle), servo_torque.start(lane, particle);
    }
    Random random;
    for (int step = 0; step < 50; ++step) advance(random, sensors, LaneMask(step % 3 == 0 ? 0b01010101 : 0b11111111));
  }
  void advance(Random& random, const Sensors& sensors, LaneMask active) {
    random.fill(physics.mutable_state().q, 1), random.fill(physics.mutable_state().v, 3);
    ActuatorCommand command(kJoints);
    random.fill(command.q, 1), random.fill(command.kp, 10), random.fill(command.tau, 1), random.fill(command.ki, 50);
    for (int lane = 0; lane < kLanes; ++lane) {
      command.ki(1, lane) = 0;
      command.prescribed(2, lane) = 1;
    }
    actuators.step(command, physics, sensors, kStep, active, tau);
    servo_torque.apply(command, physics.state(), sensors, kStep, active, tau_of_formula);
    compare();
  }
  /// The lanes' kernels against the sums that back ends without drives are given, lane by lane.
  void compare() const {
    for (int k = 0; k < kJoints; ++k) {
      for (int lane = 0; lane < kLanes; ++lane) {
        const double limit = 1e-12 * (1 + std::abs(tau_of_formula(k, lane)));
        EXPECT_NEAR(tau(k, lane), tau_of_formula(k, lane), limit) << "joint " << k << ", lane " << lane;
        const double a = actuators.headroom()(k, lane), b = servo_torque.headroom()(k, lane);
        EXPECT_TRUE(a == b || std::abs(a - b) < 1e-11) << a << " and " << b << ", joint " << k << ", lane " << lane;
      }
    }
  }
  Servos physics;
  Actuators actuators, servo_torque;
  BlockArray tau{kJoints}, tau_of_formula{kJoints};
};

void expect_equal(const BlockArray& a, const BlockArray& b, const std::string& isa) {
  ASSERT_EQ(a.rows(), b.rows());
  for (int k = 0; k < a.rows(); ++k) {
    for (int lane = 0; lane < kLanes; ++lane) EXPECT_EQ(a(k, lane), b(k, lane)) << isa;
  }
}

// Servos that a back end solves are filled and followed on lanes as apply() sums them number by number, and with the
// same bits whatever the instruction set; lanes that stand still keep torque, headroom and integral.
TEST(ServoLanes, FollowTheFormulaWithTheSameBitsForEveryInstructionSet) {
  const Scene scene{links_world()};
  for (const bool torque_speed : {false, true}) {
    const ServoWalk want(scene, torque_speed, Isa::portable);
    for (const Isa isa : available_isas()) {
      const ServoWalk got(scene, torque_speed, isa);
      expect_equal(got.tau, want.tau, isa_name(isa));
      expect_equal(got.actuators.headroom(), want.actuators.headroom(), isa_name(isa));
      expect_equal(got.physics.last.upper, want.physics.last.upper, isa_name(isa));
      expect_equal(got.physics.last.lower, want.physics.last.lower, isa_name(isa));
      expect_equal(got.physics.last.tau, want.physics.last.tau, isa_name(isa));
    }
  }
}

// What is prescribed beyond all limits has none, on lanes, too.
TEST(ServoLanes, PrescribedMotionMayBeBeyondTheLimits) {
  const Scene scene{links_world()};
  Servos physics(scene.model);
  SensorNoise noise;
  const std::vector<std::string> names = channel_names(scene.world.robot);
  noise.jitter.resize(names.size());
  Sensors sensors(scene.model, names, noise);
  Actuators actuators(scene.model, true, true);
  for (int lane = 0; lane < kLanes; ++lane) {
    physics.start(lane, scene.particle()), sensors.start(lane, scene.particle()),
        actuators.start(lane, scene.particle());
  }
  ActuatorCommand command(kJoints);
  BlockArray tau(kJoints);
  command.prescribed(0, 3) = 2;
  command.tau(0, 3) = command.tau(0, 4) = 100;
  actuators.step(command, physics, sensors, kStep, LaneMask::all(), tau);
  EXPECT_EQ(tau(0, 3), 100);
  EXPECT_EQ(tau(0, 4), 7.3);
}

}  // namespace
}  // namespace graze
