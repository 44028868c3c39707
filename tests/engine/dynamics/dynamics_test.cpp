// Claim: every quantity that engine/dynamics offers is what its name says, on trees of every kind: against another way
// to compute it (reference.h), and by what quantities have to do with each other.

#include <gtest/gtest.h>

#include "engine/dynamics/dynamics_model.h"
#include "engine/lanes/block.h"
#include "tests/engine/dynamics/allocations.h"
#include "tests/engine/dynamics/robots.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using testing::moved;
using testing::random_state;
using testing::rate_of;

/// A robot somewhere, with all that the functions need.
struct Scalar {
  DynamicsModel robot;
  DynamicsData<double> data;
  explicit Scalar(const Model& model) : robot(model), data(robot) {}

  const TreeT<double>& at(const Eigen::VectorXd& q) {
    update_poses(data.tree(), q.data());
    return data.tree();
  }
  const TreeT<double>& at(const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
    update(data.tree(), q.data(), v.data());
    return data.tree();
  }
  Eigen::MatrixXd mass() const {
    Eigen::MatrixXd M(robot.nv(), robot.nv());
    dense_mass(data.tree(), M.data());
    return M;
  }
  Eigen::VectorXd bias() const { return Eigen::Map<const Eigen::VectorXd>(data.tree().bias, robot.nv()); }
};

/// Runs a check on each robot in some states.
template <class Check>
void on_all_robots(const Check& check) {
  for (const auto& [name, model] : testing::robots()) {
    for (unsigned seed = 1; seed < 4; ++seed) {
      SCOPED_TRACE(name + ", state " + std::to_string(seed));
      check(model, random_state(model, seed));
    }
  }
}

Eigen::Matrix3Xd to_matrix(const std::vector<Vec3T<double>>& columns) {
  Eigen::Matrix3Xd out(3, columns.size());
  for (std::size_t k = 0; k < columns.size(); ++k) out.col(static_cast<int>(k)) = to_eigen(columns[k]);
  return out;
}

/// Bodies of the tree on `top`.
std::vector<int> members(const Model& model, int top) {
  std::vector<int> out, of(model.bodies.size());
  for (int i = 0; i < static_cast<int>(model.bodies.size()); ++i) {
    of[i] = model.bodies[i].parent < 0 ? i : of[model.bodies[i].parent];
    if (of[i] == top) out.push_back(i);
  }
  return out;
}

std::vector<int> tops(const Model& model) {
  std::vector<int> out;
  for (int i = 0; i < static_cast<int>(model.bodies.size()); ++i) {
    if (model.bodies[i].parent < 0) out.push_back(i);
  }
  return out;
}

Vec3 reference_com(const Model& model, const Eigen::VectorXd& q, int top) {
  const std::vector<Pose> X = reference_poses(model, q);
  double mass = 0;
  Vec3 first = Vec3::Zero();
  for (const int i : members(model, top)) {
    mass += model.bodies[i].mass;
    first += model.bodies[i].mass * (X[i] * model.bodies[i].com);
  }
  return first / mass;
}

TEST(Dynamics, PosesAreThoseOfTheReference) {
  on_all_robots([](const Model& model, const State& state) {
    Scalar robot(model);
    const TreeT<double>& tree = robot.at(state.q);
    const std::vector<Pose> X = reference_poses(model, state.q), placed = place_bodies(model, state.q);
    Pose X_BF = Pose::Identity();
    X_BF.linear() = rotation_from_rpy({0.3, -0.4, 0.5});
    X_BF.translation() = Vec3(0.1, 0.2, -0.3);
    for (int i = 0; i < robot.robot.bodies(); ++i) {
      const Pose found = to_eigen(frame_pose(tree, i, to_kernel(X_BF)));
      EXPECT_LT(((X[i] * X_BF).matrix() - found.matrix()).cwiseAbs().maxCoeff(), 1e-13) << i;
      EXPECT_LT((placed[i].matrix() - to_eigen(tree.pose[i]).matrix()).cwiseAbs().maxCoeff(), 1e-13) << i;
    }
    EXPECT_EQ((to_eigen(frame_pose(tree, -1, to_kernel(X_BF))).matrix() - X_BF.matrix()).norm(), 0);
  });
}

