// Control on lanes: agreement with computations of one lane at a time, and bits that depend on nothing but the lane's
// own trace.

#include <gtest/gtest.h>

#include <cstdlib>
#include <deque>
#include <memory>
#include <random>
#include <tuple>

#include "engine/control/gait_planner.h"
#include "engine/control/gait_timing.h"
#include "engine/control/ik.h"
#include "engine/lanes/isa.h"
#include "tests/engine/control/leg_reference.h"
#include "tests/engine/control/scalar_gait.h"
#include "tests/engine/control/support.h"

namespace graze {
namespace {

using Eight = Pack<8>;

double lane_of(const Eight& a, int lane) {
  double out[8];
  store(out, a);
  return out[lane];
}
Vec3 lane_of(const Vec3T<Eight>& a, int lane) { return {lane_of(a.x, lane), lane_of(a.y, lane), lane_of(a.z, lane)}; }
void set_lane(Eight& a, int lane, double value) {
  double out[8];
  store(out, a);
  out[lane] = value;
  a = load<Eight>(out);
}
void set_lane(Vec3T<Eight>& a, int lane, const Vec3& value) {
  set_lane(a.x, lane, value.x());
  set_lane(a.y, lane, value.y());
  set_lane(a.z, lane, value.z());
}
Vec3T<double> to_lane(const Vec3& a) { return {a.x(), a.y(), a.z()}; }

/// Random gaits of four feet: walks, trots and gaits with flights, with and without each option.
GaitParameters random_gait(std::mt19937& generator) {
  const auto u = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator); };
  GaitParameters p;
  std::vector<double> touchdown, duty;
  const double share = u(0.3, 0.8);
  for (int i = 0; i < 4; ++i) {
    touchdown.push_back(u(0, 1) < 0.5 ? 0.25 * i : 0.5 * (i % 2));
    duty.push_back(share);
  }
  p.timing = make_timing(touchdown, duty, u(0.2, 0.5));
  p.step_height = u(0.01, 0.05);
  p.overshoot = u(-0.3, 0.3);
  p.redirect = u(0.3, 1);
  p.settle = u(0, 1) < 0.5 ? 0 : u(0.05, 0.2);
  p.global_up = u(0, 1) < 0.5;
  p.recovery = u(0, 1) < 0.7;
  p.contact_force = 2;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{p.R_GB} =
      rotation_from_rpy({u(-0.1, 0.1), u(-0.1, 0.1), u(-0.1, 0.1)});
  for (int i = 0; i < 4; ++i) {
    const double x = i < 2 ? 0.12 : -0.12, y = i % 2 == 0 ? 0.08 : -0.08;
    Vec3::Map(p.origin[i]) = Vec3(x, y, -0.14);
    Vec3::Map(p.hip[i]) = Vec3(x, y / 2, -0.02);
    p.reach[i] = u(0.14, 0.17);
  }
  return p;
}

