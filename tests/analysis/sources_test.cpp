// Sources of uncertainty: whose a parameter is, and how far apart they drive traces.
#include "analysis/sources.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "scenarios/scenario.h"

namespace graze {
namespace {

// Claim: every kind of path has the source that docs/sweep.md says.
TEST(Sources, OfPaths) {
  const std::vector<std::pair<const char*, const char*>> cases = {{"robot.link.LF_SHIN.length", "fabrication"},
                                                                  {"robot.joint.LF_X_1.friction", "fabrication"},
                                                                  {"robot.joint.LF_X_1.zero", "fabrication"},
                                                                  {"robot.link.LF_FOOT.friction", "contact"},
                                                                  {"environment.curb.position.x", "environment"},
                                                                  {"environment.curb.friction", "contact"},
                                                                  {"environment.curb.damping", "contact"},
                                                                  {"contact.model", "contact"},
                                                                  {"initial.joint.LF_X_1.velocity", "initial state"},
                                                                  {"actuator.torque.LF_X_1", "actuation"},
                                                                  {"sensor.encoder.LF_X_1.position", "sensing"},
                                                                  {"sensor.estimate.rate.yaw", "state estimate"},
                                                                  {"control.lag", "lag"},
                                                                  {"gravity.z", "environment"},
                                                                  {"disturbances.shove.at", "disturbances"}};
  for (const auto& [path, source] : cases) EXPECT_EQ(source_of(path), source) << path;
}

// Claim: alone a source draws what it draws with all; correlations among its own parameters stay.
TEST(Sources, DrawTheSameAlone) {
  const Scenario scenario = load_scenario(GRAZE_SOURCE_DIR "/data/scenarios/quadruped_sources.yaml");
  const ParameterSpace part = space_of_source(scenario.space, "fabrication");
  const Sampler all(scenario.space, Design::random, 7, 1), alone(part, Design::random, 7, 1);
  const std::vector<double> a = all.draw(3), b = alone.draw(3);
  std::size_t found = 0;
  for (int i = 0; i < scenario.space.size(); ++i) {
    if (source_of(scenario.space.parameters[i].name) != "fabrication") continue;
    EXPECT_EQ(a[i], b.at(found++));
  }
  EXPECT_EQ(found, b.size());
  EXPECT_GT(found, 60u);
  EXPECT_EQ(space_of_source(scenario.space, "none").size(), 0);

  ParameterSpace space;
  for (const char* name : {"contact.friction", "control.lag", "contact.restitution"}) {
    space.parameters.push_back({name, "1", 0, Distribution::uniform(0, 1), {}, {}, ""});
  }
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(3, 3);
  correlation(0, 2) = correlation(2, 0) = 0.5;
  space.groups.push_back({{0, 1, 2}, correlation});
  const ParameterSpace contact = space_of_source(space, "contact");
  ASSERT_EQ(contact.groups.size(), 1u);
  EXPECT_EQ(contact.groups[0].members, (std::vector<int>{0, 1}));
  EXPECT_EQ(contact.groups[0].correlation(0, 1), 0.5);
  EXPECT_TRUE(space_of_source(space, "lag").groups.empty());

  // What every particle has is no source, and goes with each.
  space.parameters.push_back({"robot.joint.KNEE.damping", "N m s/rad", 0, Distribution::constant(0.3), {}, {}, ""});
  EXPECT_FALSE(is_uncertain(space.parameters.back()));
  EXPECT_EQ(space_of_source(space, "contact").size(), 3);
  EXPECT_EQ(space_of_source(space, "none").parameters.at(0).name, "robot.joint.KNEE.damping");
  space.parameters.back().jitter = Distribution::uniform(0, 1);
  EXPECT_EQ(space_of_source(space, "none").size(), 0);
}

// Claim: spreads are root mean squares over the traces that lasted; headings go round; the same traces have none.
TEST(Sources, MeasureSpreads) {
  const auto trace = [](double x, double y, double yaw, double joint) {
    return SourceTrace{Outcome::success, 1, true, {std::cos(yaw / 2), 0, 0, std::sin(yaw / 2), x, y, 0, joint}};
  };
  const double pi = std::acos(-1.0);
  SourceSpread out;
  std::vector<SourceTrace> traces = {trace(1, 2, pi - 0.1, 0.3), trace(1, 4, -pi + 0.1, 0.5)};
  traces.push_back({Outcome::known_failure, 0.4, false, traces[0].q});
  traces.push_back({Outcome::invalid, 0.1, false, {}});
  summarise_source(traces, {0, {7}}, out);
  EXPECT_EQ(out.valid(), 3u);
  EXPECT_EQ(out.lasted, 2u);
  EXPECT_NEAR(out.place, 1, 1e-12);
  EXPECT_NEAR(out.heading, 0.1, 1e-12);
  EXPECT_NEAR(out.joints, 0.1, 1e-12);
  EXPECT_EQ(out.failed, 1u);
  EXPECT_DOUBLE_EQ(out.failure_time[1], 0.4);
  summarise_source({trace(0.1, 0.7, 0.3, 0.2), trace(0.1, 0.7, 0.3, 0.2), trace(0.1, 0.7, 0.3, 0.2)}, {0, {7}}, out);
  EXPECT_EQ(out.place, 0);
  EXPECT_EQ(out.joints, 0);
}

}  // namespace
}  // namespace graze
