// Claim: a back end of one's own is one file. It registers itself, and is then chosen by its name as those that come
// with the program are; what it does not do it refuses in words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "engine/physics.h"
#include "simulation/simulation.h"
#include "tests/jobs/program.h"
#include "tests/message_of.h"
#include "tests/trace_bits.h"

namespace graze {
namespace {

using testing::message_of;

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// What Drift tells of a solver that it has not, by the particle's height at its start and the step.
SolverEffort planted_effort(double z, int step) {
  const int every = 2 + static_cast<int>(z * 1000) % 5;
  SolverEffort out;
  out.sweeps = step % 7 + 1;
  out.unconverged = step % every == 0;
  out.residual = out.unconverged ? 1e-6 * std::pow(1.5, step % 40 + 1) : 1e-7;
  out.braked = step % 13 != 0 ? 0 : step % 2 == 0 ? 2 * kBraked : kBraked / 2;
  return out;
}

/// Nothing acts on its bodies: those that float drift with the velocity that they begin with.
class Drift : public BlockPhysics {
 public:
  explicit Drift(const Model& nominal) : bodies_(nominal.bodies) {
    state_.q = BlockArray(nominal.nq);
    state_.v = state_.a = BlockArray(nominal.nv);
    state_.X = BlockArray(12 * static_cast<int>(nominal.bodies.size()));
  }
  void start(int lane, const Particle& particle) override {
    state_.q.set_column(lane, particle.initial.q);
    state_.v.set_column(lane, particle.initial.v);
    begin_[lane] = particle.initial.q[6], steps_[lane] = 0;
    show(lane);
  }
  void step(double h, LaneMask active, const BlockArray&) override {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      ++steps_[lane];
      for (const Body& body : bodies_) {
        if (body.type != JointType::floating) continue;
        for (int k = 0; k < 3; ++k) state_.q(body.q + 4 + k, lane) += h * state_.v(body.v + 3 + k, lane);
      }
      show(lane);
    }
  }

  SolverEffort effort(int lane) const override { return planted_effort(begin_[lane], steps_[lane]); }

 private:
  void show(int lane) {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const int X = 12 * static_cast<int>(i);
      for (const int k : {0, 4, 8}) state_.X(X + k, lane) = 1;
      for (int k = 0; k < 3; ++k) state_.X(X + 9 + k, lane) = state_.q(bodies_[i].q + 4 + k, lane);
    }
  }
  std::vector<Body> bodies_;
  std::array<double, kLanes> begin_{};  // m, height
  std::array<int, kLanes> steps_{};
};

const PhysicsRegistration drift_registration("a-drift",
                                             {"bodies on which nothing acts",
                                              {{"none", "they pass through each other"}}},
                                             [](const Model& nominal) { return std::make_unique<Drift>(nominal); });

TEST(BackEnd, IsChosenByTheNameUnderWhichItRegistered) {
  testing::TemporaryFolder folder;
  testing::write_ball(folder);
  ScenarioOptions options;
  options.overrides = {{"physics", "a-drift"}};
  const Simulation simulation(load_scenario(folder / "ball.yaml", options));
  const std::vector<TraceRecord> traces = Simulator(simulation, simulation.scenario().policies.front().name).run(0, 11);
  ASSERT_EQ(traces.size(), 11u);
  for (std::uint32_t i = 0; i < 11; ++i) {
    const Particle particle = simulation.particle(i);
    EXPECT_NE(traces[i].outcome, Outcome::invalid) << traces[i].invalid_reason;
    EXPECT_THAT(traces[i].v,
                ::testing::Pointwise(::testing::DoubleEq(),
                                     std::vector<double>(particle.initial.v.begin(), particle.initial.v.end())));
    const double expected = particle.initial.q[6] + traces[i].end_time * particle.initial.v[5];
    EXPECT_NEAR(traces[i].q[6], expected, 1e-12);
  }
}

