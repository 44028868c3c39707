#pragma once
// All traces of a policy at once, in order of particle id: what tests of small campaigns look at.

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "archive/archive.h"

namespace graze {

struct TraceTable {
  std::string policy;
  std::vector<std::uint32_t> particle;
  std::vector<Outcome> outcome;
  std::vector<int> violated;
  std::vector<double> end_time, objective_margin;
  std::vector<SolverLog> solver;                               // empty: the archive is older than that
  std::vector<std::vector<double>> margins, first_violations;  // [requirement][trace]
  std::vector<std::vector<int>> margin_parts;                  // [trace][requirement]
  std::vector<std::uint64_t> digest;
  std::vector<std::string> sequence, invalid_reason;
  std::vector<std::vector<Event>> events;
  std::vector<std::vector<ContactPhase>> phases;
  std::size_t size() const { return particle.size(); }
};

/// `columns` that are not asked for stay empty.
inline TraceTable table_of(const Archive& archive, const std::string& policy, unsigned columns = kAllColumns) {
  const std::size_t requirements = archive.info().requirements.size();
  TraceTable out;
  out.policy = policy;
  out.margins.resize(requirements);
  out.first_violations.resize(requirements);
  archive.scan(policy, columns, [&](const TraceRows& rows) {
    const auto add = [&](unsigned column, auto& to, const auto& get) {
      for (std::size_t i = 0; (columns & column) != 0 && i < rows.size(); ++i) to.push_back(get(i));
    };
    for (std::size_t i = 0; i < rows.size(); ++i) {
      out.particle.push_back(rows.particle(i));
      out.outcome.push_back(rows.outcome(i));
      out.violated.push_back(rows.violated(i));
    }
    add(kEndTime, out.end_time, [&](std::size_t i) { return rows.end_time(i); });
    add(kObjectiveMargin, out.objective_margin, [&](std::size_t i) { return rows.objective_margin(i); });
    if (rows.has_solver()) add(kSolver, out.solver, [&](std::size_t i) { return rows.solver(i); });
    for (std::size_t k = 0; k < requirements; ++k) {
      add(kMargins, out.margins[k], [&](std::size_t i) { return rows.margins(i)[k]; });
      add(kFirstViolations, out.first_violations[k], [&](std::size_t i) { return rows.first_violations(i)[k]; });
    }
    add(kMarginParts, out.margin_parts,
        [&](std::size_t i) { return std::vector<int>(rows.margin_parts(i).begin(), rows.margin_parts(i).end()); });
    add(kDigest, out.digest, [&](std::size_t i) { return rows.digest(i); });
    add(kSequence, out.sequence, [&](std::size_t i) { return rows.sequence(i); });
    add(kInvalidReason, out.invalid_reason, [&](std::size_t i) { return rows.invalid_reason(i); });
    add(kEvents, out.events,
        [&](std::size_t i) { return std::vector<Event>(rows.events(i).begin(), rows.events(i).end()); });
    add(kContactPhases | kPhaseShares, out.phases,
        [&](std::size_t i) { return std::vector<ContactPhase>(rows.phases(i).begin(), rows.phases(i).end()); });
  });
  std::vector<std::size_t> order(out.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return out.particle[a] < out.particle[b]; });
  const auto sort = [&]<class T>(std::vector<T>& column) {
    if (column.empty()) return;
    std::vector<T> sorted;
    for (const std::size_t i : order) sorted.push_back(std::move(column[i]));
    column = std::move(sorted);
  };
  sort(out.particle), sort(out.outcome), sort(out.violated), sort(out.end_time), sort(out.objective_margin);
  sort(out.solver), sort(out.margin_parts), sort(out.digest), sort(out.sequence), sort(out.invalid_reason),
      sort(out.events), sort(out.phases);
  for (auto& column : out.margins) sort(column);
  for (auto& column : out.first_violations) sort(column);
  return out;
}

/// [trace]
inline std::vector<std::vector<ContactPhase>> phases_of(const Archive& archive, const std::string& policy) {
  return table_of(archive, policy, kContactPhases | kPhaseShares).phases;
}
/// [trace]
inline std::vector<std::vector<Event>> events_of(const Archive& archive, const std::string& policy) {
  return table_of(archive, policy, kEvents).events;
}

}  // namespace graze
