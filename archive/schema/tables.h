#pragma once
// What is read of the traces of one policy.

#include <cstdint>
#include <string>
#include <vector>

#include "simulation/trace.h"

namespace graze {

/// Columns of the traces of one policy, in order of particle id.
struct TraceTable {
  std::string policy;
  std::vector<std::uint32_t> particle;
  std::vector<Outcome> outcome;
  std::vector<int> violated;
  std::vector<double> end_time, objective_margin;
  std::vector<SolverLog> solver;                               // empty: the archive is older than that
  std::vector<std::vector<double>> margins, first_violations;  // [requirement][trace]
  std::vector<std::uint64_t> digest;
  std::vector<std::string> sequence, invalid_reason;
  std::size_t size() const { return particle.size(); }
};

/// How the traces of one policy ended, in order of particle id.
struct OutcomeTable {
  std::vector<std::uint32_t> particle;
  std::vector<Outcome> outcome;
};

/// The failed traces of one policy (known, unknown and invalid), in order of particle id.
struct FailureTable {
  struct Row {
    std::uint32_t particle = 0;
    Outcome outcome = Outcome::invalid;
    int violated = -1;         // requirement index, known failures only
    std::uint32_t reason = 0;  // index into `reasons`, invalid traces only
    double time = 0;           // s: of the violation, else of the end
    double margin = 0;         // of the violated requirement, else of the objective
    Culprit culprit = {};      // at the first violation, else of the objective
  };
  std::vector<Row> rows;
  std::vector<std::string> reasons;
};

/// What counts of one trace.
struct TraceOutcome {
  std::uint32_t particle;
  Outcome outcome;
  int violated;  // requirement index; -1: none
  double objective_margin;
  bool cut = false;             // it ended before its time, by a violation
  std::uint64_t kept = 0;       // bit k: the k-th measure was kept (kept_by)
  std::uint64_t undecided = 0;  // bit k: whether it was, nobody knows
  Culprit culprit = {};         // of a failure: at the first violation, else of the objective
};

}  // namespace graze
