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

/// What the contact solver did over a trace; mean_sweeps 0: the back end does not tell. A step's *last change* is the
/// largest change of a constraint's velocity in its last sweep, m/s or rad/s: how far it is from converged.
struct SolverLog {
  double mean_sweeps = 0, most_sweeps = 0;  // per step
  double largest_residual = 0;              // the largest last change of a step
  double unconverged_steps = 0;             // whose last change is above the solver's tolerance
  double steps = 0;                         // of the physics, in which the solver told
  double median_residual = 0;               // last change of the steps that did not converge, to 7 % (ChangeCounts)
  double braked_steps = 0;                  // in which the brake has changed a velocity by more than kBraked
  double most_braked = 0;                   // the largest change that it has made to one, m/s or rad/s

  bool tells() const { return mean_sweeps > 0; }
  double unconverged_share() const { return unconverged_steps / steps; }  // of the steps; NaN: there are none
  /// Whether more than this share of the steps did not converge.
  bool flagged(double limit) const { return unconverged_share() > limit; }
};

/// Calls act(name, value, unit) for what files tell of a trace's solver; nothing if the back end does not tell.
template <class Do>
void each_solver_fact(const SolverLog& log, double limit, const Do& act) {
  if (!log.tells()) return;
  act("solver_steps", log.steps, "");
  act("unconverged_steps", log.unconverged_steps, "");
  act("median_change", log.median_residual, "m/s");
  act("largest_change", log.largest_residual, "m/s");
  act("braked_steps", log.braked_steps, "");
  act("most_braked", log.most_braked, "m/s");
  act("flagged", log.flagged(limit) ? 1.0 : 0.0, "");
}

/// The brake (engine/contact/brake.h) takes a little where a solve has converged to its tolerance of 1e-6 m/s only.
/// What it takes beyond a hundred times as much is counted, m/s: our choice.
inline constexpr double kBraked = 1e-4;

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
