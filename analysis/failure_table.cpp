#include "analysis/failure_table.h"

#include <algorithm>
#include <limits>
#include <map>

namespace graze {
namespace {

class FailureCollector {
 public:
  void add(const TraceRows& traces, std::size_t i) {
    FailureTable::Row& row = out_.rows.emplace_back();
    row.particle = traces.particle(i);
    row.outcome = traces.outcome(i);
    row.violated = traces.violated(i);
    const bool known = row.outcome == Outcome::known_failure, invalid = row.outcome == Outcome::invalid;
    const auto violated = static_cast<std::size_t>(std::max(0, row.violated));
    row.time = known ? traces.first_violations(i)[violated] : traces.end_time(i);
    row.margin = known ? traces.margins(i)[violated] : traces.objective_margin(i);
    if (!invalid) row.culprit = traces.culprit(i);
    row.unconverged = traces.has_solver() ? traces.solver(i).unconverged_share() : kUnknown;
    if (invalid) row.reason = number_of(traces.invalid_reason(i));
  }

  FailureTable take() {
    const auto before = [](const FailureTable::Row& a, const FailureTable::Row& b) { return a.particle < b.particle; };
    std::sort(out_.rows.begin(), out_.rows.end(), before);
    return std::move(out_);
  }

 private:
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  std::uint32_t number_of(const std::string& reason) {
    const auto [at, fresh] = numbers_.emplace(reason, static_cast<std::uint32_t>(out_.reasons.size()));
    if (fresh) out_.reasons.push_back(reason);
    return at->second;
  }

  std::map<std::string, std::uint32_t> numbers_;  // of out_.reasons
  FailureTable out_;
};

constexpr unsigned kColumns =
    kEndTime | kObjectiveMargin | kMargins | kFirstViolations | kCulprits | kSolver | kInvalidReason;

}  // namespace

FailureTable failures_of(const Archive& archive, const std::string& policy,
                         const std::function<bool(std::uint32_t)>& wanted) {
  FailureCollector failures;
  const auto take = [&](const TraceRows& traces) {
    for (std::size_t i = 0; i < traces.size(); ++i) failures.add(traces, i);
  };
  archive.scan(policy, kColumns, take, [&](std::uint32_t particle, Outcome outcome) {
    return outcome != Outcome::success && (!wanted || wanted(particle));
  });
  return failures.take();
}

FailureTable flagged_traces_of(const Archive& archive, const std::string& policy,
                               const std::function<bool(std::uint32_t)>& wanted) {
  FailureCollector flagged;
  const auto take = [&](const TraceRows& traces) {
    for (std::size_t i = 0; traces.has_solver() && i < traces.size(); ++i) {
      if (traces.solver(i).flagged(archive.info().unconverged)) flagged.add(traces, i);
    }
  };
  archive.scan(policy, kColumns, take, [&](std::uint32_t particle, Outcome) { return !wanted || wanted(particle); });
  return flagged.take();
}

}  // namespace graze
