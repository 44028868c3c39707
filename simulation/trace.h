#pragma once
// What is kept of one trace, as it comes from the runner and as it goes into the archive.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/contact_record.h"
#include "scenarios/judgement.h"

namespace graze {

/// Exactly one per trace (§3.6): S, K, U; `invalid` is reported apart and never counted in a rate.
enum class Outcome : std::uint8_t { success = 0, known_failure = 1, unknown_failure = 2, invalid = 3 };
std::string_view outcome_name(Outcome outcome);  // "success", "known failure", …

/// What the contact solver did over a trace; mean_sweeps 0: the back end does not tell.
struct SolverLog {
  double mean_sweeps = 0, most_sweeps = 0;  // per step
  double largest_residual = 0;              // m/s or rad/s, in the last sweep of a step
  double capped_steps = 0;                  // steps that ended at the bound on sweeps
};

struct TelemetryFrame {
  double time;
  std::vector<double> q, v, tau;  // nq, nv, na
};

/// Frames of one trace, in flat columns: frame i is row i of each, of nq, nv and na values.
class FrameLog {
 public:
  std::size_t size() const { return time_.size(); }
  bool empty() const { return time_.empty(); }
  void reserve(std::size_t frames, std::size_t nq, std::size_t nv, std::size_t na);
  /// Keeps its memory.
  void clear();
  /// Overwrites a frame that is there.
  void set(std::size_t i, double time, std::span<const double> q, std::span<const double> v,
           std::span<const double> tau);
  /// Every frame has as many values as the first.
  void add(double time, std::span<const double> q, std::span<const double> v, std::span<const double> tau);
  void add(const TelemetryFrame& frame) { add(frame.time, frame.q, frame.v, frame.tau); }
  TelemetryFrame operator[](std::size_t i) const;

  const std::vector<double>& time() const { return time_; }
  const std::vector<double>& q() const { return q_; }
  const std::vector<double>& v() const { return v_; }
  const std::vector<double>& tau() const { return tau_; }

 private:
  std::vector<double> time_, q_, v_, tau_;
};

struct TraceRecord {
  std::uint32_t particle = 0;
  Outcome outcome = Outcome::invalid;
  int violated = -1;    // requirement index, known failures only
  double end_time = 0;  // s
  double objective_margin = 0;
  std::vector<double> margins;           // per requirement
  std::vector<double> first_violations;  // per requirement, s; NaN: none
  std::vector<int> margin_parts;         // per requirement, of the margin (PartKind says of what); kNoPart: none.
  std::vector<int> violation_parts;      // per requirement, of the first violation. Both empty: not known
  Culprit objective_culprit;
  std::vector<double> q, v;  // final state
  std::uint64_t digest = 0;  // of q, v and torques of every step: equal digests, equal traces
  std::string sequence;      // of its contact phases, by named parts
  std::string invalid_reason;
  bool stopped = false;  // an observer ended it here, where it was judged; never in campaigns
  SolverLog solver;
  std::vector<Event> events;
  std::vector<ContactPhase> phases;
  FrameLog telemetry;
};

}  // namespace graze
