// Claim: a back end of one's own is one file. It registers itself, and is then chosen by its name as those that come
// with the program are; what it does not do it refuses in words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "engine/physics.h"
#include "simulation/simulation.h"
#include "tests/jobs/program.h"
#include "tests/message_of.h"

namespace graze {
namespace {

using testing::message_of;

using ::testing::ElementsAre;
using ::testing::HasSubstr;

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
    show(lane);
  }
  void step(double h, LaneMask active, const BlockArray&) override {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      for (const Body& body : bodies_) {
        if (body.type != JointType::floating) continue;
        for (int k = 0; k < 3; ++k) state_.q(body.q + 4 + k, lane) += h * state_.v(body.v + 3 + k, lane);
      }
      show(lane);
    }
  }

 private:
  void show(int lane) {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const int X = 12 * static_cast<int>(i);
      for (const int k : {0, 4, 8}) state_.X(X + k, lane) = 1;
      for (int k = 0; k < 3; ++k) state_.X(X + 9 + k, lane) = state_.q(bodies_[i].q + 4 + k, lane);
    }
  }
  std::vector<Body> bodies_;
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
