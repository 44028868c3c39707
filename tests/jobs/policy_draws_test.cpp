// Claim: traces of a policy that draws are the same bits for any number of threads and whatever particles a run has
// (after a restart only some are left, in other lanes and blocks), and differ between particles and policies.
#include <gtest/gtest.h>

#include <map>
#include <mutex>

#include "engine/control/policy.h"
#include "jobs/campaign/campaign.h"
#include "tests/jobs/program.h"

namespace graze::testing {
namespace {

/// Torques that are drawn at every control step.
class Drunk : public Policy {
 public:
  explicit Drunk(const ControlContext& context) : draws_(*context.draws) {}
  void start(int) override {}
  unsigned reads() const override { return 0; }
  void act(const Observation&, LaneMask active, Targets& targets) override {
    for (int k = 0; k < targets.tau.rows(); ++k) {
      for (int lane = 0; lane < kLanes; ++lane) {
        if (active[lane]) targets.tau(k, lane) = draws_.uniform(lane, k) - 0.5;
      }
    }
  }

 private:
  PolicyDraws& draws_;
};

const PolicyRegistration registration("drunk", {"gives the joints random torques", {}},
                                      [](const ControlContext& context, const Described&, TargetKind) {
                                        return std::make_unique<Drunk>(context);
                                      });

using DigestByTrace = std::map<std::pair<int, std::uint32_t>, std::uint64_t>;  // by policy and particle

Scenario drawn_pendulum() {
  const std::string text = R"(graze: 1
robot: {urdf: robots/pendulum.urdf, base: fixed}
time: {end: 60 ms, step: 1 ms, control: 2 ms}
sampling: {particles: 20}
policies:
  a: {drunk: {}, control: {torque: {}}}
  b: {drunk: {}, control: {torque: {}}}
)";
  return parse_scenario(text, data("test.yaml"));
}

DigestByTrace digests(const Scenario& scenario, int threads, std::uint64_t seed, std::uint32_t every = 1) {
  CampaignOptions options;
  options.particles = scenario.particles;
  options.threads = threads;
  options.seed = seed;
  if (every > 1) options.is_finished = [every](const std::string&, std::uint64_t particle) { return particle % every; };
  DigestByTrace out;
  std::mutex mutex;
  const std::unique_ptr<Communicator> comm = make_local_communicator();
  run_campaign(scenario, options, *comm, [&](int policy, const std::vector<TraceRecord>& traces, const auto&) {
    const std::lock_guard lock(mutex);
    for (const TraceRecord& trace : traces) out[{policy, trace.particle}] = trace.digest;
  });
  return out;
}

TEST(PolicyDraws, MakeTheSameTracesInAnyRun) {
  const Scenario scenario = drawn_pendulum();
  const DigestByTrace all = digests(scenario, 1, 3);
  ASSERT_EQ(all.size(), 40u);
  EXPECT_EQ(digests(scenario, 2, 3), all);
  const DigestByTrace left = digests(scenario, 1, 3, 3);
  EXPECT_EQ(left.size(), 14u);
  for (const auto& [key, digest] : left) EXPECT_EQ(digest, all.at(key)) << key.first << " " << key.second;
}

// Nothing else differs between these traces, but that digests begin with the particle's number.
TEST(PolicyDraws, DifferBetweenPoliciesAndSeeds) {
  const Scenario scenario = drawn_pendulum();
  const DigestByTrace one = digests(scenario, 1, 3), other = digests(scenario, 1, 4);
  for (std::uint32_t particle = 0; particle < 20; ++particle) {
    EXPECT_NE(one.at({0, particle}), one.at({1, particle})) << particle;
    EXPECT_NE(one.at({0, particle}), other.at({0, particle})) << particle;
  }
}

}  // namespace
}  // namespace graze::testing
