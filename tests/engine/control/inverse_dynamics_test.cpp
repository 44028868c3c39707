// Tracker `inverse_dynamics`: what it predicts is what the engine does, its program is solved, and its bits are a
// lane's own.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "engine/contact/lcp.h"
#include "engine/control/contact_program.h"
#include "engine/dynamics/dynamics_model.h"
#include "engine/lanes/isa.h"
#include "engine/model/rotation.h"
#include "engine/settings/warnings.h"
#include "tests/engine/control/inverse_dynamics_support.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

/// How far the joints' velocities of a step are from what was asked, of all joints the most, rad/s.
double worst_miss(const Scene& scene, const LaneLoop& loop, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                  double h) {
  double worst = 0;
  for (int k = 0; k < scene.model.na(); ++k) {
    const Body& body = scene.model.bodies[scene.model.actuated[k]];
    const double got = (loop.state().q(body.q, 0) - q[body.q]) / h;  // joints move at the velocity of the solve
    const double asked = v[body.v] + h * (kKp * (loop.controller().targets().q(k, 0) - q[body.q]) +
                                          kKd * (loop.controller().targets().v(k, 0) - v[body.v]));
    worst = std::max(worst, std::abs(got - asked));
  }
  return worst;
}

// With perfect knowledge and motors without limits, joints get the velocities that were asked for to 1e-6 rad/s: the
// torques contain the contact forces that the engine then finds, because four feet's 12 forces are determined by the
// torques of 12 joints. Standing after the first touch, on friction 1 and 0.1.
TEST(InverseDynamics, StandsWithPredictedForces) {
  for (const double friction : {1.0, 0.1}) {
    const Scene scene(strong_links(friction));
    LaneLoop loop(scene, hold(tracker()));
    loop.start(0, scene.particle());
    double worst = 0, impacts = 0;
    for (int step = 0; step < 500; ++step) {
      const Eigen::VectorXd q = loop.state().q.column(0), v = loop.state().v.column(0);
      loop.advance();
      ASSERT_FALSE(loop.physics().fault(0)) << *loop.physics().fault(0);
      const double miss = worst_miss(scene, loop, q, v, 1e-3);
      impacts = std::max(impacts, miss);
      if (step >= 100) worst = std::max(worst, miss);
    }
    EXPECT_LT(worst, 1e-6) << friction;
    EXPECT_LT(impacts, 1e-5) << friction;
    double pressed = 0;
    for (const Contact& contact : loop.physics().contacts(0)) pressed += contact.normal_impulse() / 1e-3;
    double mass = 0;
    for (const Body& body : scene.model.bodies) mass += body.mass;
    EXPECT_NEAR(pressed, 9.81 * mass, 0.01 * 9.81 * mass);
  }
}

