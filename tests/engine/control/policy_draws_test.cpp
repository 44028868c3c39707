// Claim: what a policy draws depends on the seed, the particle, its name, the control step and the number of the draw,
// and on nothing else: no lane, no neighbour, no earlier draw, no other name.
#include "engine/control/policy_draws.h"

#include <gtest/gtest.h>

#include <set>

#include "sampling/stream.h"
#include "tests/engine/control/support.h"

namespace graze {
namespace {

/// Two draws of each control step and one of the trace, as joint targets.
class Dice : public Policy {
 public:
  explicit Dice(const ControlContext& context) : draws_(*context.draws) {}
  void start(int lane) override { whole_[lane] = draws_.uniform_of_trace(lane); }
  unsigned reads() const override { return 0; }
  void act(const Observation&, LaneMask active, Targets& targets) override {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      targets.q(1, lane) = draws_.uniform(lane, 1);
      targets.q(0, lane) = draws_.uniform(lane);
      targets.q(2, lane) = whole_[lane];
    }
  }

 private:
  PolicyDraws& draws_;
  std::array<double, kLanes> whole_{};
};

const PolicyRegistration registration("tosses_dice", {"throws dice", {}},
                                      [](const ControlContext& context, const Described&, TargetKind) {
                                        return std::make_unique<Dice>(context);
                                      });

struct Throw {
  double first, second, whole;
  bool operator==(const Throw&) const = default;
};

class PolicyDrawsTest : public ::testing::Test {
 protected:
  Scene scene{links_world()};

  Controller make(std::uint64_t seed, const std::string& name) const {
    ControlContext context = scene.context(0.002);
    context.seed = seed;
    context.name = name;
    return Controller(context, Settings::parse("{tosses_dice: {}, control: {joint_pd: {kp: 1}}}", "dice.yaml"));
  }

  /// Of a lane at a control step.
  static Throw act(Controller& controller, int lane, std::uint32_t step, LaneMask active) {
    Observation observation;
    observation.time.fill(0.123);  // neighbours are elsewhere
    observation.time[lane] = step * 0.002;
    ActuatorCommand command(controller.targets().q.rows());
    controller.act(observation, nullptr, active, command);
    const BlockArray& q = controller.targets().q;
    return {q(0, lane), q(1, lane), q(2, lane)};
  }

  Throw thrown(std::uint64_t seed, const std::string& name, std::uint32_t particle, std::uint32_t step, int lane = 0) {
    Controller controller = make(seed, name);
    controller.start(lane, 0, particle);
    LaneMask active;
    active.set(lane);
    return act(controller, lane, step, active);
  }
};

TEST_F(PolicyDrawsTest, AreThoseOfTheirKeys) {
  const Throw one = thrown(7, "walk/2cm", 5, 12);
  EXPECT_EQ(one.first, uniform(7, 5, name_hash("policy.walk/2cm#0"), 12));
  EXPECT_EQ(one.second, uniform(7, 5, name_hash("policy.walk/2cm#1"), 12));
  EXPECT_EQ(one.whole, uniform(7, 5, name_hash("policy.walk/2cm#0"), kPersistent));
}

TEST_F(PolicyDrawsTest, AreTheSameInAnyCompany) {
  const Throw alone = thrown(7, "a", 5, 12);
  for (int lane = 0; lane < kLanes; ++lane) EXPECT_EQ(thrown(7, "a", 5, 12, lane), alone) << lane;
  // Among others, after other steps, and when another particle had the lane before.
  Controller crowd = make(7, "a");
  for (int lane = 0; lane < kLanes; ++lane) crowd.start(lane, 0, 100u + static_cast<unsigned>(lane));
  for (std::uint32_t step = 0; step < 5; ++step) act(crowd, 3, step, LaneMask::first(kLanes));
  crowd.start(3, 0, 5);
  EXPECT_EQ(act(crowd, 3, 12, LaneMask::first(kLanes)), alone);
}

TEST_F(PolicyDrawsTest, DifferByEachOfTheirKeys) {
  std::set<double> all;
  for (const Throw& one : {thrown(7, "a", 5, 12), thrown(8, "a", 5, 12), thrown(7, "b", 5, 12), thrown(7, "a", 6, 12),
                           thrown(7, "a", 5, 13)}) {
    EXPECT_TRUE(all.insert(one.first).second);
    EXPECT_TRUE(all.insert(one.second).second);
  }
  EXPECT_EQ(thrown(7, "a", 5, 12).whole, thrown(7, "a", 5, 13).whole);
  EXPECT_NE(thrown(7, "a", 5, 12).whole, thrown(7, "a", 6, 12).whole);
}

// Steps are counted by time, which is a product of rounded numbers: to the last step that a trace may have.
TEST_F(PolicyDrawsTest, CountStepsExactly) {
  for (const double period : {1e-3, 2e-3, 1.0 / 3, 7e-4}) {
    PolicyDraws draws(1, "p", period);
    for (const std::uint32_t step : {0u, 1u, 3u, 1000u, 999'999u, 123'456'789u, 999'999'999u}) {
      std::array<double, kLanes> time{};
      time[0] = step * period;
      draws.begin_step(time);
      EXPECT_EQ(draws.uniform(0), uniform(1, 0, name_hash("policy.p#0"), step)) << period << " " << step;
    }
  }
}

}  // namespace
}  // namespace graze
