#pragma once
// Campaigns without an archive: all traces, in memory.

#include <gtest/gtest.h>

#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "jobs/campaign/campaign.h"

namespace graze::testing {

/// By policy and particle.
using Traces = std::map<std::pair<std::string, std::uint32_t>, TraceRecord>;

inline Traces simulate(const Scenario& scenario, std::uint64_t particles, std::uint64_t seed, int threads) {
  CampaignOptions options;
  options.particles = particles;
  options.seed = seed;
  options.threads = threads;
  const std::unique_ptr<Communicator> comm = make_local_communicator();
  Traces out;
  std::mutex mutex;
  const CampaignEnd end =
      run_campaign(scenario, options, *comm, [&](int policy, std::vector<TraceRecord> traces, std::vector<double>) {
        const std::lock_guard lock(mutex);
        for (TraceRecord& trace : traces) {
          out.try_emplace({scenario.policies[policy].name, trace.particle}, std::move(trace));
        }
      });
  EXPECT_TRUE(end.complete());
  EXPECT_EQ(out.size(), particles * scenario.policies.size());
  return out;
}

/// What `of` makes of each trace; none is invalid.
template <class Of>
auto valid_traces(const Scenario& scenario, std::uint64_t particles, int threads, const Of& of) {
  std::map<Traces::key_type, decltype(of(std::declval<const TraceRecord&>()))> out;
  for (const auto& [key, trace] : simulate(scenario, particles, 11, threads)) {
    EXPECT_NE(trace.outcome, Outcome::invalid) << trace.invalid_reason;
    out.emplace(key, of(trace));
  }
  return out;
}

}  // namespace graze::testing
