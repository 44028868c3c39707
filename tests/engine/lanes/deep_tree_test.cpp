// Claim: Newton's method on deep trees (engine/contact/newton_tree.h) solves the steps that the one that forms its
// matrix solves; and a lane's bits depend on nothing but the lane, also where some lanes have contacts that it cannot
// take.

#include <gtest/gtest.h>

#include <cstring>
#include <utility>

#include "tests/engine/lanes/worlds.h"
#include "tests/sanitized.h"

namespace graze::test {
namespace {

constexpr double kChainStep = 1e-3;
constexpr int kJoints = 20;  // 26 degrees of freedom

/// What the chain meets: the ground; a crate, too; nothing but the stops of its joints.
enum class Meets { ground, crate, nothing };

/// What its joints are driven by: torques; servos whose torques meet their bounds; servos, and in all lanes but the
/// last one joint is held, which newton_tree.h cannot take.
enum class Drives { torques, servos, held };

World crawling_chain(Meets meets) {
  World world = lying_chain(kJoints);
  for (Joint& joint : world.robot.joints) joint.lower = -0.3, joint.upper = 0.3, joint.friction = 2e-3;
  if (meets == Meets::crate) world.objects.push_back(movable("crate", box(0.04, 0.1, 0.03), 0.1, at(0.6, 0, 0.09)));
  world.initial.clearance = meets == Meets::nothing ? 1.0 : 0.002;
  return world;
}

/// Friction, masses and posture differ.
Particle particle(int id, Meets meets) {
  Particle out = particle_of(crawling_chain(meets));
  const auto spread = [&](const std::string& name) { return 2 * uniform(5, id, name_hash(name), 0) - 1; };
  for (Body& body : out.model.bodies) {
    const double factor = 1 + 0.2 * spread(body.name);
    body.mass *= factor;
    body.inertia *= factor;
  }
  for (ColliderPair& pair : out.model.pairs) pair.friction = 0.7 + 0.4 * spread("friction");
  for (int body : out.model.actuated) {
    out.initial.q[out.model.bodies[body].q] += 0.15 * spread(out.model.bodies[body].joint);
  }
  return out;
}

/// An engine with its numbers.
struct Chain {
  Model nominal;
  BlockArray q, v, a, X;
  int lanes;
  LaneEngine engine;
  Drives drives;
  Drive drive;  // `lanes` numbers per row

  Chain(Isa isa, int count, Meets meets, Drives drives = Drives::torques)
      : nominal(particle(0, meets).model),
        q(nominal.nq),
        v(nominal.nv),
        a(nominal.nv),
        X(12 * static_cast<int>(nominal.bodies.size())),
        lanes(count),
        engine(nominal, kernel_of(isa, count), {q.row(0), v.row(0), a.row(0), X.row(0)}),
        drives(drives),
        drive(nominal.na()) {}