// The tolerance: rate_of is wrong by 1e-12 f''''' / 30, and a point of a chain that turns at some rad/s has fifth
// derivatives of some 1e4 m/s^5.
TEST(Dynamics, JacobiansAreTheDerivativesOfPoses) {
  on_all_robots([](const Model& model, const State& state) {
    Scalar robot(model), other(model);
    const TreeT<double>& tree = robot.at(state.q, state.v);
    std::vector<Vec3T<double>> J(model.nv);
    std::vector<SpatialT<double>> F(model.nv);
    const Vec3 p_B(0.1, -0.2, 0.3);
    for (int i = 0; i < robot.robot.bodies(); ++i) {
      const auto place = [&](double h) -> Vec3 {
        other.at(moved(model, state.q, state.v, h));
        return to_eigen(other.data.tree().pose[i]) * p_B;
      };
      const auto turn = [&](double h) -> Mat3 {
        other.at(moved(model, state.q, state.v, h));
        return to_eigen(other.data.tree().pose[i]).linear();
      };
      const Vec3T<double> p = to_kernel(place(0));
      point_jacobian(tree, i, p, J.data());
      frame_jacobian(tree, i, p, F.data());
      Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();
      for (int k = 0; k < model.nv; ++k) {
        velocity += to_eigen(J[k]) * state.v[k];
        spin += to_eigen(F[k].w) * state.v[k];
        EXPECT_EQ(to_eigen(F[k].l), to_eigen(J[k]));
      }
      const Vec3 numeric = rate_of(place);
      const Mat3 W = rate_of(turn) * to_eigen(tree.pose[i]).linear().transpose();
      const double scale = 1 + velocity.norm() + spin.norm();
      EXPECT_LT((velocity - numeric).norm(), 1e-8 * scale) << i;
      EXPECT_LT((spin - Vec3(W(2, 1), W(0, 2), W(1, 0))).norm(), 1e-8 * scale) << i;
      EXPECT_LT((velocity - to_eigen(point_velocity(tree, i, p))).norm(), 1e-13 * scale) << i;
      EXPECT_LT((spin - to_eigen(tree.motion[i].V.w)).norm(), 1e-13 * scale) << i;
      EXPECT_LT((to_matrix(J) - reference_jacobian(model, reference_poses(model, state.q), i, place(0)))
                    .cwiseAbs()
                    .maxCoeff(),
                1e-13)
          << i;
    }
    point_jacobian(tree, -1, {1, 2, 3}, J.data());
    EXPECT_EQ(to_matrix(J).norm(), 0) << "the world does not move";
    frame_jacobian(tree, -1, {1, 2, 3}, F.data());
    for (const SpatialT<double>& column : F) EXPECT_EQ(to_eigen(column.w).norm() + to_eigen(column.l).norm(), 0);
  });
}

TEST(Dynamics, EquationOfMotionIsThatOfTheReference) {
  on_all_robots([](const Model& model, const State& state) {
    Scalar robot(model);
    robot.at(state.q, state.v);
    const Eigen::MatrixXd M = robot.mass(), want = testing::reference_mass_matrix(model, state.q);
    EXPECT_LT((M - want).cwiseAbs().maxCoeff(), 1e-12 * want.cwiseAbs().maxCoeff());
    EXPECT_EQ((M - M.transpose()).norm(), 0);
    for (int i = 0; i < model.nv; ++i) {
      for (int j = 0; j <= i; ++j) EXPECT_EQ(mass_entry(robot.data.tree(), i, j), M(i, j)) << i << " " << j;
    }
    const Eigen::VectorXd bias = testing::reference_bias(model, state.q, state.v);
    EXPECT_LT((robot.bias() - bias).cwiseAbs().maxCoeff(), 1e-12 * bias.cwiseAbs().maxCoeff());
    const Eigen::VectorXd still = testing::reference_bias(model, state.q, Eigen::VectorXd::Zero(model.nv));
    Eigen::VectorXd gravity(model.nv);
    gravity_forces(robot.data.tree(), gravity.data());
    EXPECT_LT((gravity - still).cwiseAbs().maxCoeff(), 1e-12 * still.cwiseAbs().maxCoeff());
  });
}

TEST(Dynamics, GravityIsTheSlopeOfPotentialEnergy) {
  on_all_robots([](const Model& model, const State& state) {
    Scalar robot(model), other(model);
    robot.at(state.q, state.v);
    Eigen::VectorXd gravity(model.nv);
    gravity_forces(robot.data.tree(), gravity.data());
    const Eigen::VectorXd rate = rate_of([&](double h) {
      other.at(moved(model, state.q, state.v, h), state.v);
      return Eigen::VectorXd::Constant(1, potential_energy(other.data.tree())).eval();
    });
    EXPECT_NEAR(rate[0], gravity.dot(state.v), 1e-8 * (1 + gravity.norm() * state.v.norm()));
  });
}

