// The base stabiliser of a gait: moments from the base's attitude, pushes of the feet, and a walking robot that it
// rights.

#include "engine/control/base_stabilizer.h"

#include <random>

#include "engine/dynamics/chain.h"
#include "engine/model/rotation.h"
#include "tests/engine/control/closed_loop.h"

namespace graze {
namespace {

using Vector = Vec3T<double>;

// The moment is -(kp angle + kd rate) about the base's own axes: rates are turned there from the world's by the whole
// attitude, here by the rotation matrix that the model uses.
TEST(BaseStabilizer, MomentIsOfTheBasesAxes) {
  const BaseStabilizer law{true, 3, 2, 0.1, -0.2};
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int n = 0; n < 100; ++n) {
    const Vec3 rpy(u(generator), u(generator), 3 * u(generator)), rate(u(generator), u(generator), u(generator));
    const Vec3 own = rotation_from_rpy(rpy).transpose() * rate;
    const Vector moment = righting_moment<double>(law, rpy.x(), rpy.y(), rpy.z(), Vector{rate.x(), rate.y(), rate.z()});
    EXPECT_NEAR(moment.x, -3 * (rpy.x() - 0.1) - 2 * own.x(), 1e-12);
    EXPECT_NEAR(moment.y, -3 * (rpy.y() + 0.2) - 2 * own.y(), 1e-12);
    EXPECT_EQ(moment.z, 0);
  }
}

// Pushes are the least of all that only push: no small change of a foot's push, where it may change, makes the
// weighted error less. Where four feet stand around the base, the moment is what was asked for.
TEST(BaseStabilizer, PushesAreNearestAndNeverPull) {
  const Vector x[4] = {{0.2, 0.1, -0.15}, {0.2, -0.1, -0.15}, {-0.2, 0.1, -0.15}, {-0.2, -0.1, -0.15}};
  const Vector up{0, 0, 1};
  std::mt19937 generator(4);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int n = 0; n < 200; ++n) {
    unsigned stands[4];
    for (unsigned& foot : stands) foot = n < 100 || u(generator) > 0 ? 1u : 0u;
    const Vector moment{u(generator), u(generator), 0};
    double push[4];
    righting_pushes<double>(4, x, stands, up, moment, push);
    const auto error = [&](const double* f) {
      double mx = -moment.x, my = -moment.y, sum = 0;
      for (int i = 0; i < 4; ++i) mx += x[i].y * f[i], my -= x[i].x * f[i], sum += f[i] * f[i];
      return mx * mx + my * my + kStabilizerDamping * 0.05 * sum;
    };
    for (int i = 0; i < 4; ++i) {
      EXPECT_GE(push[i], 0);
      if (stands[i] == 0) {
        EXPECT_EQ(push[i], 0);
      }
    }
    double mx = 0, my = 0;
    for (int i = 0; i < 4; ++i) mx += x[i].y * push[i], my -= x[i].x * push[i];
    if (n < 100) {
      EXPECT_LT(std::hypot(mx - moment.x, my - moment.y), 0.05 * std::hypot(moment.x, moment.y)) << n;
    }
    for (int i = 0; i < 4; ++i) {
      for (const double change : {-0.3, 0.3}) {
        if (stands[i] == 0 || push[i] + change < 0) continue;
        double other[4] = {push[0], push[1], push[2], push[3]};
        other[i] += change;
        EXPECT_GE(error(other), error(push)) << n << ' ' << i;
      }
    }
  }
}

// Rolled to the right, the robot presses with its right feet alone: the joint torques of each are those of a push p
// along the world's vertical, by differences of the foot's place, and the moment of both pushes is kp times the roll.
TEST(BaseStabilizer, PressesOnTheLowSide) {
  SensedAtRest at;
  const double roll = 0.1, kp = 10;
  at.observation.base_rate = BlockArray(3);
  for (int lane = 0; lane < kLanes; ++lane) at.observation.base_rpy(0, lane) = roll;
  const std::string policy =
      "{gait: {velocity: [0, 0, 0], duration: 0.3 s, duty: 75 %, liftoff: '[25, 75, 0, 50] %', step_height: 3 cm, "
      "settle: 1 s, recovery: false, stabilizer: {kp: 10, kd: 2}}, control: {operational_pd: {kp: 1000, kd: 20}}}";
  Controller controller(at.scene.context(), Settings::parse(policy, "policy.yaml"));
  controller.start(0, 0, 0);
  LaneMask active;
  active.set(0);
  controller.act(at.observation, nullptr, active, at.command);
  const Model& model = at.scene.model;
  const Vec3 up = rotation_from_rpy({roll, 0, 0}).transpose() * Vec3::UnitZ();
  double moment = 0;
  for (const int frame : controller.policy().effectors()) {
    const Chain chain(model, frame);
    const Chain::Values q = chain.select(at.scene.initial.q);
    const Vec3 foot = chain.position(q);
    double work = 0, moved = 0;  // tau . J^T up, |J^T up|^2
    std::vector<std::pair<double, double>> rows;
    for (int j = 0; j < static_cast<int>(q.size()); ++j) {
      Chain::Values ahead = q, behind = q;
      ahead[j] += 1e-6, behind[j] -= 1e-6;
      const double slope = (chain.position(ahead) - chain.position(behind)).dot(up) / 2e-6;
      const double tau = controller.targets().tau(chain.view().joint[j].actuator, 0);
      rows.emplace_back(tau, slope);
      work += tau * slope, moved += slope * slope;
    }
    const double push = -work / moved;
    for (const auto& [tau, slope] : rows) EXPECT_NEAR(tau, -push * slope, 1e-7);
    if (foot.y() > 0) {
      EXPECT_EQ(push, 0);
    } else {
      EXPECT_GT(push, 1);
    }
    moment += push * foot.cross(up).x();
  }
  EXPECT_NEAR(moment, -kp * roll, 0.02 * kp * roll);
}

// Only what floats can be righted.
TEST(BaseStabilizer, IsRefusedForAFixedBase) {
  World world = links_world();
  world.robot.floating_base = false;
  world.initial.on_ground = false;
  const Scene scene(std::move(world));
  const std::string message = input_error([&] {
    Controller(
        scene.context(),
        Settings::parse("{gait: {velocity: [0, 0, 0], duration: 0.3 s, duty: 75 %, liftoff: '[25, 75, 0, 50] %', "
                        "step_height: 3 cm, stabilizer: {kd: 2}}, control: {operational_pd: {kp: 1000, kd: 20}}}",
                        "policy.yaml"));
  });
  EXPECT_NE(message.find("stabilizer"), std::string::npos) << message;
  EXPECT_NE(message.find("fixed to the world"), std::string::npos) << message;
}

}  // namespace
}  // namespace graze
