// Claim: two independent back ends, the lane engine and Bullet, tell the same of the curb campaign within what chance
// allows. (docs/results.md has it for more particles and all policies.)
#include <gtest/gtest.h>

#include <cmath>

#include "analysis/proportions.h"
#include "tests/jobs/program.h"
#include "tests/jobs/traces.h"

namespace graze {
namespace {

struct Count {
  std::uint64_t met = 0, invalid = 0, traces = 0;
};

/// How many particles of one policy have met the objective, whatever they have touched.
Count crossings(const std::string& physics, const std::string& models, const std::string& policy,
                std::uint64_t particles) {
  ScenarioOptions options;
  options.overrides = {{"physics", physics}, {"uncertain.contact.model.choice", models}};
  Scenario scenario = load_scenario(testing::data("scenarios/quadruped_curb.yaml"), options);
  std::erase_if(scenario.policies, [&](const PolicySpec& one) { return one.name != policy; });
  EXPECT_EQ(scenario.policies.size(), 1u);
  Count out;
  for (const auto& [key, trace] : testing::simulate(scenario, particles, 21, 0)) {
    ++out.traces;
    out.met += trace.objective_margin >= 0;
    out.invalid += trace.outcome == Outcome::invalid;
  }
  return out;
}

/// Newcombe's interval for the difference of two independent rates, from Wilson's of each (1998, method 10).
Interval difference(const Count& a, const Count& b, double confidence) {
  const double p = static_cast<double>(a.met) / static_cast<double>(a.traces);
  const double q = static_cast<double>(b.met) / static_cast<double>(b.traces);
  const Interval A = wilson(a.met, a.traces, confidence), B = wilson(b.met, b.traces, confidence);
  return {p - q - std::hypot(p - A.low, B.high - q), p - q + std::hypot(A.high - p, q - B.low)};
}

TEST(BackEnds, AgreeOnWhoCrossesTheCurb) {
  for (const char* policy : {"step/3cm", "step/4cm"}) {
    const Count lanes = crossings("lanes", "[complementarity, complementarity_free]", policy, 96);
    const Count bullet = crossings("bullet", "[sequential_impulse, dantzig, projected_gauss_seidel]", policy, 32);
    EXPECT_EQ(lanes.invalid, 0u);
    EXPECT_LE(bullet.invalid, 1u);
    const Interval apart = difference(lanes, bullet, 0.99);
    EXPECT_LE(apart.low, 0) << policy << ": " << lanes.met << "/96 on lanes, " << bullet.met << "/32 on Bullet";
    EXPECT_GE(apart.high, 0) << policy << ": " << lanes.met << "/96 on lanes, " << bullet.met << "/32 on Bullet";
  }
}

}  // namespace
}  // namespace graze