// Eight lanes that begin at different times, are told different commands and feel different ground do what the same
// algorithm does one lane at a time in Eigen, to 1e-12 m and m/s times what rounding in the splines' rates (up to 1/2
// ms for a swing of a few steps) can make of it; and exactly what the same templates do for one lane.
TEST(ControlLanes, PlannerAgreesWithTheScalarOne) {
  std::mt19937 generator(11);
  const auto u = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator); };
  int swings = 0, reaches = 0, supports = 0;
  for (int gait = 0; gait < 20; ++gait) {
    const GaitParameters p = random_gait(generator);
    const scalar::Planner planner(p);
    FootPlan<Eight> feet[4] = {};
    GaitSenses<Eight> in{};
    std::array<std::vector<scalar::Foot>, 8> scalar_feet;
    std::array<scalar::Senses, 8> scalar_in;
    std::array<std::array<FootPlan<double>, 4>, 8> single{};
    std::array<GaitSenses<double>, 8> single_in{};
    for (int step = 0; step < 400; ++step) {
      unsigned fresh = 0;
      for (int lane = 0; lane < 8; ++lane) {
        const int begin = 17 * lane;
        scalar::Senses& s = scalar_in[lane];
        s.t = (step - begin) * 1e-3;
        s.dt = step == begin ? 0 : 1e-3;
        if (step == begin) fresh |= 1u << lane;
        if (step <= begin || u(0, 1) < 0.01) {
          s.command.v = {u(-0.3, 0.3), u(-0.1, 0.1), 0};
          s.command.w = {0, 0, u(0, 1) < 0.2 ? 0.0 : u(-0.6, 0.6)};
        }
        s.roll = u(-0.2, 0.2);
        s.pitch = u(-0.2, 0.2);
        for (int i = 0; i < 4; ++i) {
          const Vec3 near =
              scalar_feet[lane].empty() || step <= begin ? Vec3(Vec3::Map(p.origin[i])) : scalar_feet[lane][i].x;
          s.x[i] = near + Vec3(u(-0.01, 0.01), u(-0.01, 0.01), u(-0.01, 0.01));
          s.force[i] = (step / 30 + lane + i) % 4 == 0 ? 0 : 5;
        }
        GaitSenses<double>& one = single_in[lane];
        one = {s.t, s.dt, {to_lane(s.command.v), to_lane(s.command.w)}, {}, {}, s.roll, s.pitch};
        set_lane(in.t, lane, s.t);
        set_lane(in.dt, lane, s.dt);
        set_lane(in.command.v, lane, s.command.v);
        set_lane(in.command.w, lane, s.command.w);
        set_lane(in.roll, lane, s.roll);
        set_lane(in.pitch, lane, s.pitch);
        for (int i = 0; i < 4; ++i) {
          one.x[i] = to_lane(s.x[i]);
          one.force[i] = s.force[i];
          set_lane(in.x[i], lane, s.x[i]);
          set_lane(in.force[i], lane, s.force[i]);
        }
        if (step < begin) continue;
        if (step == begin) {
          scalar_feet[lane] = planner.start(s);
          start_feet(p, one, 1, single[lane].data());
        }
        planner.plan(s, scalar_feet[lane]);
        plan(p, one, 1u, single[lane].data());
      }
      const unsigned active = step >= 17 * 7 ? 255u : (1u << (step / 17 + 1)) - 1u;
      if (fresh) start_feet(p, in, fresh, feet);
      plan(p, in, active, feet);
      for (int lane = 0; lane < 8; ++lane) {
        if (!(active >> lane & 1)) continue;
        for (int i = 0; i < 4; ++i) {
          const scalar::Foot& want = scalar_feet[lane][i];
          const FootPlan<double>& one = single[lane][i];
          ASSERT_EQ(feet[i].swing >> lane & 1, want.mode == scalar::FootMode::swing) << gait << " " << step;
          ASSERT_EQ(feet[i].reach >> lane & 1, want.mode == scalar::FootMode::reach) << gait << " " << step;
          ASSERT_EQ(feet[i].support >> lane & 1, want.mode == scalar::FootMode::support) << gait << " " << step;
          swings += want.mode == scalar::FootMode::swing;
          reaches += want.mode == scalar::FootMode::reach;
          supports += want.mode == scalar::FootMode::support;
          ASSERT_LT((lane_of(feet[i].x, lane) - want.x).norm(), 1e-12) << gait << " " << step;
          ASSERT_LT((lane_of(feet[i].xd, lane) - want.xd).norm(), 1e-12 * (1 + want.xd.norm())) << gait << " " << step;
          ASSERT_EQ(lane_of(feet[i].x, lane), Vec3(one.x.x, one.x.y, one.x.z)) << gait << " " << step;
          ASSERT_EQ(lane_of(feet[i].xd, lane), Vec3(one.xd.x, one.xd.y, one.xd.z)) << gait << " " << step;
        }
      }
    }
  }
  EXPECT_GT(swings, 1000);  // the random gaits did all there is to do
  EXPECT_GT(reaches, 500);
  EXPECT_GT(supports, 100);
}

/// A limb of six joints on a fixed base, turning and sliding about any axis, with lopsided bodies.
Model random_limb(std::mt19937& generator) {
  const auto u = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator); };
  const auto vec = [&](double size) { return Vec3(u(-size, size), u(-size, size), u(-size, size)); };
  Model model;
  for (int i = 0; i < 6; ++i) {
    Body body;
    body.joint = "joint" + std::to_string(i);
    body.parent = i - 1;
    body.type = i == 1 || i == 4 ? JointType::prismatic : JointType::revolute;
    body.q = body.v = i;
    body.X_PB = Pose::Identity();
    body.X_PB.linear() = rotation_from_rpy(vec(3));
    body.X_PB.translation() = vec(0.3);
    body.axis = vec(1).normalized();
    body.lower = -3;
    body.upper = 3;
    body.mass = u(0.1, 2);
    body.com = vec(0.1);
    const Mat3 R = rotation_from_rpy(vec(3));
    body.inertia = R * Vec3(0.01, 0.02, 0.025).asDiagonal() * R.transpose();
    model.bodies.push_back(body);
    model.actuated.push_back(i);
  }
  model.nq = model.nv = 6;
  Frame tip;
  tip.name = "tip";
  tip.body = 5;
  tip.X_BF = Pose::Identity();
  tip.X_BF.translation() = vec(0.2);
  model.frames.push_back(tip);
  return model;
}