TEST(Dynamics, ForwardAndInverseAreInverses) {
  on_all_robots([](const Model& model, const State& state) {
    Scalar robot(model);
    const TreeT<double>& tree = robot.at(state.q, state.v);
    const Eigen::MatrixXd M = robot.mass();
    const Eigen::VectorXd bias = robot.bias(), a = 5 * Eigen::VectorXd::Random(model.nv);
    Eigen::VectorXd tau(model.nv), back(model.nv);
    inverse_dynamics(tree, state.v.data(), a.data(), tau.data());
    EXPECT_LT((tau - M * a - bias).norm(), 1e-13 * (M.norm() * a.norm() + bias.norm()));
    const double condition = M.norm() * M.inverse().norm();
    forward_dynamics(tree, tau.data(), back.data());
    EXPECT_LT((back - a).norm(), 1e-14 * condition * (1 + a.norm() + bias.norm()));
    Eigen::VectorXd x = tau;
    solve_mass(tree, x.data());
    EXPECT_LT((x - M.ldlt().solve(tau)).norm(), 1e-14 * condition * (1 + x.norm()));
  });
}

// Along the motion that forward dynamics has, under joint torques, gravity and a force on one body: energy changes by
// their work, and the momentum of a floating tree by their impulse.
TEST(Dynamics, EnergyAndMomentumChangeByWhatActs) {
  on_all_robots([](const Model& model, const State& state) {
    Scalar robot(model), other(model);
    const TreeT<double>& tree = robot.at(state.q, state.v);
    const int body = robot.robot.bodies() - 1;
    const Vec3 p = to_eigen(tree.pose[body]) * Vec3(0.1, 0.2, 0.3), f(20, -30, 10), m(3, 4, -5);
    Eigen::VectorXd joints = 10 * Eigen::VectorXd::Random(model.nv), a(model.nv);
    for (const Body& b : model.bodies) {
      if (b.type == JointType::floating) joints.segment<6>(b.v).setZero();
    }
    Eigen::VectorXd tau = joints;
    add_force(tree, body, to_kernel(p), to_kernel(f), tau.data());
    add_torque(tree, body, to_kernel(m), tau.data());
    const double power = joints.dot(state.v) + f.dot(to_eigen(point_velocity(tree, body, to_kernel(p)))) +
                         m.dot(to_eigen(tree.motion[body].V.w));
    EXPECT_NEAR(tau.dot(state.v), power, 1e-12 * (1 + tau.norm() * state.v.norm()));
    const double kinetic = kinetic_energy(tree, state.v.data());
    EXPECT_NEAR(0.5 * state.v.dot(robot.mass() * state.v), kinetic, 1e-12 * (1 + kinetic));
    forward_dynamics(tree, tau.data(), a.data());
    const auto go = [&](double h) -> const TreeT<double>& {
      return other.at(moved(model, state.q, state.v, h), state.v + h * a);
    };
    const Eigen::VectorXd rate = rate_of(
        [&](double h) {
          const TreeT<double>& then = go(h);
          const Eigen::VectorXd v = state.v + h * a;
          return Eigen::VectorXd::Constant(1, kinetic_energy(then, v.data()) + potential_energy(then)).eval();
        },
        1e-4);
    const double scale = 1 + kinetic + std::abs(potential_energy(go(0))) + std::abs(power);
    EXPECT_NEAR(rate[0], power, 1e-7 * scale);
    for (const int top : tops(model)) {
      if (model.bodies[top].type != JointType::floating) continue;
      const Eigen::Matrix<double, 6, 1> change = rate_of(
          [&](double h) {
            const SpatialT<double> P = momentum_about(go(h), top, {0, 0, 0});
            return (Eigen::Matrix<double, 6, 1>() << to_eigen(P.w), to_eigen(P.l)).finished();
          },
          1e-4);
      const bool acts = tree.topology.top[body] == top;
      const Vec3 force = mass_of_tree(tree, top) * model.gravity + (acts ? f : Vec3(Vec3::Zero()));
      const Vec3 com = to_eigen(centre_of_mass(tree, top));
      const Vec3 torque =
          com.cross(mass_of_tree(tree, top) * model.gravity) + (acts ? Vec3(p.cross(f) + m) : Vec3(Vec3::Zero()));
      EXPECT_LT((change.head<3>() - torque).norm(), 1e-7 * (scale + torque.norm())) << top;
      EXPECT_LT((change.tail<3>() - force).norm(), 1e-7 * (scale + force.norm())) << top;
    }
  });
}