/// A random program on LINKS: its mass matrix in a random posture, contacts anywhere on it in any direction, some of
/// them twice, and random velocities, gaps and friction.
struct RandomProgram {
  explicit RandomProgram(const DynamicsModel& robot, std::mt19937& generator, double friction, bool slips = true)
      : data(robot), nv(robot.nv()) {
    const auto u = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(generator);
    };
    const auto rows = [&](std::vector<double>& all, double size) {
      for (int k = 0; k < nv; ++k) all.push_back(u(-size, size));
    };
    Eigen::VectorXd q(robot.nq());
    const Quat turn(rotation_from_rpy({u(-3, 3), u(-3, 3), u(-3, 3)}));
    q.head(4) << turn.w(), turn.x(), turn.y(), turn.z();
    for (int k = 4; k < q.size(); ++k) q[k] = u(-1, 1);
    update_poses(data.tree(), q.data());
    update_mass(data.tree());
    rows(free, 1), rows(weight, 0), rows(z, 0), rows(step, 0), rows(trial, 0), rows(gradient, 0);
    const TopologyView& t = data.tree().topology;
    H.resize(t.row[nv]);
    const int count = static_cast<int>(u(1, 9));
    contacts.resize(count), jacobian.resize(count * nv), lanes.assign(count, 1u);
    for (int i = 0; i < count; ++i) add(i, generator, friction);
    for (int k = 6; k < nv; ++k) weight[k] = 1 / (kEps * 100);
    program = {data.tree(),
               data.tree().M,
               count,
               contacts.data(),
               jacobian.data(),
               nv,
               dofs.data(),
               lanes.data(),
               free.data(),
               weight.data(),
               z.data(),
               step.data(),
               trial.data(),
               gradient.data(),
               slips,
               1,
               &base,
               6,
               nv};
    program.tree.M = H.data();
    z = free;
  }

  void add(int i, std::mt19937& generator, double friction) {
    const auto u = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(generator);
    };
    const TreeT<double>& tree = data.tree();
    ProgramContactT<double>& c = contacts[i];
    const bool again = i > 0 && u(0, 1) < 0.3;
    if (again) {
      c = contacts[i - 1];
      dofs.push_back(dofs.back());
      std::copy_n(&jacobian[nv * (i - 1)], nv, &jacobian[nv * i]);
      return;
    }
    const int body = static_cast<int>(u(0, tree.topology.bodies));
    const Vec3 n = Vec3(u(-1, 1), u(-1, 1), u(0, 1)).normalized();
    const Vec3 p = to_eigen(tree.pose[body]) * Vec3(u(-0.05, 0.05), u(-0.05, 0.05), u(-0.05, 0.05));
    c.n = to_kernel(n), c.p = to_kernel(p);
    make_tangents(c);
    c.friction = friction >= 0 ? friction : u(0, 2);
    c.gap = u(-0.1, 0.2);
    c.a = 1 / 1.4 + norm2(c.p - tree.origin[0]) / 0.005;
    c.cone.kept = {0, 0, 0};
    dofs.push_back(tree.topology.v[body] + (body == 0 ? 5 : 0));
    std::vector<Vec3T<double>> y(nv);
    contact_jacobian(tree, body, -1, c, y.data());
    const int* chain = tree.topology.chain + tree.topology.row[dofs[i]];
    for (int d = 0; d <= tree.topology.dof_depth[dofs[i]]; ++d) jacobian[nv * i + d] = y[chain[d]];
  }

  Vec3 velocity(int i) const {
    Vec3 u(contacts[i].gap, 0, 0);
    for (int d = 0; d < program.dofs_above(i); ++d) {
      u += z[program.path(i)[d]] * to_eigen(jacobian[nv * i + d]);
    }
    return u;
  }

  /// The largest of mass (z - free) - J^T lambda, with M as a full matrix.
  double imbalance() const {
    Eigen::MatrixXd M(nv, nv);
    dense_mass(data.tree(), M.data());
    Eigen::VectorXd off(nv);
    for (int k = 0; k < nv; ++k) off[k] = z[k] - free[k];
    Eigen::VectorXd left(nv);
    left.head(6) = M.topLeftCorner(6, 6) * off.head(6);
    for (int k = 6; k < nv; ++k) left[k] = weight[k] * off[k];
    for (int i = 0; i < program.count; ++i) {
      for (int d = 0; d < program.dofs_above(i); ++d) {
        left[program.path(i)[d]] -= to_eigen(jacobian[nv * i + d]).dot(to_eigen(contacts[i].cone.kept));
      }
    }
    return left.cwiseAbs().maxCoeff();
  }

  static constexpr double kEps = 1e-6;
  static constexpr FreeBodyView base{0, 0, 0, 0, -1};
  DynamicsData<double> data;
  int nv;
  std::vector<double> free, weight, z, step, trial, gradient, H;
  std::vector<ProgramContactT<double>> contacts;
  std::vector<Vec3T<double>> jacobian;
  std::vector<int> dofs;
  std::vector<unsigned> lanes;
  ContactProgramT<double> program{};
};