// Tip, Jacobian and inertia of random limbs with sliding joints are those of the whole model's kinematics, summed over
// the bodies.
TEST(ControlLanes, ChainsWithSlidingJoints) {
  std::mt19937 generator(12);
  std::uniform_real_distribution<double> angle(-3, 3);
  for (int n = 0; n < 20; ++n) {
    const Model model = random_limb(generator);
    const Chain chain(model, 0);
    const ChainView view = chain.view();
    ASSERT_EQ(view.n, 6);
    Eigen::VectorXd q(6);
    for (int i = 0; i < 6; ++i) q[i] = angle(generator);
    const std::vector<Pose> X_WB = reference_poses(model, q);
    const Vec3 tip = (X_WB[5] * model.frames[0].X_BF).translation();
    EXPECT_LT((chain.position(q) - tip).norm(), 1e-13);
    ChainPose<double, 0> pose;
    ChainInertia<double> body[kMaxChainJoints];
    walk_chain(view, q.data(), pose, [&](int i, const RotT<double>& R, const Vec3T<double>& p) {
      body[i] = body_inertia(view.joint[i], R, p);
    });
    double M[kMaxChainJoints * kMaxChainJoints];
    chain_inertia(view, pose, body, M);
    const Eigen::Matrix3Xd J = reference_jacobian(model, X_WB, 5, tip);
    Eigen::MatrixXd want = Eigen::MatrixXd::Zero(6, 6);
    Eigen::Matrix3Xd Jw = Eigen::Matrix3Xd::Zero(3, 6);
    for (int b = 0; b < 6; ++b) {
      const Mat3 R = X_WB[b].linear();
      if (model.bodies[b].type == JointType::revolute) Jw.col(b) = R * model.bodies[b].axis;
      const Eigen::Matrix3Xd Jc = reference_jacobian(model, X_WB, b, X_WB[b] * model.bodies[b].com);
      want += model.bodies[b].mass * Jc.transpose() * Jc +
              Jw.transpose() * (R * model.bodies[b].inertia * R.transpose()) * Jw;
    }
    for (int i = 0; i < 6; ++i) {
      const Vec3T<double> column = tip_column(view, pose, i);
      EXPECT_LT((Vec3(column.x, column.y, column.z) - J.col(i)).norm(), 1e-13);
      for (int j = 0; j <= i; ++j) EXPECT_NEAR(M[i * kMaxChainJoints + j], want(i, j), 1e-12 * want.norm());
    }
  }
}

// Damped least squares of eight limbs at once: each lane's steps and end are those of the same lane alone, although
// some of them arrive early, some late, and some never.
TEST(ControlLanes, IterationsFreezePerLane) {
  std::mt19937 generator(13);
  std::uniform_real_distribution<double> angle(-2, 2);
  int arrived = 0, strayed = 0;
  for (int n = 0; n < 20; ++n) {
    const Model model = random_limb(generator);
    const Chain chain(model, 0);
    const ChainView view = chain.view();
    Eight q[kMaxChainJoints];
    double alone[8][kMaxChainJoints];
    Vec3T<Eight> x{};
    for (int lane = 0; lane < 8; ++lane) {
      Chain::Values goal(6);
      for (int i = 0; i < 6; ++i) {
        alone[lane][i] = angle(generator);
        goal[i] = lane == 0 ? alone[lane][i] : angle(generator);
        set_lane(q[i], lane, alone[lane][i]);
      }
      const Vec3 target = lane == 7 ? Vec3(20, 0, 0) : chain.position(goal);
      set_lane(x, lane, target);
      const double left = solve_damped(view, to_lane(target), alone[lane]);
      arrived += left < 1e-9;
      strayed += left > 1e-3;
    }
    solve_damped(view, x, q);
    for (int lane = 0; lane < 8; ++lane) {
      for (int i = 0; i < 6; ++i) EXPECT_EQ(lane_of(q[i], lane), alone[lane][i]) << n << " " << lane;
    }
  }
  EXPECT_GT(arrived, 60);
  EXPECT_GE(strayed, 20);
}