TEST(Dynamics, CentreOfMassAndItsJacobian) {
  on_all_robots([](const Model& model, const State& state) {
    Scalar robot(model);
    const TreeT<double>& tree = robot.at(state.q, state.v);
    for (const int top : tops(model)) {
      const Vec3 com = to_eigen(centre_of_mass(tree, top));
      EXPECT_LT((com - reference_com(model, state.q, top)).norm(), 1e-13) << top;
      std::vector<Vec3T<double>> J(model.nv);
      com_jacobian(tree, top, J.data());
      const Vec3 velocity = to_matrix(J) * state.v;
      const Vec3 numeric =
          rate_of([&](double h) -> Vec3 { return reference_com(model, moved(model, state.q, state.v, h), top); });
      EXPECT_LT((velocity - numeric).norm(), 1e-8 * (1 + velocity.norm())) << top;
      EXPECT_LT((velocity - to_eigen(com_velocity(tree, top))).norm(), 1e-13 * (1 + velocity.norm())) << top;
      // About the centre of mass, a tree's momentum is that of its bodies' spins and of their ways about it.
      Vec3 spin = Vec3::Zero();
      double mass = 0;
      for (const int i : members(model, top)) {
        const testing::BodyJacobian B = testing::body_jacobian(model, state.q, i);
        const Vec3 c = reference_poses(model, state.q)[i] * model.bodies[i].com;
        spin += B.inertia_W * (B.angular * state.v) + (c - com).cross(model.bodies[i].mass * (B.linear * state.v));
        mass += model.bodies[i].mass;
      }
      const SpatialT<double> P = momentum_about(tree, top, to_kernel(com));
      EXPECT_LT((to_eigen(P.w) - spin).norm(), 1e-12 * (1 + spin.norm())) << top;
      EXPECT_LT((to_eigen(P.l) - mass * velocity).norm(), 1e-12 * (1 + mass * velocity.norm())) << top;
    }
  });
}

TEST(Dynamics, AccelerationsOfPointsAreTheRatesOfTheirVelocities) {
  on_all_robots([](const Model& model, const State& state) {
    Scalar robot(model), other(model);
    const TreeT<double>& tree = robot.at(state.q, state.v);
    const Eigen::VectorXd a = 5 * Eigen::VectorXd::Random(model.nv);
    Eigen::VectorXd tau(model.nv);
    inverse_dynamics(tree, state.v.data(), a.data(), tau.data());
    const Vec3 p_B(0.1, -0.2, 0.3);
    for (int i = 0; i < robot.robot.bodies(); ++i) {
      const Vec3 numeric = rate_of([&](double h) -> Vec3 {
        const Eigen::VectorXd q = moved(model, state.q, state.v, h), v = state.v + h * a;
        const std::vector<Pose> X = reference_poses(model, q);
        return reference_jacobian(model, X, i, X[i] * p_B) * v;
      });
      const Vec3 found = to_eigen(point_acceleration(tree, i, to_kernel(to_eigen(tree.pose[i]) * p_B)));
      EXPECT_LT((found - numeric).norm(), 1e-8 * (10 + numeric.norm())) << i;
    }
  });
}

TEST(Dynamics, VelocitiesAloneAreThoseOfTheBias) {
  on_all_robots([](const Model& model, const State& state) {
    Scalar all(model), alone(model);
    const TreeT<double>& tree = all.at(state.q, state.v);
    const TreeT<double>& few = alone.at(state.q);
    update_velocities(few, state.v.data());
    for (int i = 0; i < all.robot.bodies(); ++i) {
      EXPECT_EQ(to_eigen(tree.motion[i].V.w), to_eigen(few.motion[i].V.w));
      EXPECT_EQ(to_eigen(tree.motion[i].V.l), to_eigen(few.motion[i].V.l));
    }
  });
}

