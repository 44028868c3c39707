#include "engine/sensing/sensors.h"

#include <random>

#include "engine/actuation/actuators.h"
#include "engine/model/measures.h"
#include "sampling/stream.h"
#include "tests/engine/control/leg_reference.h"
#include "tests/engine/control/support.h"

namespace graze {
namespace {

class SensorsAndActuators : public ::testing::Test {
 protected:
  SensorsAndActuators() {
    noise.jitter.resize(names.size());
    noise.seed = 42;
    tau = BlockArray(scene.model.na());
  }
  int channel(const std::string& name) const {
    const auto found = std::find(names.begin(), names.end(), name);
    EXPECT_NE(found, names.end()) << name;
    return static_cast<int>(found - names.begin());
  }
  Observation sense(Sensors& sensors, std::uint32_t step, LaneMask active = LaneMask::all()) {
    std::array<std::uint32_t, kLanes> steps;
    steps.fill(step);
    Observation out;
    sensors.sense(physics, tau, 1e-3, steps, {}, active, out);
    return out;
  }

  Scene scene{links_world()};
  std::vector<std::string> names = channel_names(scene.world.robot);
  FakePhysics physics{scene.model};
  SensorNoise noise;
  BlockArray tau;
};

// Without bias, zero and jitter every sensor tells the truth.
TEST_F(SensorsAndActuators, ExactWithoutErrors) {
  Sensors sensors(scene.model, names, noise);
  const Particle particle = scene.particle();
  for (int lane = 0; lane < kLanes; ++lane) {
    physics.start(lane, particle);
    sensors.start(lane, particle);
  }
  const Vec3 rpy(0.1, -0.2, 2.5);
  const Quat attitude(rotation_from_rpy(rpy));
  BlockState& state = physics.mutable_state();
  state.q.set_column(3, Eigen::Vector4d(attitude.w(), attitude.x(), attitude.y(), attitude.z()));
  state.q.set_column(3, Vec3(1, 2, 3), 4);
  state.v.set_column(3, (Eigen::VectorXd(6) << 4, 5, 6, 7, 8, 9).finished());
  state.a.set_column(3, (Eigen::VectorXd(6) << 10, 11, 12, 13, 14, 15).finished());
  const int knee = scene.model.joint("LF_Y_3");
  state.v(scene.model.bodies[knee].v, 3) = 0.5;
  state.a(scene.model.bodies[knee].v, 3) = -0.25;
  tau(2, 3) = 1.5;
  const Observation out = sense(sensors, 0);
  EXPECT_LT((out.base_rpy.vec3(0, 3) - rpy).norm(), 1e-14);
  EXPECT_EQ(out.base_position.vec3(0, 3), Vec3(1, 2, 3));
  EXPECT_EQ(out.base_rate.vec3(0, 3), Vec3(4, 5, 6));
  EXPECT_EQ(out.base_velocity.vec3(0, 3), Vec3(7, 8, 9));
  EXPECT_EQ(out.imu_angular.vec3(0, 3), Vec3(10, 11, 12));
  EXPECT_EQ(out.imu_linear.vec3(0, 3), Vec3(13, 14, 15));
  ASSERT_EQ(scene.model.actuated[2], knee);
  EXPECT_EQ(out.joint_position(2, 3), 1.2);
  EXPECT_EQ(out.joint_velocity(2, 3), 0.5);
  EXPECT_EQ(out.joint_acceleration(2, 3), -0.25);
  EXPECT_EQ(out.joint_torque(2, 3), 1.5);
}

// The encoder reads q - zero + bias + jitter, the jitter being the quantile of the channel's own stream at this step;
// other channels stay as they are, and lanes that are not active keep their reading.
TEST_F(SensorsAndActuators, EncoderErrorIsZeroBiasAndJitter) {
  const std::string name = "sensor.encoder.RF_Y_2.position";
  const int c = channel(name);
  noise.jitter[c] = Distribution::normal(0, 0.003);
  Sensors sensors(scene.model, names, noise);
  Particle particle = scene.particle(17);
  const int k = 4;  // RF_Y_2
  ASSERT_EQ(scene.model.bodies[scene.model.actuated[k]].joint, "RF_Y_2");
  particle.joint_zero[k] = 0.025;
  particle.sensor_bias[c] = -0.01;
  physics.start(0, particle);
  physics.start(1, particle);
  sensors.start(0, particle);
  sensors.start(1, particle);
  for (const std::uint32_t step : {0u, 1u, 1000u}) {
    const Observation out = sense(sensors, step, LaneMask::first(1));
    const double jitter = noise.jitter[c]->quantile(uniform(42, 17, name_hash(name), step));
    EXPECT_DOUBLE_EQ(out.joint_position(k, 0), -0.8 - 0.025 - 0.01 + jitter);
    EXPECT_EQ(sensors.encoder_error()(k, 0) + -0.8, out.joint_position(k, 0));
    EXPECT_DOUBLE_EQ(out.joint_position(k + 1, 0), -1.2);
    EXPECT_EQ(out.joint_position(k, 1), 0.0);
    EXPECT_DOUBLE_EQ(sensors.encoder_error()(k, 1), -0.035);
  }
}

// Each channel of channel_names() drives its own reading, and no other, by exactly its bias; those of contact flags are
// probabilities (below).
TEST_F(SensorsAndActuators, EveryChannelHasOneReading) {
  for (int c = 0; c < static_cast<int>(names.size()); ++c) {
    if (names[c].starts_with("sensor.contact.")) continue;
    Sensors sensors(scene.model, names, noise);
    Particle particle = scene.particle();
    physics.start(0, particle);
    sensors.start(0, particle);
    const Observation clean = sense(sensors, 0, LaneMask::first(1));
    particle.sensor_bias[c] = 0.5;
    sensors.start(0, particle);
    const Observation biased = sense(sensors, 0, LaneMask::first(1));
    double changed = 0;
    int readings = 0;
    const auto compare = [&](const BlockArray& a, const BlockArray& b) {
      for (int i = 0; i < a.rows(); ++i) {
        if (a(i, 0) == b(i, 0)) continue;
        ++readings;
        changed += b(i, 0) - a(i, 0);
      }
    };
    compare(clean.joint_position, biased.joint_position);
    compare(clean.joint_velocity, biased.joint_velocity);
    compare(clean.joint_acceleration, biased.joint_acceleration);
    compare(clean.joint_torque, biased.joint_torque);
    compare(clean.base_position, biased.base_position);
    compare(clean.base_rpy, biased.base_rpy);
    compare(clean.base_velocity, biased.base_velocity);
    compare(clean.base_rate, biased.base_rate);
    compare(clean.imu_linear, biased.imu_linear);
    compare(clean.imu_angular, biased.imu_angular);
    compare(BlockArray(scene.model.na()), sensors.torque_error());
    EXPECT_EQ(readings, 1) << names[c];
    EXPECT_NEAR(changed, 0.5, 1e-15) << names[c];
  }
}

// The force on a link is the sum of the normal impulses of its contacts over the step's length.
TEST_F(SensorsAndActuators, LinkForceSumsContacts) {
  Sensors sensors(scene.model, names, noise);
  const Particle particle = scene.particle();
  physics.start(0, particle);
  sensors.start(0, particle);
  const int foot = scene.model.collider("LF_FOOT"), ground = scene.model.collider("ground");
  ASSERT_GE(foot, 0);
  ASSERT_GE(ground, 0);
  Contact contact;
  contact.a = std::min(foot, ground);
  contact.b = std::max(foot, ground);
  contact.impulse_W = {1e-3, 0, 2e-3};
  physics.set_contacts(0, {contact, contact});
  const Observation out = sense(sensors, 0, LaneMask::first(1));
  for (int f = 0; f < out.link_force.rows(); ++f) {
    EXPECT_DOUBLE_EQ(out.link_force(f, 0), scene.model.frames[f].name == "LF_FOOT" ? 4.0 : 0.0);
  }
}

class ContactFlags : public SensorsAndActuators {
 protected:
  /// One foot of four touches in all lanes, the particles differ.
  void stand(Sensors& sensors, double missed, double invented) {
    for (int lane = 0; lane < kLanes; ++lane) {
      Particle particle = scene.particle(static_cast<std::uint32_t>(100 + lane));
      particle.sensor_bias[channel("sensor.contact.LF_FOOT.missed")] = missed;
      particle.sensor_bias[channel("sensor.contact.RF_FOOT.missed")] = missed;
      particle.sensor_bias[channel("sensor.contact.RF_FOOT.false")] = invented;
      physics.start(lane, particle);
      sensors.start(lane, particle);
      Contact contact;
      const int foot = scene.model.collider("LF_FOOT"), ground = scene.model.collider("ground");
      contact.a = std::min(foot, ground);
      contact.b = std::max(foot, ground);
      contact.impulse_W = {0, 0, 2e-3};
      physics.set_contacts(lane, {contact});
    }
  }
  int row(const std::string& link) const { return scene.model.frame(link); }
};

// Claim: a touch is missed, and one is invented where there is none, each as often as its probability says,
// independently from step to step, particle to particle and flag to flag; other links are read exactly. 80,000 draws
// each, and 5 standard errors: a right program fails once in a million runs, and this one draws the same numbers each
// time.
TEST_F(ContactFlags, ErrAsOftenAsTheyShould) {
  Sensors sensors(scene.model, names, noise);
  const double missed = 0.2, invented = 0.03, weight = 9.81 * [&] {
    double mass = 0;
    for (const Body& body : scene.model.bodies) mass += body.mass;
    return mass;
  }();
  stand(sensors, missed, invented);
  constexpr int kSteps = 10'000;
  double misses = 0, inventions = 0, both = 0, repeated = 0;
  std::array<bool, kLanes> before{};
  for (std::uint32_t step = 0; step < kSteps; ++step) {
    const Observation out = sense(sensors, step);
    for (int lane = 0; lane < kLanes; ++lane) {
      const double left = out.link_force(row("LF_FOOT"), lane), right = out.link_force(row("RF_FOOT"), lane);
      ASSERT_TRUE(left == 2.0 || left == 0.0);
      ASSERT_TRUE(right == 0.0 || std::abs(right - weight) < 1e-9 * weight);
      misses += left == 0;
      inventions += right > 0;
      both += left == 0 && right > 0;
      repeated += left == 0 && before[lane];
      before[lane] = left == 0;
      EXPECT_EQ(out.link_force(row("LH_FOOT"), lane), 0.0);
    }
  }
  const double n = kSteps * kLanes;
  const auto expect_rate = [&](double count, double p, const char* what) {
    EXPECT_NEAR(count / n, p, 5 * std::sqrt(p * (1 - p) / n)) << what;
  };
  expect_rate(misses, missed, "missed");
  expect_rate(inventions, invented, "invented");
  expect_rate(both, missed * invented, "both at once");
  expect_rate(repeated, missed * missed, "twice in a row");
}

// Claim: each draw is the uniform of its channel's own stream at this step, whatever other flags may err; probabilities
// of 0 and 1 are certain; whoever does not read forces draws nothing.
TEST_F(ContactFlags, DrawByTheirOwnStream) {
  Sensors sensors(scene.model, names, noise), alone(scene.model, names, noise);
  const std::uint64_t name = name_hash("sensor.contact.LF_FOOT.missed");
  stand(alone, 0.5, 0);
  stand(sensors, 0.5, 0.5);
  for (std::uint32_t step = 0; step < 50; ++step) {
    const Observation out = sense(sensors, step), other = sense(alone, step);
    for (int lane = 0; lane < kLanes; ++lane) {
      const bool missed = uniform(42, static_cast<std::uint32_t>(100 + lane), name, step) < 0.5;
      EXPECT_EQ(out.link_force(row("LF_FOOT"), lane) == 0, missed);
      EXPECT_EQ(other.link_force(row("LF_FOOT"), lane), out.link_force(row("LF_FOOT"), lane));
    }
  }
  stand(sensors, 1, 1);
  EXPECT_EQ(sense(sensors, 3).link_force(row("LF_FOOT"), 0), 0.0);
  EXPECT_GT(sense(sensors, 3).link_force(row("RF_FOOT"), 0), 0.0);
  stand(sensors, 0, 0);
  EXPECT_EQ(sense(sensors, 3).link_force(row("LF_FOOT"), 0), 2.0);
  EXPECT_EQ(sense(sensors, 3).link_force(row("RF_FOOT"), 0), 0.0);
}

// Claim: a touch that is not there reads the robot's weight, however heavy the things are that lie about.
TEST_F(ContactFlags, AFalseTouchReadsTheRobotsWeightAlone) {
  Sensors alone(scene.model, names, noise);
  stand(alone, 0, 1);
  const double weight = sense(alone, 3).link_force(row("RF_FOOT"), 0);
  const Scene crowded{links_world_with_anvil()};
  Sensors beside(crowded.model, names, noise, kLinkForce);
  stand(beside, 0, 1);
  EXPECT_EQ(sense(beside, 3).link_force(row("RF_FOOT"), 0), weight);
  EXPECT_DOUBLE_EQ(weight, robot_weight(crowded.model));
}

// A group that nobody reads is NaN, and leaving it out changes no bit of the others.
TEST_F(SensorsAndActuators, UnreadGroupsChangeNoOther) {
  for (auto& jitter : noise.jitter) jitter = Distribution::normal(0, 0.01);
  const auto arrays = [](const Observation& o) {
    return std::array{&o.joint_position, &o.joint_velocity, &o.joint_acceleration, &o.joint_torque, &o.base_position,
                      &o.base_rpy,       &o.base_velocity,  &o.base_rate,          &o.imu_linear,   &o.imu_angular,
                      &o.link_force,     &o.link_push,      &o.object_state};
  };
  const Particle particle = scene.particle(5);
  const auto sensed = [&](unsigned reads) {
    Sensors sensors(scene.model, names, noise, reads);
    for (int lane = 0; lane < kLanes; ++lane) {
      physics.start(lane, particle);
      sensors.start(lane, particle);
    }
    Observation out = sense(sensors, 3);
    out.joint_position.row(0)[0] += sensors.torque_error()(0, 0);  // the actuators' share is drawn in any case
    return out;
  };
  const Observation all = sensed(kAllGroups);
  const auto want = arrays(all);
  // In the order of `arrays`.
  constexpr unsigned kGroups[] = {kJointPosition, kJointVelocity, kJointAcceleration, kJointTorque, kBasePosition,
                                  kBaseRpy,       kBaseVelocity,  kBaseRate,          kImuLinear,   kImuAngular,
                                  kLinkForce,     kLinkPush,      kObjectState};
  ASSERT_EQ(std::size(kGroups), want.size());
  for (const unsigned group : kGroups) {
    for (const unsigned reads : {group, kAllGroups & ~group}) {
      const Observation some = sensed(reads | kJointPosition);
      for (std::size_t g = 0; g < want.size(); ++g) {
        const bool read = ((reads | kJointPosition) & kGroups[g]) != 0;
        for (int i = 0; i < want[g]->rows(); ++i) {
          for (int lane = 0; lane < kLanes; ++lane) {
            const double got = (*arrays(some)[g])(i, lane);
            EXPECT_TRUE(read ? got == (*want[g])(i, lane) : std::isnan(got)) << "group " << g;
          }
        }
      }
    }
  }
}

// Parts of a group are read alone: what is left out is NaN, the rest has the bits that it has in company.
TEST_F(SensorsAndActuators, PartsOfTheBasePoseAreReadAlone) {
  for (auto& jitter : noise.jitter) jitter = Distribution::normal(0, 0.01);
  const Particle particle = scene.particle(5);
  const auto sensed = [&](unsigned reads) {
    Sensors sensors(scene.model, names, noise, reads);
    for (int lane = 0; lane < kLanes; ++lane) {
      physics.start(lane, particle);
      sensors.start(lane, particle);
    }
    return sense(sensors, 3);
  };
  const Observation all = sensed(kAllGroups), level = sensed(kBaseTilt | kBaseHeight),
                    flat = sensed(kBaseYaw | kBasePlace);
  for (int i = 0; i < 3; ++i) {
    const Observation &has = i < 2 ? level : flat, &has_not = i < 2 ? flat : level;
    EXPECT_EQ(has.base_rpy(i, 0), all.base_rpy(i, 0));
    EXPECT_TRUE(std::isnan(has_not.base_rpy(i, 0)));
    EXPECT_EQ(has_not.base_position(i, 0), all.base_position(i, 0));
    EXPECT_TRUE(std::isnan(has.base_position(i, 0)));
  }
}

// Roll, pitch and yaw on lanes are those of kinematics.h, all round and beside pitch = +-90 deg, where only the
// rotation that they make up is well conditioned.
TEST_F(SensorsAndActuators, AttitudeIsThatOfTheQuaternion) {
  Sensors sensors(scene.model, names, noise);
  const Particle particle = scene.particle();
  for (int lane = 0; lane < kLanes; ++lane) {
    physics.start(lane, particle);
    sensors.start(lane, particle);
  }
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> turn(-M_PI, M_PI), beside(-1e-9, 1e-9);
  for (std::uint32_t trial = 0; trial < 500; ++trial) {
    std::array<Mat3, kLanes> R;
    for (int lane = 0; lane < kLanes; ++lane) {
      const double pitch = lane < 6 ? turn(random) / 2 : (lane == 6 ? 1 : -1) * M_PI / 2 + beside(random);
      const Quat attitude(rotation_from_rpy(Vec3(turn(random), pitch, turn(random))));
      R[lane] = attitude.toRotationMatrix();
      physics.mutable_state().q.set_column(lane,
                                           Eigen::Vector4d(attitude.w(), attitude.x(), attitude.y(), attitude.z()));
    }
    const Observation out = sense(sensors, trial);
    for (int lane = 0; lane < kLanes; ++lane) {
      const Vec3 rpy = out.base_rpy.vec3(0, lane);
      EXPECT_LT((rotation_from_rpy(rpy) - R[lane]).norm(), 5e-15);
      if (std::fabs(rpy[1]) < 1.5) {
        EXPECT_LT((rpy - rpy_from_rotation(R[lane])).norm(), 1e-13);
      }
    }
  }
}

// The readings are the same bits for every instruction set.
TEST_F(SensorsAndActuators, ReadingsAreTheSameBitsForEveryInstructionSet) {
  for (auto& jitter : noise.jitter) jitter = Distribution::normal(0, 0.01);
  BlockState& state = physics.mutable_state();
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  const auto fill = [&](BlockArray& array) {
    for (int i = 0; i < array.rows(); ++i) {
      for (int lane = 0; lane < kLanes; ++lane) array(i, lane) = normal(random);
    }
  };
  Particle particle = scene.particle(3);
  for (int lane = 0; lane < kLanes; ++lane) physics.start(lane, particle);
  fill(state.v);
  fill(state.a);
  fill(tau);
  for (int lane = 0; lane < kLanes; ++lane) {
    const Quat attitude(rotation_from_rpy(Vec3(normal(random), normal(random), normal(random))));
    state.q.set_column(lane, Eigen::Vector4d(attitude.w(), attitude.x(), attitude.y(), attitude.z()));
  }
  const auto sensed = [&](Isa isa) {
    Sensors sensors(scene.model, names, noise, kAllGroups, isa);
    for (int lane = 0; lane < kLanes; ++lane) sensors.start(lane, particle);
    return sense(sensors, 7);
  };
  const Observation want = sensed(Isa::portable);
  for (const Isa isa : available_isas()) {
    const Observation got = sensed(isa);
    for (const auto group :
         {&Observation::joint_position, &Observation::joint_velocity, &Observation::joint_acceleration,
          &Observation::joint_torque, &Observation::base_position, &Observation::base_rpy, &Observation::base_velocity,
          &Observation::base_rate, &Observation::imu_linear, &Observation::imu_angular}) {
      for (int i = 0; i < (want.*group).rows(); ++i) {
        for (int lane = 0; lane < kLanes; ++lane) {
          EXPECT_EQ((got.*group)(i, lane), (want.*group)(i, lane)) << isa_name(isa);
        }
      }
    }
  }
}

class ActuatorTest : public SensorsAndActuators {
 protected:
  /// One servo step of joint 0 at q, v; the others idle.
  double torque(Actuators& actuators, const Sensors& sensors, double q, double v) {
    physics.mutable_state().q(scene.model.bodies[scene.model.actuated[0]].q, 0) = q;
    physics.mutable_state().v(scene.model.bodies[scene.model.actuated[0]].v, 0) = v;
    actuators.apply(command, physics.state(), sensors, h, LaneMask::first(1), tau);
    return tau(0, 0);
  }
  ActuatorCommand command{12};
  double h = 1e-3;
};

// tau + kp (q_des - q_enc) + kd (v_des - v_enc), cut at the effort limit, and headroom = limit - |asked|. The step is
// so short that the damper's implicit integration (the next test) changes nothing to 1e-9.
TEST_F(ActuatorTest, ServoAndTorqueLimit) {
  Sensors sensors(scene.model, names, noise);
  Particle particle = scene.particle();
  particle.joint_zero[0] = 0.1;
  particle.sensor_bias[channel("actuator.torque.LF_X_1")] = 0.25;
  sensors.start(0, particle);
  Actuators actuators(scene.model, false);
  actuators.start(0, particle);
  command.kp(0, 0) = 20;
  command.kd(0, 0) = 0.1;
  command.q(0, 0) = 0.3;
  command.v(0, 0) = 1;
  command.tau(0, 0) = 0.5;
  h = 1e-15;
  const double asked = 0.5 + 20 * (0.3 - (0.2 - 0.1)) + 0.1 * (1 - 3.0) + 0.25;
  EXPECT_NEAR(torque(actuators, sensors, 0.2, 3.0), asked, 1e-9);
  EXPECT_NEAR(actuators.headroom()(0, 0), 7.3 - asked, 1e-9);
  command.q(0, 0) = -3;
  EXPECT_EQ(torque(actuators, sensors, 0.2, 3.0), -7.3);
  EXPECT_LT(actuators.headroom()(0, 0), 0);
}

// A damper acts on the velocity that it leads to: tau = -kd (v + h M^-1 tau) for a whole leg, with the leg's inertia
// from the sum over its bodies, which is computed another way. Strong dampers stop the leg within the step, no more.
TEST_F(ActuatorTest, DampersAreImplicit) {
  Sensors sensors(scene.model, names, noise);
  const Particle particle = scene.particle();
  sensors.start(0, particle);
  physics.start(0, particle);
  Actuators actuators(scene.model, false);
  actuators.start(0, particle);
  const Chain leg(scene.model, scene.model.frame("LF_FOOT"));
  const Eigen::Matrix3d M = leg_inertia(scene.model, leg, leg.select(scene.initial.q));
  const Eigen::Vector3d v(0.3, -1, 2);
  for (const double kd : {0.01, 0.1, 1e6}) {
    for (int k = 0; k < 3; ++k) {
      command.kd(k, 0) = kd;
      physics.mutable_state().v(scene.model.bodies[scene.model.actuated[k]].v, 0) = v[k];
    }
    actuators.apply(command, physics.state(), sensors, h, LaneMask::first(1), tau);
    const Eigen::Vector3d torque = tau.column(0, 0, 3), ahead = v + h * M.inverse() * torque;
    EXPECT_LT((ahead + torque / kd).norm(), 1e-12 * v.norm());
    EXPECT_LT(ahead.norm(), kd > 1 ? 1e-6 : v.norm());
  }
}

// §6.1.1: in the direction of motion the torque falls on a line to 0 at the no-load speed (15 rad/s); against it the
// motor brakes with its full torque.
TEST_F(ActuatorTest, TorqueSpeedLine) {
  Sensors sensors(scene.model, names, noise);
  const Particle particle = scene.particle();
  sensors.start(0, particle);
  Actuators actuators(scene.model, true);
  actuators.start(0, particle);
  command.tau(0, 0) = 100;
  EXPECT_NEAR(torque(actuators, sensors, 0, 0), 7.3, 1e-14);
  EXPECT_NEAR(torque(actuators, sensors, 0, 5), 7.3 * 2 / 3, 1e-14);
  EXPECT_EQ(torque(actuators, sensors, 0, 20), 0);
  EXPECT_EQ(torque(actuators, sensors, 0, -5), 7.3);
  command.tau(0, 0) = -100;
  EXPECT_NEAR(torque(actuators, sensors, 0, -5), -7.3 * 2 / 3, 1e-14);
  EXPECT_EQ(torque(actuators, sensors, 0, 5), -7.3);
}

// The integral grows by error times time, and does not wind up while the torque is cut.
TEST_F(ActuatorTest, IntegralWithoutWindup) {
  Sensors sensors(scene.model, names, noise);
  const Particle particle = scene.particle();
  sensors.start(0, particle);
  Actuators actuators(scene.model, false);
  actuators.start(0, particle);
  command.ki(0, 0) = 100;
  command.q(0, 0) = 0.5;
  for (int i = 0; i < 20; ++i) torque(actuators, sensors, 0, 0);
  EXPECT_NEAR(torque(actuators, sensors, 0, 0), 100 * 0.5 * 20 * h, 1e-12);
  for (int i = 0; i < 10000; ++i) torque(actuators, sensors, 0, 0);
  EXPECT_EQ(tau(0, 0), 7.3);
  // A wound-up integral (100 * 0.5 * 10 s = 500 N m) would take seconds to come back; this one is back within
  // one step's worth of error.
  command.q(0, 0) = -0.5;
  torque(actuators, sensors, 0, 0);
  torque(actuators, sensors, 0, 0);
  EXPECT_LT(tau(0, 0), 7.3);
}

}  // namespace
}  // namespace graze
