#pragma once
// Tasks: requirements and objectives from witnesses (§5.1.2, Eq. 20). A witness is a real function of state, contact
// and input, >= 0 while all is well; its minimum over its window is the margin.

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "engine/block_physics.h"
#include "engine/clearance/body_moves.h"
#include "engine/lanes/lane_tape.h"
#include "engine/settings/settings.h"
#include "scenarios/judgement.h"

namespace graze {

/// What a witness keeps of the traces of one block from step to step.
class WitnessMemory {
 public:
  virtual ~WitnessMemory() = default;
  /// A fresh trace in a lane, of a particle with this p*.
  virtual void start(int lane, const Model& model) = 0;
  /// Writes down, or reads back after start(), what later values depend on.
  virtual void carry(int lane, LaneTape& tape) = 0;
  /// Those whose moves it looks at (WitnessInput::moves).
  virtual std::vector<int> bodies() const { return {}; }
};

/// What witnesses may look at: a block after a step.
struct WitnessInput {
  const BlockState& state;
  const std::vector<ContactPoint>& points;  // contacts and near points
  const BlockArray& tau;                    // applied torques, [na]
  const BlockArray& headroom;               // Actuators::headroom, [na]
  std::array<double, kLanes> time;          // s
  LaneMask lanes;                           // those whose witnesses are wanted
  WitnessMemory* memory = nullptr;          // of this witness: what remember() gave
  /// [kLanes], or null: where the value is no less than this, any value that is no less will do, and any part.
  const double* enough = nullptr;
  BodyMoves* moves = nullptr;  // of the bodies that memories have named; null: nobody keeps them
};

/// The values that a witness can have at any instant of a trace, and what bounds them, in words for messages.
struct WitnessRange {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  std::string why;
  bool of_nominal = false;  // of the nominal robot; a particle's own bounds lie elsewhere

  bool always_holds() const { return low >= 0; }
  bool never_holds() const { return high < 0; }
};

class Witness {
 public:
  virtual ~Witness() = default;
  /// What evaluate() reports as parts.
  virtual PartKind parts() const { return PartKind::none; }
  /// How many numbers of a particle's own p* the witness needs (limits, places of frames).
  virtual int numbers() const { return 0; }
  /// Writes them into column `lane` of `own`, [numbers()].
  virtual void read(const Model& /*model*/, int /*lane*/, BlockArray& /*own*/) const {}
  /// The witness's value in each lane, out[kLanes], and the part that it is the value of, part[kLanes] (kNoPart: none);
  /// in lanes that are not wanted both may be anything. Parts are doubles, so that one mask selects both.
  virtual void evaluate(const WitnessInput& input, const BlockArray& own, double* out, double* part) const = 0;
  /// A memory for one block, for witnesses that need one.
  virtual std::unique_ptr<WitnessMemory> remember() const { return nullptr; }
  /// Called once after each step, before evaluate(): for witnesses whose memory sums up what has been.
  virtual void follow(const WitnessInput& /*input*/) const {}
};

/// A witness that must stay >= 0; or, as a measure, one that is watched in the same way and decides nothing.
struct Requirement {
  bool measure = false;
  std::string name;
  std::string kind;         // of witness, by its key: "torque_limits"
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
  std::string description, unit;           // of a leaf's witness
  WitnessRange range;                      // of the margin
  std::vector<Objective> parts;            // inner nodes
};

struct Task {
  std::vector<Requirement> requirements;  // measures last
  Objective objective;
  bool stop_at_violation = true;  // a trace ends at its first violated requirement
};

/// The nodes that have a witness, in the order in which TaskMonitor::values returns theirs.
std::vector<const Objective*> leaves(const Objective& objective);

/// Reads `requirements` and `measures` (maps name -> witness; no name in both) and `objective` (map with one name ->
/// predicate, or the predicate itself). Names are checked against the model: a pattern that matches nothing is refused
/// with the nearest name. What can never hold is refused; what always holds, and windows that no trace comes to, are
/// warned of (Warnings).
Task read_task(const Settings& settings, const Model& nominal, const TraceTimes& times = {});

/// Names of all witnesses ("tilt", "height", "no_contact", …), for help and the schema.
std::vector<std::string> witness_names();

/// Judges the traces of one block.
class TaskMonitor {
 public:
  explicit TaskMonitor(const Task& task);
  /// A fresh trace in a lane, of a particle with this p*.
  void start(int lane, const Model& model);
  /// Writes down, or reads back after start(), the judgement so far.
  void carry(int lane, LaneTape& tape);
  /// After each step (and once at t = 0). Returns the lanes in which a requirement (no measure) is violated now or was
  /// before.
  LaneMask update(const WitnessInput& input);
  /// The witnesses of requirements and of the objective's leaves, a row each, whatever their windows say. Has no effect
  /// on the judgement.
  void values(const WitnessInput& input, BlockArray& requirements, BlockArray& objective) const;
  /// At the end of the traces in `input.lanes`, whose last update has been made: judges what counts at the end.
  void finish(const WitnessInput& input);
  /// Of a trace that is finished.
  double objective_margin(int lane) const;
  bool objective_met(int lane) const { return objective_margin(lane) >= 0; }
  /// The leaf whose margin the objective's is (negated within `not`), and the part that gave it.
  Culprit objective_culprit(int lane) const;
  /// Per requirement: least witness within the window (+inf if never looked at), and the first time below 0 (NaN if
  /// none).
  std::vector<double> margins(int lane) const { return column(margin_, lane); }
  std::vector<double> first_violations(int lane) const { return column(violation_, lane); }
  /// Per requirement: the part that gave the margin, and the one that was below 0 at the first violation (kNoPart:
  /// none, or a witness of one part).
  std::vector<int> margin_parts(int lane) const { return parts(margin_part_, lane); }
  std::vector<int> violation_parts(int lane) const { return parts(violation_part_, lane); }
  /// Index of the requirement that was violated first (lowest index within a step), or -1.
  int violated(int lane) const { return violated_[lane]; }

 private:
  /// A witness and the numbers of the lanes' particles that it needs.
  struct Watched {
    const Witness* witness;
    BlockArray own;
    std::unique_ptr<WitnessMemory> memory;
    BodyMoves* moves = nullptr;

    explicit Watched(const Witness& one);
    void start(int lane, const Model& model);
    void follow(WitnessInput input) const;
    /// `enough`: as WitnessInput::enough.
    void evaluate(WitnessInput input, const double* enough, double* out, double* part) const;
  };
  static std::vector<double> column(const BlockArray& array, int lane);
  static std::vector<int> parts(const BlockArray& array, int lane);
  void note_violations(int requirement, unsigned lanes, const WitnessInput& input, const double* part);

  const Task* task_;
  std::vector<const Objective*> leaves_;
  std::vector<Watched> watched_;             // of the requirements
  std::vector<Watched> judging_;             // of the leaves
  std::unique_ptr<BodyMoves> moves_;         // of all bodies that these look at
  BlockArray margin_, violation_;            // per requirement
  BlockArray margin_part_, violation_part_;  // per requirement
  BlockArray leaf_, leaf_part_;              // per leaf
  std::array<int, kLanes> violated_{};
};

}  // namespace graze
