#include "analysis/report_sample.h"

#include <algorithm>
#include <cmath>

#include "sampling/constants.h"

namespace graze {
namespace {

SampledTraces empty_traces(const std::string& policy, std::size_t particles, std::size_t requirements) {
  SampledTraces out;
  out.policy = policy;
  out.outcome.assign(particles, '.');
  out.violated.assign(particles, -1);
  out.end.assign(particles, kNaN);
  out.objective.assign(particles, kNaN);
  out.margins.assign(requirements, std::vector<double>(particles, kNaN));
  return out;
}

void read_traces(const Archive& archive, const ReportSample& sample, SampledTraces& out) {
  const auto inside = [&](std::uint32_t particle, Outcome) {
    return particle >= sample.first && particle - sample.first < sample.count;
  };
  const auto take = [&](const TraceRows& rows) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::size_t at = rows.particle(i) - sample.first;
      out.outcome[at] = "SKUI"[static_cast<std::size_t>(rows.outcome(i))];
      out.violated[at] = rows.violated(i);
      out.end[at] = rows.end_time(i);
      out.objective[at] = rows.objective_margin(i);
      for (std::size_t k = 0; k < out.margins.size(); ++k) out.margins[k][at] = rows.margins(i)[k];
    }
  };
  archive.scan(out.policy, kEndTime | kObjectiveMargin | kMargins, take, inside);
}

/// 1 / standard deviation of what is finite; 0: all are the same.
double precision_of(const std::vector<double>& values) {
  double sum = 0, squares = 0;
  std::size_t n = 0;
  for (const double x : values) {
    if (!std::isfinite(x)) continue;
    sum += x;
    ++n;
  }
  if (n < 2) return 0;
  for (const double x : values) {
    if (std::isfinite(x)) squares += (x - sum / n) * (x - sum / n);
  }
  return squares > 0 ? 1 / std::sqrt(squares / (n - 1)) : 0;
}

}  // namespace

std::uint64_t particles_of_traces(std::uint64_t most, std::size_t policies) {
  return std::max<std::uint64_t>(most / std::max<std::size_t>(policies, 1), 100);
}

ReportSample sample_traces(const Archive& archive, const std::vector<std::string>& policies, std::uint64_t most) {
  const CampaignInfo& info = archive.info();
  ReportSample out;
  out.first = static_cast<std::uint32_t>(info.part.begin);
  const std::uint64_t each = particles_of_traces(most, policies.size());
  out.count = static_cast<std::uint32_t>(std::min(info.part.count(info.particles), each));
  for (const std::string& policy : policies) {
    out.policies.push_back(empty_traces(policy, out.count, info.requirements.size()));
    read_traces(archive, out, out.policies.back());
  }
  if (!info.store_values) return out;
  out.values.assign(info.parameters.size(), std::vector<double>(out.count, kNaN));
  archive.scan_values([&](std::uint32_t particle, std::span<const double> values) {
    if (particle < out.first || particle - out.first >= out.count) return;
    for (std::size_t k = 0; k < values.size(); ++k) out.values[k][particle - out.first] = values[k];
  });
  return out;
}

std::int64_t nominal_success(const ReportSample& sample, const SampledTraces& traces, const CampaignInfo& info) {
  std::vector<double> distance(sample.count, 0);
  for (std::size_t k = 0; k < sample.values.size(); ++k) {
    if (!info.parameters[k].labels.empty()) continue;
    const double precision = precision_of(sample.values[k]);
    for (std::size_t i = 0; i < sample.count; ++i) {
      const double z = (sample.values[k][i] - info.parameters[k].nominal) * precision;
      if (std::isfinite(z)) distance[i] += z * z;
    }
  }
  std::int64_t best = -1;
  for (std::size_t i = 0; i < sample.count; ++i) {
    if (traces.outcome[i] != 'S') continue;
    if (best < 0 || distance[i] < distance[static_cast<std::size_t>(best)]) best = static_cast<std::int64_t>(i);
  }
  return best < 0 ? -1 : best + sample.first;
}

}  // namespace graze