TEST(Dynamics, ContactJacobiansAreDifferencesOfThoseOfPoints) {
  on_all_robots([](const Model& model, const State& state) {
    Scalar robot(model);
    const TreeT<double>& tree = robot.at(state.q);
    const int bodies = robot.robot.bodies();
    std::vector<Vec3T<double>> y(model.nv), Ja(model.nv), Jb(model.nv);
    for (int a = -1; a < bodies; ++a) {
      for (int b = -1; b < bodies; ++b) {
        ContactFrameT<double> c;
        c.n = to_kernel(Vec3(Vec3::Random().normalized()));
        c.p = to_kernel(Vec3(Vec3::Random()));
        make_tangents(c);
        contact_jacobian(tree, a, b, c, y.data());
        point_jacobian(tree, a, c.p, Ja.data());
        point_jacobian(tree, b, c.p, Jb.data());
        for (int k = 0; k < model.nv; ++k) {
          EXPECT_LT((to_eigen(to_world(c, y[k])) - to_eigen(Ja[k] - Jb[k])).norm(), 1e-12) << a << " " << b << " " << k;
        }
      }
    }
  });
}

/// All that a step of W particles gives, as doubles of one lane.
template <class T>
struct Everything {
  std::vector<T> numbers;

  void put(const T& x) { numbers.push_back(x); }
  void put(const Vec3T<T>& a) { put(a.x), put(a.y), put(a.z); }
  void put(const SpatialT<T>& a) { put(a.w), put(a.l); }

  Everything(const TreeT<T>& tree, const T* q, const T* v, const T* tau, int body) {
    const int nv = tree.topology.nv;
    put(update(tree, q, v));
    put(potential_energy(tree));
    put(kinetic_energy(tree, v));
    put(centre_of_mass(tree, 0));
    put(com_velocity(tree, 0));
    put(momentum_about(tree, 0, {T(0.1), T(0.2), T(0.3)}));
    const Vec3T<T> p = tree.pose[body] * Vec3T<T>{T(0.1), T(0.2), T(0.3)};
    put(p);
    put(point_velocity(tree, body, p));
    std::vector<Vec3T<T>> J(nv);
    std::vector<SpatialT<T>> F(nv);
    std::vector<T> x(nv), a(nv);
    com_jacobian(tree, 0, J.data());
    for (const Vec3T<T>& column : J) put(column);
    frame_jacobian(tree, body, p, F.data());
    for (const SpatialT<T>& column : F) put(column);
    ContactFrameT<T> c;
    c.n = tree.pose[body].R.column(2), c.p = p;
    make_tangents(c);
    contact_jacobian(tree, body, -1, c, J.data());
    for (const Vec3T<T>& row : J) put(row);
    gravity_forces(tree, x.data());
    for (const T& one : x) put(one);
    inverse_dynamics(tree, v, tau, x.data());
    for (const T& one : x) put(one);
    put(point_acceleration(tree, body, p));
    for (int i = 0; i < tree.topology.row[nv]; ++i) put(tree.M[i]);
    for (int i = 0; i < nv; ++i) put(tree.bias[i]), x[i] = tau[i];
    add_force(tree, body, p, c.n, x.data());
    add_torque(tree, body, c.s, x.data());
    forward_dynamics(tree, x.data(), a.data());
    for (const T& one : a) put(one);
    solve_mass(tree, x.data());
    for (const T& one : x) put(one);
  }
};

// Eight robots with different numbers, in different states: each lane has the bits that it has alone.
TEST(Dynamics, LanesAreTheSameBitsAsOneRobot) {
  using Eight = Pack<8>;
  const auto lane_of = [](const Eight& x, int lane) {
    double out[8];
    store(out, x);
    return out[lane];
  };
  for (const auto& [name, model] : testing::robots()) {
    SCOPED_TRACE(name);
    std::vector<Eight> q(model.nq), v(model.nv), tau(model.nv);
    std::vector<DynamicsModel> particles;
    std::vector<State> states;
    std::vector<Eigen::VectorXd> torques;
    const DynamicsModel nominal(model);
    DynamicsData<Eight> data(nominal);
    const auto fill = [](std::vector<Eight>& rows, int lane, const Eigen::VectorXd& values) {
      for (int i = 0; i < values.size(); ++i) set_lane_of<Eight>(rows[i], lane, &values[i]);
    };
    for (int lane = 0; lane < 8; ++lane) {
      Model other = model;
      for (Body& body : other.bodies) {
        body.mass *= 1 + 0.01 * lane;
        body.com.x() += 0.001 * lane;
        body.X_PB.translation().y() += 0.01 * lane;
      }
      other.gravity.z() -= 0.1 * lane;
      particles.emplace_back(other);
      if (lane != 3) data.set_lane(lane, particles.back());  // lane 3 keeps the nominal numbers
      states.push_back(random_state(model, 10u + static_cast<unsigned>(lane)));
      torques.push_back(10 * Eigen::VectorXd::Random(model.nv));
      fill(q, lane, states.back().q), fill(v, lane, states.back().v), fill(tau, lane, torques.back());
    }
    const int body = nominal.bodies() - 1;
    const Everything<Eight> together(data.tree(), q.data(), v.data(), tau.data(), body);
    for (int lane = 0; lane < 8; ++lane) {
      DynamicsData<double> alone(lane == 3 ? nominal : particles[static_cast<std::size_t>(lane)]);
      const State& state = states[static_cast<std::size_t>(lane)];
      const Everything<double> one(alone.tree(), state.q.data(), state.v.data(),
                                   torques[static_cast<std::size_t>(lane)].data(), body);
      ASSERT_EQ(one.numbers.size(), together.numbers.size());
      for (std::size_t i = 0; i < one.numbers.size(); ++i) {
        EXPECT_EQ(one.numbers[i], lane_of(together.numbers[i], lane)) << "lane " << lane << ", number " << i;
      }
    }
  }
}