  void step(int k) {
    const unsigned all = (1u << lanes) - 1u;
    for (int j = 0; j < nominal.na(); ++j) {
      for (int lane = 0; lane < lanes; ++lane) lead(j, j * lanes + lane, lane == lanes - 1, k);
    }
    const Drive& d = drive;
    const double* servos = d.q.row(0);
    if (drives == Drives::torques) return engine.step(kChainStep, all, d.tau.row(0));
    engine.drive(kChainStep, all,
                 {d.tau.row(0), servos, d.v.row(0), d.kp.row(0), d.kd.row(0), d.lower.row(0), d.upper.row(0),
                  d.prescribed.row(0)});
  }
  /// Joint j's drive in one lane.
  void lead(int j, int at, bool last, int k) {
    const double wave = std::sin(0.02 * k + 0.7 * j);
    if (drives == Drives::torques) {
      drive.tau.row(0)[at] = 0.05 * wave;
      return;
    }
    drive.q.row(0)[at] = 0.2 * wave;
    drive.kp.row(0)[at] = 0.5, drive.kd.row(0)[at] = 0.005;
    drive.lower.row(0)[at] = -0.05, drive.upper.row(0)[at] = 0.05;
    drive.prescribed.row(0)[at] = drives == Drives::held && j == 5 && !last ? 1 : 0;
  }
  State state(int lane) const {
    State out{Eigen::VectorXd(nominal.nq), Eigen::VectorXd(nominal.nv)};
    for (int i = 0; i < nominal.nq; ++i) out.q[i] = engine.block().q[i * lanes + lane];
    for (int i = 0; i < nominal.nv; ++i) out.v[i] = engine.block().v[i * lanes + lane];
    return out;
  }
};

TEST(DeepTree, ComesFirstWhereTreesAreDeep) {
  EXPECT_EQ(Chain(Isa::portable, 1, Meets::ground).engine.block().settings.tree_after, 4);
  const Model shallow = particle_of(lying_chain(17)).model;  // 23 degrees of freedom
  BlockArray q(shallow.nq), v(shallow.nv), a(shallow.nv), X(12 * static_cast<int>(shallow.bodies.size()));
  LaneEngine engine(shallow, kernel_of(Isa::portable, 1), {q.row(0), v.row(0), a.row(0), X.row(0)});
  EXPECT_GE(engine.block().settings.tree_after, engine.block().settings.most_sweeps);
}

// Each from the same state, without what the step before left. Both keep the laws to 1e-6 m/s; so they know velocities
// as well as the problem's condition lets them, which now and then makes 1e-3 rad/s of 3e-7 m/s.
/// Returns the ratio of their sweeps and steps.
double compare_solvers(Drives drives, int steps_of_run) {
  Chain run(chosen_isa(), kLanes, Meets::ground, drives), tree(chosen_isa(), kLanes, Meets::ground, drives),
      other(chosen_isa(), kLanes, Meets::ground, drives);
  other.engine.block().settings.tree_after = other.engine.block().settings.most_sweeps;
  for (int lane = 0; lane < kLanes; ++lane) {
    const Particle of_lane = particle(lane, Meets::ground);
    run.engine.start(lane, of_lane.model, of_lane.initial);
  }
  tree.engine.block().settings.measure = other.engine.block().settings.measure = true;
  int compared = 0, alike = 0;
  double steps = 0, steps_of_other = 0;
  for (int k = 0; k < steps_of_run; ++k) {
    run.step(k);
    if (k % 20 != 19) continue;
    for (int lane = 0; lane < kLanes; ++lane) {
      const Model model = particle(lane, Meets::ground).model;
      tree.engine.start(lane, model, run.state(lane));
      other.engine.start(lane, model, run.state(lane));
    }
    tree.step(k), other.step(k);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (other.engine.sweeps(lane) <= 4) continue;
      ++compared;
      alike += (tree.state(lane).v - other.state(lane).v).cwiseAbs().maxCoeff() < 1e-4;
      EXPECT_LT(tree.engine.block().measured[3 * kLanes + lane], 1e-6);
      EXPECT_LT(other.engine.block().measured[3 * kLanes + lane], 1e-6);
      steps += tree.engine.sweeps(lane);
      steps_of_other += other.engine.sweeps(lane);
    }
  }
  EXPECT_GT(compared, steps_of_run / 4);
  EXPECT_GE(alike, 0.9 * compared) << "of " << compared;
  return steps / steps_of_other;
}

TEST(DeepTree, SolvesWhatTheOtherSolves) { EXPECT_LT(compare_solvers(Drives::torques, 600), 1); }
TEST(DeepTree, SolvesWhatTheOtherSolvesUnderServos) { compare_solvers(Drives::servos, GRAZE_SANITIZED ? 200 : 600); }

// 170 degrees of freedom: too many for a matrix.
TEST(DeepTree, NeedsNoMatrix) {
  const Particle long_chain = particle_of(lying_chain(164));
  BlockArray q(long_chain.model.nq), v(long_chain.model.nv), a(long_chain.model.nv),
      X(12 * static_cast<int>(long_chain.model.bodies.size())), tau(long_chain.model.na());
  LaneEngine engine(long_chain.model, kernel_of(chosen_isa(), kLanes), {q.row(0), v.row(0), a.row(0), X.row(0)});
  EXPECT_EQ(engine.block().settings.newton_after, engine.block().settings.most_sweeps);
  for (int lane = 0; lane < kLanes; ++lane) engine.start(lane, long_chain.model, long_chain.initial);
  engine.block().settings.measure = true;
  int counted = 0, kept = 0;
  for (int k = 0; k < (GRAZE_SANITIZED ? 60 : 100); ++k) {
    engine.step(kChainStep, 1, tau.row(0));
    if (engine.sweeps(0) <= 4) continue;
    ++counted;
    kept += engine.block().measured[3 * kLanes] < 1e-6;
  }
  EXPECT_GT(counted, 10);
  EXPECT_EQ(kept, counted);
}

/// Final coordinates of particle 3 in the last lane, after `late` steps of others.
std::vector<double> run_last(Isa isa, int lanes, Meets meets, Drives drives) {
  Chain chain(isa, lanes, meets, drives);
  for (int lane = 0; lane < lanes; ++lane) {
    const Particle of_lane = particle(lane == lanes - 1 ? 3 : 30 + lane, meets);
    chain.engine.start(lane, of_lane.model, of_lane.initial);
  }
  bool met = false;
  for (int k = 0; k < (GRAZE_SANITIZED ? 130 : 250); ++k) {
    chain.step(k);
    for (int i = 0; i < chain.engine.block().contact_count; ++i) {
      const PairView& pair = chain.engine.block().pairs[chain.engine.block().report_pair[i]];
      met =
          met || (chain.engine.block().colliders[pair.a].body >= 0 && chain.engine.block().colliders[pair.b].body >= 0);
    }
  }
  EXPECT_EQ(met, meets == Meets::crate) << "two bodies meet";
  const State end = chain.state(lanes - 1);
  std::vector<double> out(end.q.begin(), end.q.end());
  out.insert(out.end(), end.v.begin(), end.v.end());
  return out;
}

TEST(DeepTree, BitsDependOnTheLaneAlone) {
  const std::pair<Meets, Drives> cases[] = {{Meets::ground, Drives::torques},
                                            {Meets::crate, Drives::torques},
                                            {Meets::nothing, Drives::torques},
                                            {Meets::ground, Drives::held}};
  for (const auto& [meets, drives] : cases) {
    const std::vector<double> want = run_last(Isa::portable, 1, meets, drives);
    for (Isa isa : available_isas()) {
      for (int lanes : {1, 4, 8}) {
        if (lanes == 4 && isa != Isa::avx2) continue;
        if (GRAZE_SANITIZED && (lanes == 1 || (isa != Isa::portable && isa != chosen_isa()))) continue;
        const std::vector<double> got = run_last(isa, lanes, meets, drives);
        EXPECT_EQ(std::memcmp(got.data(), want.data(), want.size() * sizeof(double)), 0)
            << isa_name(isa) << " " << lanes << ", case " << static_cast<int>(meets) << static_cast<int>(drives);
      }
    }
  }
}

}  // namespace
}  // namespace graze::test
