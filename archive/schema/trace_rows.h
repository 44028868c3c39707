#pragma once
// Some traces of one policy, as a scan (trace_scan.h) passes them on.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "simulation/trace.h"

namespace graze {

/// What a scan reads of each trace besides particle, outcome and violated requirement; a set of these.
enum TraceColumn : unsigned {
  kEndTime = 1u << 0,
  kObjectiveMargin = 1u << 1,
  kMargins = 1u << 2,
  kFirstViolations = 1u << 3,
  kCulprits = 1u << 4,
  kSolver = 1u << 5,
  kFinalState = 1u << 6,
  kDigest = 1u << 7,
  kSequence = 1u << 8,
  kInvalidReason = 1u << 9,
  kEvents = 1u << 10,
  kContactPhases = 1u << 11,  // without what the next adds
  kPhaseShares = 1u << 12,    // peak, slip and roll of contact phases: nearly half of what there is to read
  kMarginParts = 1u << 13,
  kAllColumns = (1u << 14) - 1,
};

/// Rows of which each trace has any number: events, contact phases.
template <class Row>
class FlatRows {
 public:
  std::span<const Row> of(std::size_t trace) const {
    if (offset_.empty()) return {};
    return std::span(rows_).subspan(offset_[trace] - offset_[0], offset_[trace + 1] - offset_[trace]);
  }

 private:
  friend class TraceScan;
  std::vector<std::uint64_t> offset_;  // one more than traces of the piece
  std::vector<Row> rows_;
};

/// Some traces of one policy. What was not asked for must not be looked at. Valid during the call that gets it.
class TraceRows {
 public:
  std::size_t size() const { return rows_.size(); }
  std::uint32_t particle(std::size_t i) const { return particle_[rows_[i]]; }
  Outcome outcome(std::size_t i) const { return static_cast<Outcome>(outcome_[rows_[i]]); }
  int violated(std::size_t i) const { return violated_[rows_[i]]; }                     // requirement; -1: none
  double end_time(std::size_t i) const { return end_time_[rows_[i]]; }                  // s
  double objective_margin(std::size_t i) const { return objective_margin_[rows_[i]]; }  // unit of the objective
  std::span<const double> margins(std::size_t i) const { return row(margins_, i); }     // [requirement]
  std::span<const double> first_violations(std::size_t i) const { return row(violations_, i); }  // [requirement], s
  /// [requirement], -1: none, see PartKind. Empty in older archives.
  std::span<const std::int32_t> margin_parts(std::size_t i) const { return row(margin_parts_, i); }
  Culprit culprit(std::size_t i) const { return culprits_[rows_[i]]; }  // at the first violation, else of the objective
  bool has_solver() const { return !solver_.empty(); }                  // older archives do not
  /// Where the archive is too old to have them, steps are those of the trace, which takes kEndTime, and what comes
  /// after them is NaN.
  SolverLog solver(std::size_t i) const;
  std::span<const double> final_q(std::size_t i) const { return row(final_q_, i); }
  std::span<const double> final_v(std::size_t i) const { return row(final_v_, i); }
  std::uint64_t digest(std::size_t i) const { return digest_[rows_[i]]; }
  const std::string& sequence(std::size_t i) const { return (*sequences_)[sequence_[rows_[i]]]; }
  const std::string& invalid_reason(std::size_t i) const { return (*reasons_)[reason_[rows_[i]]]; }
  std::span<const Event> events(std::size_t i) const { return events_.of(rows_[i]); }
  std::span<const ContactPhase> phases(std::size_t i) const { return phases_.of(rows_[i]); }  // none in older archives

 private:
  friend class TraceScan;
  template <class T>
  std::span<const T> row(const std::vector<T>& data, std::size_t i) const {
    const std::size_t width = data.size() / particle_.size();
    return std::span(data).subspan(rows_[i] * width, width);
  }

  std::vector<std::size_t> rows_;  // of the piece, that count
  std::vector<std::uint32_t> particle_, sequence_, reason_;
  std::vector<std::uint8_t> outcome_;
  std::vector<std::int32_t> violated_, margin_parts_;
  std::vector<double> end_time_, objective_margin_, margins_, violations_, solver_, convergence_, final_q_, final_v_;
  std::vector<Culprit> culprits_;
  std::vector<std::uint64_t> digest_;
  FlatRows<Event> events_;
  FlatRows<ContactPhase> phases_;
  double step_ = 0;                                                          // s, of the physics
  const std::vector<std::string>*sequences_ = nullptr, *reasons_ = nullptr;  // of the part
};

/// Whether a trace is wanted.
using TraceFilter = std::function<bool(std::uint32_t particle, Outcome outcome)>;

}  // namespace graze