/// Distance of u from the dual cone of Coulomb's, and of lambda from the cone, in their units.
double outside_dual(const Vec3& u, double mu) { return std::max(0.0, mu * u.tail(2).norm() - u[0]); }
double outside_cone(const Vec3& x, double mu) { return std::max(0.0, x.tail(2).norm() - mu * x[0]); }

/// How far a solution is from the conditions of optimality, impulses and powers as shares of the largest impulse.
struct Violation {
  double velocity = 0, cone = 0, power = 0, balance = 0, impulse = 0;

  explicit Violation(const RandomProgram& problem) {
    for (int i = 0; i < problem.program.count; ++i) {
      const Vec3 u = problem.velocity(i), lambda = to_eigen(problem.contacts[i].cone.kept);
      const double mu = problem.contacts[i].friction;
      impulse = std::max(impulse, lambda.norm());
      velocity = std::max(velocity, outside_dual(u, mu));
      cone = std::max(cone, outside_cone(lambda, mu));
      power = std::max(power, std::abs(u.dot(lambda)));
    }
    const double scale = 1 / std::max(impulse, 1e-6);
    cone *= scale, power *= scale;
    balance = problem.imbalance() * scale;
  }
};

// 10,000 random programs, a third of whose contacts are doubled. Where the contacts do not contradict the joints, which
// shows in impulses beyond 100 N s (LINKS weighs 14 N), the solution satisfies the conditions of optimality (velocities
// in the dual cones, impulses in the cones, no power, and the impulses make the velocities), which a convex program has
// at its solution alone. Fewer than one in a thousand end at the bound of steps.
TEST(InverseDynamics, ProgramIsSolved) {
  const Scene scene(links_world());
  const DynamicsModel robot(scene.model);
  std::mt19937 generator(5);
  constexpr int kPrograms = GRAZE_SANITIZED ? 2000 : 10000;
  int contradictions = 0, unfinished = 0;
  for (int n = 0; n < kPrograms; ++n) {
    RandomProgram problem(robot, generator, -1);
    problem.program.solve(true, kFirstR, RandomProgram::kEps, 1e-13, true);
    const Violation left(problem);
    ASSERT_TRUE(std::isfinite(left.balance));
    contradictions += left.impulse > 100;
    if (left.impulse > 100) continue;
    unfinished += left.velocity > 1e-8 || left.power > 1e-9;
    EXPECT_LT(left.cone, 1e-12);
    EXPECT_LT(left.balance, 1e-6);
  }
  EXPECT_LT(unfinished, kPrograms / 1000);
  EXPECT_LT(contradictions, kPrograms * 15 / 100);
}

// Without friction the wrench on the base is that of an LCP in the normals (Eqs. 58, 76), which principal pivoting
// solves; doubled contacts make its matrix singular, and their impulses, but not the wrench, a matter of choice. Where
// the contacts contradict the joints there is none to compare with.
TEST(InverseDynamics, ProgramAgreesWithPrincipalPivoting) {
  const Scene scene(links_world());
  const DynamicsModel robot(scene.model);
  std::mt19937 generator(6);
  constexpr int kPrograms = GRAZE_SANITIZED ? 600 : 3000;
  int compared = 0, others = 0;
  for (int n = 0; n < kPrograms; ++n) {
    RandomProgram problem(robot, generator, 0);
    const int count = problem.program.count, nv = problem.nv;
    Eigen::MatrixXd M(nv, nv), J(count, 6);
    dense_mass(problem.data.tree(), M.data());
    const Eigen::MatrixXd A = M.topLeftCorner(6, 6);
    Eigen::VectorXd b(count);
    for (int i = 0; i < count; ++i) {
      for (int d = 0; d < 6; ++d) J(i, d) = problem.jacobian[nv * i + d].x;
      b[i] = problem.velocity(i).x();
    }
    const LcpSolution want = solve_ppm(J * A.inverse() * J.transpose(), b);
    if (!want.solved || want.w.minCoeff() < -1e-9 || want.z.maxCoeff() > 10) continue;
    ++compared;
    problem.program.solve(true, kFirstR, RandomProgram::kEps, 1e-13, true);
    Eigen::VectorXd got(count);
    for (int i = 0; i < count; ++i) got[i] = problem.contacts[i].cone.kept.x;
    others += (J.transpose() * (got - want.z)).norm() > 1e-4 * (1 + want.z.norm());
  }
  EXPECT_GT(compared, kPrograms * 2 / 3);
  EXPECT_LE(others, 2);  // ended at the bound of steps
}

