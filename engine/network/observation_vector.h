#pragma once
// The observation vector of a network: what is sensed, in the order, the axes and the scales in which the network was
// trained to see it, with frames of the past.

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/control/base_command.h"
#include "engine/control/policy.h"
#include "engine/network/kernel.h"

namespace graze {

/// The keys of a network that say what it sees: `inputs`, `history`, `newest`, `stacked`, `velocity`, `waypoints`,
/// `commands`.
std::vector<Key> observation_keys();

/// A whole number of things `what` from 1 to `most`. Throws InputError, whose nearest right answer lies within.
long long read_count(const Settings& value, long long most, const char* what);

/// The joints that a network moves, in its order, and what it counts their positions from.
struct NetworkJoints {
  std::vector<int> actuators;  // rows of an observation's joints and of targets
  std::vector<std::string> names;
  std::vector<double> stance;  // rad or m
};

class ObservationVector {
 public:
  /// Throws InputError. `kernel` outlives this.
  ObservationVector(const ControlContext& context, const Described& own, const NetworkJoints& joints,
                    const NetworkKernel& kernel);

  /// Numbers of the whole vector, all frames.
  int size() const { return static_cast<int>(layout_.size()); }
  /// "48: base_rate 3, gravity 3, …; 2 frames", and what listed kind has just `missing` numbers, for messages.
  std::string in_words() const;
  std::string of_size(int missing) const;
  unsigned reads() const { return reads_; }

  void start(int lane);
  void carry(int lane, LaneTape& tape);
  /// Takes what is sensed as the newest frame of the lanes `due`; a lane's first frame stands for its past, too.
  /// `action`: the last one, a row for each joint.
  void see(const Observation& observation, LaneMask due, const BlockArray& action);
  /// Row i of the vector, after see().
  const double* row(int i) const {
    const auto [age, row] = layout_[static_cast<std::size_t>(i)];
    return frames_[static_cast<std::size_t>(age)].row(row);
  }

 private:
  struct Term;
  void read_terms(const Described& own);
  void read_layout(const Described& own);
  void fill(const Term& term, const Observation& observation, const BlockArray& action, BlockArray& out) const;
  void turn(const Observation& observation);
  void finish(const Term& term, BlockArray& out) const;

  NetworkJoints joints_;
  const NetworkKernel* kernel_;
  std::vector<std::shared_ptr<const Term>> terms_;  // in order
  std::unique_ptr<Steering> steering_;              // null: there is no command
  unsigned reads_ = 0;
  std::vector<std::pair<int, int>> layout_;  // age of the frame, row in it
  std::vector<BlockArray> frames_;           // the newest first
  BlockArray now_, down_, rate_, velocity_, command_;
  LaneMask fresh_;
};

}  // namespace graze