const char* const kTiming = "duration: 0.3, duty: 75 %, liftoff: '[25, 75, 0, 50] %', step_height: 4 cm";
const char* const kStance = "stance: {length: 120 %, width: 200 %, height: 90 %}";
std::string with_gait(const std::string& more, const std::string& control) {
  return std::string("{gait: {") + kTiming + ", " + kStance + ", " + more + "}, control: {" + control + "}}";
}

/// What particle `id` senses at a step: joints near the initial ones, feet that carry now and then.
void sense(const Scene& scene, int id, int step, int lane, Observation& out) {
  out.time[lane] = step * 1e-3;
  for (int k = 0; k < scene.model.na(); ++k) {
    const double q0 = scene.initial.q[scene.model.bodies[scene.model.actuated[k]].q];
    out.joint_position(k, lane) = q0 + 0.1 * std::sin(0.02 * step + id + 2 * k);
    out.joint_velocity(k, lane) = 2 * std::cos(0.02 * step + id + 2 * k);
  }
  for (int i = 0; i < 3; ++i) {
    out.base_rpy(i, lane) = 0.2 * std::sin(0.01 * step + id + i);
    out.base_position(i, lane) = 0.001 * step + 0.1 * i;
    out.base_rate(i, lane) = 0.3 * std::cos(0.01 * step + id + i);
  }
  for (int f = 0; f < out.link_force.rows(); ++f) out.link_force(f, lane) = (step / 30 + id + f) % 4 == 0 ? 0 : 2.0;
}

Observation empty_observation(const Model& model) {
  Observation out;
  out.joint_position = out.joint_velocity = BlockArray(model.na());
  out.base_position = out.base_rpy = out.base_rate = BlockArray(3);
  out.link_force = BlockArray(static_cast<int>(model.frames.size()));
  return out;
}

struct ChosenIsa {
  explicit ChosenIsa(Isa isa) { setenv("GRAZE_ISA", isa_name(isa).c_str(), 1); }
  ~ChosenIsa() { unsetenv("GRAZE_ISA"); }
};

Controller controller_of(const Scene& scene, const std::string& policy, Isa isa) {
  const ChosenIsa chosen(isa);
  return Controller(scene.context(), Settings::parse(policy, "policy.yaml"));
}

constexpr int kSteps = 700;
double lag_of(int id) { return id % 3 == 0 ? 0.0 : 0.002 * id; }
double jitter_of(int id, int step) { return 0.0005 * ((step * 7 + id) % 5 - 2); }

/// All that the actuators are asked in a trace of particle `id`, alone or with others that begin and end at other
/// times.
std::vector<double> trace(const Scene& scene, const std::string& policy, Isa isa, int id, int lane, bool company) {
  Controller controller = controller_of(scene, policy, isa);
  Observation observation = empty_observation(scene.model);
  ActuatorCommand command(scene.model.na());
  std::vector<double> out;
  const int late = company ? 137 : 0;
  if (company) {
    for (int other = 0; other < kLanes; ++other) controller.start(other, lag_of(20 + other), 0);
  }
  for (int step = 0; step < late + kSteps; ++step) {
    if (step == late) controller.start(lane, lag_of(id), 0);
    if (company && step == 400) controller.start((lane + 3) % kLanes, 0.2, 0);  // history grows for all
    LaneMask active;
    double jitter[kLanes] = {};
    for (int l = 0; l < kLanes; ++l) {
      const bool own = l == lane && step >= late;
      // Others act at every step, at every second, or not at all for a while.
      if (!own && (!company || (l % 2 == 1 && step % 2 == 1) || (l == (lane + 1) % kLanes && step > 300))) continue;
      active.set(l);
      sense(scene, own ? id : 40 + l, own ? step - late : step, l, observation);
      jitter[l] = own ? jitter_of(id, step - late) : jitter_of(40 + l, step);
    }
    controller.act(observation, jitter, active, command);
    if (step < late) continue;
    for (const BlockArray* rows : {&command.tau, &command.q, &command.v}) {
      for (int k = 0; k < rows->rows(); ++k) out.push_back((*rows)(k, lane));
    }
  }
  return out;
}

std::vector<double> all_numbers(const ActuatorCommand& command) {
  std::vector<double> out;
  for (const BlockArray* rows : {&command.tau, &command.q, &command.v, &command.prescribed}) {
    for (int k = 0; k < rows->rows(); ++k) out.insert(out.end(), rows->row(k), rows->row(k) + kLanes);
  }
  return out;
}

