#pragma once
// The tables of a gait whose lanes have a robot each: what Gait has of one robot, with a number of each lane in place
// of each number.

#include <optional>
#include <vector>

#include "engine/control/kernel.h"
#include "engine/control/lane_chain.h"

namespace graze {

class LaneGait {
 public:
  /// Every lane has the robot of `like`, whose lists of frames outlive this.
  explicit LaneGait(const GaitOf<double>& like);
  // The view points into this.
  LaneGait(const LaneGait&) = delete;
  LaneGait& operator=(const LaneGait&) = delete;

  /// Whether a robot can be one lane's: its gait differs from that of the others in numbers alone.
  bool fits(const GaitOf<double>& robot) const;
  /// Takes over the numbers of a robot that fits.
  void put(int lane, const GaitOf<double>& robot);
  const GaitOf<LaneNumber>& view() const { return view_; }

 private:
  struct Leg {
    LaneChain chain;
    std::vector<LaneNumber> reference;
    std::optional<HipKneeOf<LaneNumber>> closed;
  };

  std::vector<Leg> legs_;
  std::vector<LegOf<LaneNumber>> views_;
  std::vector<LaneNumber> initial_;
  GaitOf<LaneNumber> view_{};
};

}  // namespace graze
