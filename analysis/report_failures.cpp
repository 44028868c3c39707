#include "analysis/report_failures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "analysis/failure_table.h"
#include "analysis/failures.h"

namespace graze {
namespace {

using FailureRows = std::vector<FailureTable::Row>;

/// NaN is later, or better, than any number; equal ones are told apart by the particle.
template <double FailureTable::Row::*member>
bool less(const FailureTable::Row& a, const FailureTable::Row& b) {
  const auto key = [](const FailureTable::Row& row) {
    const double x = row.*member;
    return std::tuple(std::isnan(x), std::isnan(x) ? 0 : x, row.particle);
  };
  return key(a) < key(b);
}

FailureWay way_of(const FailureTable& table, FailureRows& rows, const std::string& policy, const CampaignInfo& info) {
  const auto earliest = std::min_element(rows.begin(), rows.end(), less<&FailureTable::Row::time>);
  FailureWay out;
  out.earliest = earliest->time;
  out.earliest_particle = earliest->particle;
  std::sort(rows.begin(), rows.end(), less<&FailureTable::Row::margin>);
  const Failure words = describe_failure(table, rows.front(), policy, info);
  out.policy = policy;
  out.outcome = words.outcome;
  out.what = words.what;
  out.culprit = words.culprit;
  out.unit = words.unit;
  out.traces = rows.size();
  out.worst = rows.front().margin;
  out.worst_particle = rows.front().particle;
  out.typical_particle = rows[(rows.size() - 1) / 2].particle;
  return out;
}

/// What is worth a look under one policy, the most telling first.
std::vector<ChosenTrace> telling(const std::vector<FailureWay>& ways, const ReportSample& sample,
                                 const SampledTraces& traces, const CampaignInfo& info) {
  std::vector<ChosenTrace> out;
  const auto add = [&](std::uint32_t particle, const std::string& why) {
    out.push_back({traces.policy, particle, why});
  };
  const std::int64_t success = nominal_success(sample, traces, info);
  if (success >= 0) add(static_cast<std::uint32_t>(success), "success nearest to the nominal robot");
  const FailureWay* first = nullptr;  // to be violated
  for (const FailureWay& way : ways) {
    if (way.policy != traces.policy || way.outcome == Outcome::invalid) continue;
    add(way.typical_particle, fmt::format("typical of {} that failed alike: {}", way.traces, way.what));
    const bool known = way.outcome == Outcome::known_failure;
    if (known && (first == nullptr || way.earliest < first->earliest)) first = &way;
  }
  if (first != nullptr) add(first->earliest_particle, "earliest violation");
  for (std::uint32_t i = 0; i < sample.count; ++i) {
    if (traces.outcome[i] != '.' && traces.outcome[i] != 'I') add(sample.first + i, "one of the first particles");
  }
  return out;
}

}  // namespace

std::vector<FailureWay> failure_ways(const Archive& archive, const std::vector<std::string>& policies) {
  std::vector<FailureWay> out;
  for (const std::string& policy : policies) {
    const FailureTable table = failures_of(archive, policy);
    std::map<std::tuple<Outcome, int, std::uint32_t, int, int>, FailureRows> alike;
    for (const FailureTable::Row& row : table.rows) {
      const bool invalid = row.outcome == Outcome::invalid;
      alike[{row.outcome, row.violated, invalid ? row.reason : 0, invalid ? -1 : row.culprit.leaf,
             invalid ? -1 : row.culprit.part}]
          .push_back(row);
    }
    const auto begin = static_cast<std::ptrdiff_t>(out.size());
    for (auto& [key, rows] : alike) out.push_back(way_of(table, rows, policy, archive.info()));
    std::stable_sort(out.begin() + begin, out.end(),
                     [](const FailureWay& a, const FailureWay& b) { return a.traces > b.traces; });
  }
  return out;
}

std::vector<ChosenTrace> choose_traces(const std::vector<FailureWay>& ways, const ReportSample& sample,
                                       const CampaignInfo& info, std::size_t most) {
  std::vector<std::vector<ChosenTrace>> lists;
  std::size_t longest = 0;
  for (const SampledTraces& traces : sample.policies) {
    lists.emplace_back();
    std::set<std::uint32_t> seen;
    for (ChosenTrace& one : telling(ways, sample, traces, info)) {
      if (seen.insert(one.particle).second) lists.back().push_back(std::move(one));
    }
    longest = std::max(longest, lists.back().size());
  }
  std::vector<ChosenTrace> out;
  for (std::size_t rank = 0; rank < longest; ++rank) {
    for (const std::vector<ChosenTrace>& list : lists) {
      if (out.size() == most) return out;
      if (rank < list.size()) out.push_back(list[rank]);
    }
  }
  return out;
}

}  // namespace graze
