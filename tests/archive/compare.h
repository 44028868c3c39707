#pragma once
// Bit-for-bit comparison of what was written with what an archive gives back.

#include <gtest/gtest.h>

#include <bit>
#include <fstream>
#include <iterator>

#include "tests/archive/synthetic.h"
#include "tests/archive/tables.h"

namespace graze::synthetic {

/// The bits of a number: NaN equals itself.
inline std::uint64_t bits(double x) { return std::bit_cast<std::uint64_t>(x); }

inline void expect_same(const std::vector<double>& a, const std::vector<double>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(bits(a[i]), bits(b[i])) << "at " << i;
}

inline void expect_same(const Event& a, const Event& b) {
  EXPECT_EQ(bits(a.time), bits(b.time));
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.a, b.a);
  EXPECT_EQ(a.b, b.b);
  EXPECT_EQ(a.feature_a, b.feature_a);
  EXPECT_EQ(a.feature_b, b.feature_b);
  EXPECT_EQ(bits(a.impulse), bits(b.impulse));
  EXPECT_EQ(a.p_W, b.p_W);
}

inline void expect_same_phase(const ContactPhase& a, const ContactPhase& b) {
  expect_same({a.begin, a.end, a.peak, a.impulse, a.slip, a.roll}, {b.begin, b.end, b.peak, b.impulse, b.slip, b.roll});
  EXPECT_EQ(a.a, b.a);
  EXPECT_EQ(a.b, b.b);
  EXPECT_EQ(a.feature_a, b.feature_a);
  EXPECT_EQ(a.feature_b, b.feature_b);
}

inline void expect_row(const TraceTable& table, std::size_t i, const TraceRecord& want) {
  SCOPED_TRACE(table.policy + ", particle " + std::to_string(want.particle));
  EXPECT_EQ(table.particle[i], want.particle);
  EXPECT_EQ(table.outcome[i], want.outcome);
  EXPECT_EQ(table.violated[i], want.violated);
  EXPECT_EQ(bits(table.end_time[i]), bits(want.end_time));
  EXPECT_EQ(bits(table.objective_margin[i]), bits(want.objective_margin));
  EXPECT_EQ(bits(table.solver.at(i).mean_sweeps), bits(want.solver.mean_sweeps));
  EXPECT_EQ(bits(table.solver.at(i).most_sweeps), bits(want.solver.most_sweeps));
  EXPECT_EQ(bits(table.solver.at(i).largest_residual), bits(want.solver.largest_residual));
  EXPECT_EQ(bits(table.solver.at(i).unconverged_steps), bits(want.solver.unconverged_steps));
  EXPECT_EQ(bits(table.solver.at(i).steps), bits(want.solver.steps));
  EXPECT_EQ(bits(table.solver.at(i).median_residual), bits(want.solver.median_residual));
  EXPECT_EQ(bits(table.solver.at(i).braked_steps), bits(want.solver.braked_steps));
  EXPECT_EQ(bits(table.solver.at(i).most_braked), bits(want.solver.most_braked));
  EXPECT_EQ(table.margin_parts.at(i), want.margin_parts);
  EXPECT_EQ(table.digest[i], want.digest);
  EXPECT_EQ(table.sequence[i], want.sequence);
  EXPECT_EQ(table.invalid_reason[i], want.invalid_reason);
  for (std::size_t r = 0; r < want.margins.size(); ++r) {
    EXPECT_EQ(bits(table.margins[r][i]), bits(want.margins[r]));
    EXPECT_EQ(bits(table.first_violations[r][i]), bits(want.first_violations[r]));
  }
}

/// One trace read by itself; it comes without telemetry and contact sequence.
inline void expect_trace(const Archive& archive, const std::string& policy, const TraceRecord& want) {
  const std::optional<TraceRecord> got = archive.trace(policy, want.particle);
  ASSERT_TRUE(got);
  EXPECT_EQ(got->particle, want.particle);
  EXPECT_EQ(got->outcome, want.outcome);
  EXPECT_EQ(got->violated, want.violated);
  EXPECT_EQ(got->digest, want.digest);
  if (want.outcome == Outcome::invalid) {
    EXPECT_EQ(got->invalid_reason, want.invalid_reason);
  }
  expect_same(std::vector{got->end_time, got->objective_margin}, std::vector{want.end_time, want.objective_margin});
  expect_same(got->margins, want.margins);
  expect_same(got->first_violations, want.first_violations);
  EXPECT_EQ(got->margin_parts, want.margin_parts);
  EXPECT_EQ(got->violation_parts, want.violation_parts);
  EXPECT_EQ(got->objective_culprit.leaf, want.objective_culprit.leaf);
  EXPECT_EQ(got->objective_culprit.part, want.objective_culprit.part);
  expect_same(got->q, want.q);
  expect_same(got->v, want.v);
  ASSERT_EQ(got->events.size(), want.events.size());
  for (std::size_t k = 0; k < want.events.size(); ++k) expect_same(got->events[k], want.events[k]);
  ASSERT_EQ(got->phases.size(), want.phases.size());
  for (std::size_t k = 0; k < want.phases.size(); ++k) expect_same_phase(got->phases[k], want.phases[k]);
}

/// Everything about particles 0 … count - 1 of one policy.
inline void expect_policy(const Archive& archive, int policy, std::uint32_t count) {
  const CampaignInfo& info = archive.info();
  const std::string& name = info.policies[policy];
  const TraceTable table = table_of(archive, name);
  const auto events = events_of(archive, name);
  ASSERT_EQ(table.size(), count);
  ASSERT_EQ(events.size(), count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const TraceRecord want = trace(info, policy, i);
    expect_row(table, i, want);
    ASSERT_EQ(events[i].size(), want.events.size());
    for (std::size_t k = 0; k < want.events.size(); ++k) expect_same(events[i][k], want.events[k]);
    const auto frames = archive.telemetry(name, i);
    ASSERT_EQ(frames.size(), want.telemetry.size());
    for (std::size_t k = 0; k < frames.size(); ++k) {
      EXPECT_EQ(bits(frames[k].time), bits(want.telemetry[k].time));
      expect_same(frames[k].q, want.telemetry[k].q);
      expect_same(frames[k].v, want.telemetry[k].v);
      expect_same(frames[k].tau, want.telemetry[k].tau);
    }
    expect_same(archive.particle_values(i), values(info, i));
    expect_trace(archive, name, want);
  }
  EXPECT_FALSE(archive.trace(name, count));
}

inline void expect_campaign(const Archive& archive) {
  for (int policy = 0; policy < static_cast<int>(archive.info().policies.size()); ++policy) {
    expect_policy(archive, policy, static_cast<std::uint32_t>(archive.info().particles));
  }
}

inline std::string content(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void put(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// The message of an exception of type E; fails if there is none.
template <class E, class Act>
std::string message_of(const Act& act) {
  try {
    act();
  } catch (const E& error) {
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

}  // namespace graze::synthetic