// A trot by the same tracker: in nine of ten steps all joints do what was asked to 1e-5 rad/s. In the others feet touch
// down or slide, or what was asked contradicts the ground.
TEST(InverseDynamics, TrotsWithPredictedForces) {
  const Scene scene(strong_links());
  LaneLoop loop(scene, trot(tracker()));
  loop.start(0, scene.particle());
  int kept = 0;
  constexpr int kSteps = 1500;
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::VectorXd q = loop.state().q.column(0), v = loop.state().v.column(0);
    loop.advance();
    ASSERT_FALSE(loop.physics().fault(0)) << *loop.physics().fault(0);
    kept += worst_miss(scene, loop, q, v, 1e-3) < 1e-5;
  }
  RecordProperty("kept", kept);
  EXPECT_GT(kept, 0.9 * kSteps);
  EXPECT_GT(loop.state().q(4, 0), 0.1);
}

// Robots with a fifth more or less mass, other friction and another foot than the tracker believes, standing and
// trotting: commands stay numbers, torques within their limits, and a trace that ends says why.
TEST(InverseDynamics, ForgivesAnotherRobot) {
  const Scene nominal(links_world());
  for (const char* more : {"", ", contacts: {from: flags}", ", model: none"}) {
    for (const bool trots : {false, true}) {
      const std::string control =
          "inverse_dynamics: {kp: 1e3, kd: 10, servo: {kp: 10, kd: 0.1}, horizon: 1 ms" + std::string(more) + "}";
      LaneLoop loop(nominal, trots ? trot(control) : hold(control));
      const std::pair<double, double> robots[] = {{1.2, 0.6}, {0.8, 1.2}, {1.0, 0.1}};
      for (int lane = 0; lane < 3; ++lane) {
        loop.start(lane, other_robot(robots[lane].first, robots[lane].second, lane));
      }
      for (int step = 0; step < 1000; ++step) {
        loop.advance();
        for (int lane = 0; lane < 3; ++lane) {
          if (loop.physics().fault(lane)) {
            EXPECT_FALSE(loop.physics().fault(lane)->empty());
            loop.stop(lane);
            continue;
          }
          for (int k = 0; k < nominal.model.na(); ++k) {
            ASSERT_TRUE(std::isfinite(loop.command().tau(k, lane)));
            ASSERT_LE(std::abs(loop.tau()(k, lane)), nominal.model.bodies[nominal.model.actuated[k]].effort);
          }
        }
      }
    }
  }
}

/// All states and torques of a trace of particle 1 in `lane`, alone or beside others that begin at other times.
std::vector<double> trace_of(const std::string& policy, Isa isa, int lane, bool company) {
  const Scene nominal(links_world());
  setenv("GRAZE_ISA", isa_name(isa).c_str(), 1);
  LaneLoop loop(nominal, policy);
  unsetenv("GRAZE_ISA");
  std::vector<double> out;
  const int late = company ? 23 : 0;
  for (int step = 0; step < late + (GRAZE_SANITIZED ? 40 : 150); ++step) {
    if (step == late) loop.start(lane, other_robot(1.1, 0.5, 1));
    if (company && step == 0) loop.start((lane + 1) % kLanes, other_robot(0.8, 1.5, 2));
    if (company && step == 40) loop.start((lane + 5) % kLanes, other_robot(1.3, 0.05, 3));
    loop.advance();
    if (step < late) continue;
    for (int k = 0; k < nominal.model.nv; ++k) out.push_back(loop.state().v(k, lane));
    for (int k = 0; k < nominal.model.na(); ++k) out.push_back(loop.tau()(k, lane));
  }
  return out;
}