/// The log of a particle that took so many steps, counted by hand.
SolverLog counted(double z, int steps) {
  SolverLog out;
  std::vector<double> changes;
  for (int step = 1; step <= steps; ++step) {
    const SolverEffort effort = planted_effort(z, step);
    out.steps += 1;
    out.largest_residual = std::max(out.largest_residual, effort.residual);
    out.most_braked = std::max(out.most_braked, effort.braked);
    out.braked_steps += effort.braked > kBraked;
    if (effort.unconverged) changes.push_back(effort.residual);
  }
  out.unconverged_steps = static_cast<double>(changes.size());
  std::sort(changes.begin(), changes.end());
  if (!changes.empty()) out.median_residual = changes[(changes.size() - 1) / 2];
  return out;
}

// Claim: what a back end tells of its solver is counted as by hand, step by step, in traces that end one by one, and
// alone as in company.
TEST(BackEnd, WhatItTellsOfItsSolverIsCounted) {
  testing::TemporaryFolder folder;
  testing::write_ball(folder);
  ScenarioOptions options;
  options.overrides = {{"physics", "a-drift"},
                       {"robot.initial.velocity", "[0, 0, -2]"},
                       {"task.requirements.high.height.above", "0.12"}};
  const Simulation simulation(load_scenario(folder / "ball.yaml", options));
  Simulator simulator(simulation, "still");
  const std::vector<TraceRecord> traces = simulator.run(0, 43);
  std::set<double> ends, shares;
  for (std::uint32_t i = 0; i < 43; ++i) {
    const SolverLog& log = traces[i].solver;
    const SolverLog want =
        counted(simulation.particle(i).initial.q[6], static_cast<int>(std::lround(traces[i].end_time / 0.001)));
    EXPECT_EQ(log.steps, want.steps);
    EXPECT_EQ(log.unconverged_steps, want.unconverged_steps);
    EXPECT_EQ(log.largest_residual, want.largest_residual);
    EXPECT_NEAR(log.median_residual, want.median_residual, 0.07 * want.median_residual);
    EXPECT_EQ(log.braked_steps, want.braked_steps);
    EXPECT_EQ(log.most_braked, want.most_braked);
    EXPECT_EQ(testing::all_bits_of(simulator.run(i, 1).front()), testing::all_bits_of(traces[i])) << "alone";
    ends.insert(traces[i].end_time), shares.insert(log.unconverged_share());
  }
  EXPECT_GT(ends.size(), 10u);
  EXPECT_GT(shares.size(), 10u);
}

// Claim: a share at the limit is not above it, and a trace without steps is not flagged.
TEST(BackEnd, TracesAboveTheLimitAreFlagged) {
  SolverLog log;
  EXPECT_FALSE(log.flagged(0));
  log.steps = 100, log.unconverged_steps = 5;
  EXPECT_FALSE(log.flagged(0.05));
  EXPECT_TRUE(log.flagged(0.0499));
  log.unconverged_steps = 6;
  EXPECT_TRUE(log.flagged(0.05));
}

TEST(BackEnd, StandsBehindTheDefaultInEveryList) {
  EXPECT_THAT(physics_names(), ElementsAre("lanes", "a-drift", "bullet"));
  EXPECT_THAT(contact_models_of("a-drift"), ElementsAre("none"));
  EXPECT_EQ(physics_text("a-drift").library, "");
}

TEST(BackEnd, IsNamedWhereAWrongNameIsRefused) {
  const Model model = load_scenario(testing::data("scenarios/pendulum.yaml")).model;
  EXPECT_THAT(
      message_of([&] { make_physics("a-drif", model); }),
      HasSubstr("physics: a-drif: no such back end; there are lanes, a-drift, bullet; did you mean 'a-drift'?"));
  Model sticky = model;
  sticky.contact_model = "sticky";
  EXPECT_THAT(message_of([&] { make_physics("a-drift", sticky); }),
              HasSubstr("sticky: unknown to the back end 'a-drift', which has none"));
  sticky.contact_model = "none";
  EXPECT_THROW(make_physics("a-drift", sticky)->save(0), std::logic_error);
}

}  // namespace
}  // namespace graze