// The lane engine runs the same code: M, bias and poses that its kernels leave are those of a robot alone, by every
// instruction set.
TEST(Dynamics, TheLaneEngineHasTheSameBits) {
  for (const auto& [name, model] : testing::robots()) {
    Scalar robot(model);
    for (const Isa isa : available_isas()) {
      SCOPED_TRACE(name + ", " + isa_name(isa));
      BlockArray q(model.nq), v(model.nv), a(model.nv), X(12 * robot.robot.bodies());
      LaneEngine engine(model, kernel_of(isa, kLanes), {q.row(0), v.row(0), a.row(0), X.row(0)});
      for (int lane = 0; lane < kLanes; ++lane) {
        engine.start(lane, model, random_state(model, 20u + static_cast<unsigned>(lane)));
      }
      const LaneBlock& block = engine.block();
      for (int lane = 0; lane < kLanes; ++lane) {
        const TreeT<double>& tree = robot.at(q.column(lane), v.column(lane));
        for (int i = 0; i < tree.topology.row[model.nv]; ++i) ASSERT_EQ(block.M[i * kLanes + lane], tree.M[i]) << i;
        for (int i = 0; i < model.nv; ++i) ASSERT_EQ(block.bias[i * kLanes + lane], tree.bias[i]) << i;
        for (int i = 0; i < robot.robot.bodies(); ++i) {
          for (int k = 0; k < 9; ++k) ASSERT_EQ(X(12 * i + k, lane), tree.pose[i].R.m[k]) << i;
          ASSERT_EQ(X.vec3(12 * i + 9, lane), to_eigen(tree.pose[i].p)) << i;
        }
      }
    }
  }
}

TEST(Dynamics, NothingIsAllocatedAfterConstruction) {
#if GRAZE_SANITIZED
  GTEST_SKIP() << "sanitizers have an operator new of their own";
#endif
  const Model model = testing::shipped("links.urdf", true);
  const State state = random_state(model, 1);
  const DynamicsModel robot(model);
  DynamicsData<double> data(robot);
  Eigen::VectorXd tau = Eigen::VectorXd::Ones(model.nv), a(model.nv);
  std::vector<Vec3T<double>> J(model.nv);
  std::vector<SpatialT<double>> F(model.nv);
  const TreeT<double>& tree = data.tree();
  const long before = testing::allocations();
  data.set_lane(0, robot);
  update(tree, state.q.data(), state.v.data());
  inverse_dynamics(tree, state.v.data(), tau.data(), a.data());
  gravity_forces(tree, a.data());
  add_force(tree, 3, {0, 0, 0}, {1, 2, 3}, tau.data());
  point_jacobian(tree, 3, {0, 0, 0}, J.data());
  frame_jacobian(tree, 3, {0, 0, 0}, F.data());
  com_jacobian(tree, 0, J.data());
  const Vec3T<double> com = centre_of_mass(tree, 0);
  forward_dynamics(tree, tau.data(), a.data());
  solve_mass(tree, tau.data());
  EXPECT_EQ(testing::allocations(), before);
  EXPECT_TRUE(std::isfinite(com.x + a.norm()));
  std::vector<double> some(8);
  EXPECT_EQ(testing::allocations(), before + 1) << "they are counted";
}

}  // namespace
}  // namespace graze