// The same bits with every instruction set, in every lane, alone and beside robots that differ, fall and begin at other
// times.
TEST(InverseDynamics, BitsDependOnTheTraceAlone) {
  std::vector<std::string> trackers;
  for (const char* more : {"", ", contacts: {from: flags}", ", contacts: {from: force, delay: 3 ms}",
                           ", model: sensed, contacts: {delay: 1 ms}", ", model: qp_no_slip", ", model: lcp_coulomb",
                           ", model: lcp_no_slip, ki: 10", ", horizon: 10 ms"}) {
    trackers.push_back(tracker(more));
  }
  trackers.push_back("operational_inverse_dynamics: {kp: 2e3, kd: 50}");
  trackers.push_back("operational_inverse_dynamics: {kp: 1e7, kd: 5e3, map: transposed, servo: {kp: 1e3, kd: 20}}");
  for (const std::string& more : trackers) {
    const std::string policy = trot(more);
    const std::vector<double> want = trace_of(policy, Isa::portable, 0, false);
    for (const double value : want) ASSERT_TRUE(std::isfinite(value));
    for (const Isa isa : available_isas()) {
      EXPECT_EQ(want, trace_of(policy, isa, 3, false)) << isa_name(isa) << more;
      EXPECT_EQ(want, trace_of(policy, isa, 6, true)) << isa_name(isa) << more;
    }
  }
}

// Feet that the ground keeps from what joints do press against each other as the weight lets them.
TEST(InverseDynamics, OneStageUnlessToldOtherwise) {
  const auto under = [](const std::string& more) {
    return trace_of(trot("inverse_dynamics: {kp: 5e4, kd: 100, horizon: 1 ms" + more + "}"), Isa::portable, 0, false);
  };
  for (const std::string model : {", model: qp_no_slip", ", model: qp_coulomb"}) {
    const bool slips = model == ", model: qp_coulomb";
    EXPECT_EQ(under(model) == under(model + ", regularization: 1e-2"), !slips) << model;
    EXPECT_EQ(under(model) == under(model + ", regularization: 1e-3"), slips) << model;
  }
}

// What is not a number stays in its lane.
TEST(InverseDynamics, KeepsNaNInItsLane) {
  const Scene scene(links_world());
  LaneLoop loop(scene, hold(tracker())), alone(scene, hold(tracker()));
  Particle lost = scene.particle(1);
  lost.initial.v[3] = std::nan("");
  loop.start(0, scene.particle());
  loop.start(1, lost);
  alone.start(0, scene.particle());
  for (int step = 0; step < 50; ++step) loop.advance(), alone.advance();
  EXPECT_EQ(loop.state().q.column(0), alone.state().q.column(0));
  ASSERT_TRUE(loop.physics().fault(1));
  EXPECT_NE(loop.physics().fault(1)->find("finite"), std::string::npos) << *loop.physics().fault(1);
}