/// LINKS with one leg that has no closed form of inverse kinematics.
World skewed_links() {
  World world = links_world();
  for (Joint& joint : world.robot.joints) {
    if (joint.name == "LF_X_1") joint.axis = Vec3(1, 0.2, 0.1).normalized();
  }
  return world;
}

// What a lane is asked to do is the same bits with every instruction set, in every lane, alone or beside neighbours
// that begin, act and end at other times with other lags.
TEST(ControlLanes, BitsDependOnTheTraceAlone) {
  const Scene links(links_world()), skewed(skewed_links());
  const std::string velocity = "velocity: [0.2, 0.05, -0.5]";
  const std::string waypoints =
      "waypoints: {points: [[0.3, 0.1], [1, 0]], speed: {forward: 0.2, strafe: 0.1, turn: 0.5}, steering: holonomic}";
  const std::string operational = "operational_pd: {kp: 1000, kd: 20}", joint = "joint_pd: {kp: 20, kd: 0.1}";
  const std::pair<const Scene*, std::string> cases[] = {
      {&links, with_gait(velocity, operational)},
      {&links, with_gait(waypoints + ", settle: 0.1, orientation: [0.05, 0.1, 0]", operational)},
      {&links, with_gait(velocity + ", recovery: false", joint)},
      {&skewed, with_gait(velocity + ", global_up: false", joint)}};
  for (const auto& [scene, policy] : cases) {
    const std::vector<double> want = trace(*scene, policy, Isa::portable, 5, 0, false);
    EXPECT_NE(want, trace(*scene, policy, Isa::portable, 6, 0, false));
    for (const double value : want) ASSERT_TRUE(std::isfinite(value));
    for (const Isa isa : available_isas()) {
      EXPECT_EQ(want, trace(*scene, policy, isa, 5, 3, false)) << isa_name(isa) << " " << policy;
      EXPECT_EQ(want, trace(*scene, policy, isa, 5, 6, true)) << isa_name(isa) << " " << policy;
    }
  }
}

/// LINKS with longer shins, its hips farther out and another mass.
World changed_links(const World& world, int by) {
  const std::vector<std::string> paths = {"robot.link.LF_LEG_3.length", "robot.link.RH_LEG_2.length",
                                          "robot.joint.RF_X_1.origin.y", "robot.link.BODY0.mass"};
  const ParameterTable table(world);
  std::vector<double> values;
  for (const std::string& path : paths) values.push_back(table.find(path)->nominal * (1 + 0.01 * by));
  return Fabricator(std::make_shared<const World>(world), paths).perturbed(values);
}

// A controller that knows another robot in each lane asks of each what a controller of that robot alone asks, bit for
// bit, with every instruction set, lags included; a lane that knows the nominal robot again is asked what that one is.
TEST(ControlLanes, EachLaneKnowsItsRobot) {
  const std::string operational = "operational_pd: {kp: 1000, kd: 20}", joint = "joint_pd: {kp: 20, kd: 0.1}";
  const std::tuple<World, std::string> cases[] = {
      {links_world(), with_gait("velocity: [0.2, 0.05, -0.5], settle: 0.05", joint)},
      {links_world(), with_gait("velocity: [0.2, 0.05, -0.5], stabilizer: {kp: 10, kd: 1}", "prescribed: {}")},
      {skewed_links(), with_gait("velocity: [0.2, 0, 0]", joint)},
      {links_world(), with_gait("velocity: [0.2, 0, 0.3]", operational)},
      {skewed_links(), with_gait("velocity: [0.2, 0, 0.3]", "operational_pd: {kp: 1000, kd: 20, implicit: false}")}};
  for (const auto& one : cases) {
    const World& world = std::get<0>(one);
    const std::string& policy = std::get<1>(one);  // a lambda captures it
    const Scene nominal(world);
    std::deque<Scene> robots;
    for (int lane = 0; lane < kLanes; ++lane) robots.emplace_back(changed_links(world, lane));
    for (const Isa isa : available_isas()) {
      Controller together = controller_of(nominal, policy, isa);
      std::vector<std::unique_ptr<Controller>> alone;
      const auto start = [&](int lane, const Scene& robot) {
        const ChosenIsa chosen(isa);
        Controller& own =
            *alone.emplace_back(std::make_unique<Controller>(robot.context(), Settings::parse(policy, "policy.yaml")));
        ASSERT_TRUE(together.know(lane, own)) << policy;
        own.start(lane, lag_of(lane), 0);
        together.start(lane, lag_of(lane), 0);
      };
      for (int lane = 0; lane < kLanes; ++lane) start(lane, robots[static_cast<std::size_t>(lane)]);
      Observation observation = empty_observation(nominal.model);
      ActuatorCommand asked(nominal.model.na()), asked_alone(nominal.model.na());
      for (int step = 0; step < 250; ++step) {
        if (step == 200) alone.pop_back(), start(kLanes - 1, nominal);
        for (int lane = 0; lane < kLanes; ++lane) sense(nominal, lane, step, lane, observation);
        together.act(observation, nullptr, LaneMask::all(), asked);
        for (int lane = 0; lane < kLanes; ++lane) {
          LaneMask only;
          only.set(lane);
          alone[static_cast<std::size_t>(lane)]->act(observation, nullptr, only, asked_alone);
        }
        ASSERT_EQ(all_numbers(asked), all_numbers(asked_alone)) << isa_name(isa) << " " << policy << " " << step;
      }
    }
  }
}

