#pragma once
// Tasks: requirements and objectives from witnesses (§5.1.2, Eq. 20). A witness is a real function of state, contact
// and input, >= 0 while all is well; its minimum over its window is the margin.

#include <array>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "engine/physics.h"
#include "engine/settings/settings.h"

namespace graze {

/// What a witness may look at: one lane after one step.
struct WitnessInput {
  const Model& model;  // the particle's own p*
  const BlockState& state;
  const std::vector<Contact>& contacts;
  const BlockArray& tau;       // applied torques, [na]
  const BlockArray& headroom;  // Actuators::headroom, [na]
  int lane;
  double time;
};

class Witness {
 public:
  virtual ~Witness() = default;
  virtual double evaluate(const WitnessInput& input) const = 0;
};

/// When a witness counts.
struct Window {
  double from = 0;                                      // s
  double to = std::numeric_limits<double>::infinity();  // s
  bool contains(double t) const { return t >= from && t <= to; }
};

struct Requirement {
  std::string name;
  std::string description;  // one line for tables
  std::string unit;         // of the margin
  Window window;
  std::shared_ptr<const Witness> witness;
};

/// A predicate on the trace: a leaf is a witness that must be >= 0 at the end, always within a window, or at some time
/// within it; inner nodes are all, any, not. The margin of `all` is the least, of `any` the greatest, of `not` the
/// negative of its part's.
struct Objective {
  enum class Kind { all, any, negation, at_end, always, once };
  Kind kind = Kind::at_end;
  std::string name;
  Window window;
  std::shared_ptr<const Witness> witness;  // leaves
  std::vector<Objective> parts;            // inner nodes
};

struct Task {
  std::vector<Requirement> requirements;
  Objective objective;
  bool stop_at_violation = true;  // a trace ends at its first violated requirement
};

/// Reads `requirements` (map name -> witness) and `objective` (map with one name -> predicate, or the predicate
/// itself). Names are checked against the model: a pattern that matches nothing is refused with the nearest name.
Task read_task(const Settings& settings, const Model& nominal);

/// Names of all witnesses ("tilt", "height", "no_contact", …), for help and the schema.
std::vector<std::string> witness_names();

/// Judges the traces of one block.
class TaskMonitor {
 public:
  explicit TaskMonitor(const Task& task);
  void start(int lane);
  /// After each step (and once at t = 0). Returns true if a requirement is violated now or was before.
  bool update(const WitnessInput& input);
  /// At the end of a trace (its last update has been made).
  double objective_margin(int lane) const;
  bool objective_met(int lane) const { return objective_margin(lane) >= 0; }
  /// Per requirement: least witness within the window (+inf if never looked at), and the first time below 0 (NaN if
  /// none).
  const std::vector<double>& margins(int lane) const { return margin_[lane]; }
  const std::vector<double>& first_violations(int lane) const { return violation_[lane]; }
  /// Index of the requirement that was violated first (lowest index within a step), or -1.
  int violated(int lane) const { return violated_[lane]; }

 private:
  const Task* task_;
  std::vector<const Objective*> leaves_;
  std::array<std::vector<double>, kLanes> margin_, violation_, leaf_;
  std::array<int, kLanes> violated_{};
};

}  // namespace graze