// A forgotten unit, a horizon that ends before the step does, joints that no gain names: told, and gone on with.
TEST(InverseDynamics, DoubtsWhatIsHardlyMeant) {
  const Scene scene(links_world());
  const auto warned = [&](const std::string& more) {
    const Warnings warnings;
    Controller(scene.context(), Settings::parse(hold("inverse_dynamics: {" + more + "}"), "policy.yaml"));
    return fmt::format("{}", fmt::join(warnings.texts(), "\n"));
  };
  EXPECT_EQ(warned("kp: 1"), "");
  EXPECT_NE(warned("kp: 1, horizon: 20").find("did you mean 20 ms?"), std::string::npos);
  EXPECT_NE(warned("kp: 1, horizon: 0.1 ms").find("shorter than a control step"), std::string::npos);
  EXPECT_NE(warned("kp: 1, contacts: {within: 10}").find("did you mean mm?"), std::string::npos);
  EXPECT_NE(warned("kp: 1, contacts: {from: force, force: 150 %}").find("more than the robot's weight"),
            std::string::npos);
  EXPECT_EQ(warned("kp: 1, contacts: {from: force, force: 99 %}"), "");
  EXPECT_NE(warned("kp: {'*_X_1': 5e3}").find("names 4 of 12 joints"), std::string::npos);
  EXPECT_EQ(warned("kp: 1e6, kd: 1400"), "");
  EXPECT_NE(warned("kp: 1e6, kd: 1600").find("joint LF_X_1: with a control step h of 0.001 s its errors grow"),
            std::string::npos);
  EXPECT_NE(warned("kp: 1e6, kd: 1600").find("less than 4/h^2 - 2 kd/h = 800000 1/s^2"), std::string::npos);
  EXPECT_NE(warned("kp: 0, kd: 2100").find("less than 2/h = 2000 1/s"), std::string::npos);

  World world = links_world();
  for (Joint& joint : world.robot.joints) joint.effort = std::numeric_limits<double>::infinity();
  const Scene strong(world);
  const Warnings warnings;
  Controller(strong.context(), Settings::parse(hold("inverse_dynamics: {kp: 1}"), "policy.yaml"));
  ASSERT_EQ(warnings.texts().size(), 1u);
  EXPECT_NE(warnings.texts()[0].find("12 of 12 joints have no limit of torque"), std::string::npos);
}

TEST(InverseDynamics, RefusesWhatItCannotDo) {
  const Scene scene(links_world());
  const auto error = [&](const Scene& robot, const std::string& policy) {
    return input_error([&] { Controller(robot.context(), Settings::parse(policy, "policy.yaml")); });
  };
  EXPECT_EQ(error(scene, hold("inverse_dynamics: {kp: 1, model: qp_coulom}")).rfind("policy.yaml:1:", 0), 0u);
  EXPECT_NE(error(scene, hold("inverse_dynamics: {kp: 1, model: qp_coulom}")).find("qp_coulomb"), std::string::npos);
  EXPECT_NE(error(scene, hold("inverse_dynamics: {kp: -1}")).find("-1"), std::string::npos);
  EXPECT_NE(error(scene, hold("operational_inverse_dynamics: {kp: 1}"))
                .find("hold gives joint targets, and the tracker under control follows feet"),
            std::string::npos);
  EXPECT_NE(error(scene, hold("inverse_dynamics: {kp: 1, contacts: {force: 2 N}}")).find("from: force"),
            std::string::npos);
  EXPECT_NE(error(scene, hold("inverse_dynamics: {kp: 1, contacts: {delay: 2 ms}}")).find("from: flags"),
            std::string::npos);
  EXPECT_NE(error(scene, hold("inverse_dynamics: {kp: 1, model: sensed, contacts: {within: 1 cm}}")).find("sensed"),
            std::string::npos);
  EXPECT_NE(error(scene, hold("inverse_dynamics: {kp: 1, contacts: {from: flags, delay: 2 s}}")).find("2 s is more"),
            std::string::npos);
  EXPECT_NE(
      error(scene, hold("inverse_dynamics: {kp: 1, contacts: {from: flags, delay: 1.5 ms}}")).find("nearest: 0.00"),
      std::string::npos);
  EXPECT_NE(error(scene, hold("inverse_dynamics: {kp: 1, model: none, contacts: {within: 1 cm}}")).find("model: none"),
            std::string::npos);
  EXPECT_NE(error(scene, hold("inverse_dynamics: {kp: 1, model: none, regularization: 0.1}"))
                .find("model 'none' predicts none"),
            std::string::npos);
  World fixed = links_world();
  fixed.robot.floating_base = false;
  const Scene arm(fixed);
  EXPECT_NE(error(arm, hold("inverse_dynamics: {kp: 1}")).find("objects: [OBJECT"), std::string::npos);
  Controller(arm.context(), Settings::parse(hold("inverse_dynamics: {kp: 1, model: none}"), "policy.yaml"));
}

}  // namespace
}  // namespace graze