// Who computes with more of the nominal robot than its lanes can have apart says so, and so do robots whose legs are
// solved in other ways and policies of another kind.
TEST(ControlLanes, RobotsThatCannotShareAreTold) {
  const Scene links(links_world()), skewed(skewed_links());
  const std::string gait = with_gait("velocity: [0.2, 0, 0]", "joint_pd: {kp: 20}");
  const auto knows = [&](const std::string& policy, const Scene& other, const std::string& its) {
    Controller controller = controller_of(links, policy, chosen_isa());
    return controller.know(3, controller_of(other, its, chosen_isa()));
  };
  EXPECT_TRUE(knows(gait, links, gait));
  EXPECT_FALSE(knows(gait, skewed, gait));
  EXPECT_FALSE(knows(gait, links, "{hold: {}, control: {joint_pd: {kp: 20}}}"));
  EXPECT_FALSE(knows(gait, links, with_gait("velocity: [0.2, 0, 0]", "torque: {}")));
  const std::string planner = with_gait("velocity: [0.2, 0, 0]", "inverse_dynamics: {kp: 1e4, kd: 200}");
  EXPECT_FALSE(knows(planner, links, planner));
}

// operational_pd in all lanes is the published law with the damper (1/kd + h J M^-1 J^T)^-1, computed from the whole
// robot's kinematics with inverses, to 1e-12 of the largest torque.
TEST(ControlLanes, OperationalPdIsItsFormula) {
  const Scene scene(links_world());
  Controller controller =
      controller_of(scene, with_gait("velocity: [0.2, 0, -0.5]", "operational_pd: {kp: 1000, kd: 20}"), chosen_isa());
  Observation observation = empty_observation(scene.model);
  ActuatorCommand command(scene.model.na());
  for (int lane = 0; lane < kLanes; ++lane) controller.start(lane, 0, 0);
  std::vector<Chain> legs;
  for (const char* foot : {"LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT"}) {
    legs.emplace_back(scene.model, scene.model.frame(foot));
  }
  for (int step = 0; step < 100; ++step) {
    for (int lane = 0; lane < kLanes; ++lane) sense(scene, lane, 7 * step, lane, observation);
    controller.act(observation, nullptr, LaneMask::all(), command);
    for (int lane = 0; lane < kLanes; ++lane) {
      for (int i = 0; i < 4; ++i) {
        Chain::Values q(3);
        Eigen::Vector3d v;
        for (int j = 0; j < 3; ++j) {
          q[j] = observation.joint_position(3 * i + j, lane);
          v[j] = observation.joint_velocity(3 * i + j, lane);
        }
        const Eigen::Matrix3d J = leg_jacobian(scene.model, legs[i], q), M = leg_inertia(scene.model, legs[i], q);
        const Eigen::Matrix3d D = (Eigen::Matrix3d::Identity() / 20 + 1e-3 * J * M.inverse() * J.transpose()).inverse();
        const Vec3 x_des = controller.targets().x.vec3(3 * i, lane), xd_des = controller.targets().xd.vec3(3 * i, lane);
        const Eigen::Vector3d want = J.transpose() * (1000 * (x_des - legs[i].position(q)) + D * (xd_des - J * v));
        // The reference's own inverses lose the condition of M, below 1e3.
        EXPECT_LT((command.tau.column(lane, 3 * i, 3) - want).norm(), 1e-12 * (1 + want.norm()));
      }
    }
  }
}

}  // namespace
}  // namespace graze
