#pragma once
// Frames of a trace for pictures: far fewer than steps, and yet no touch is missed.

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "simulation/block_run.h"

namespace graze {

/// What two colliders did to each other between a frame and the one before.
struct FrameContact {
  std::uint32_t frame = 0;
  int a = 0, b = 0;           // colliders, a < b
  Vec3 p_W = Vec3::Zero();    // m } means over the steps and points, weighted with the normal impulse
  Vec3 n_W = Vec3::Zero();    //   } from b to a, unit
  double normal_impulse = 0;  // N s, on a
};

/// Where one shape of a particle is on its body, and how large: particles differ in both.
struct FrameShape {
  Vec3 size = Vec3::Zero();  // as Shape::size
  Pose X_BG = Pose::Identity();
  std::shared_ptr<const HeightGrid> ground = nullptr;  // that was drawn for the particle
};

struct TraceFrames {
  std::vector<double> time;  // [frame], s
  std::vector<std::vector<double>>
      rows;  // [channel][frame]: q, v, tau, witnesses of the requirements, of the objective
  std::vector<std::vector<double>> poses;  // [7 per body][frame]: p_WB (x y z), orientation (x y z w)
  std::vector<FrameContact> contacts;      // by frame
  std::vector<FrameShape> shapes;          // [collider]
};

/// Watches runs of any number of particles under one policy and keeps one of `every` steps, the start and the end.
class FrameWatch : public TraceObserver {
 public:
  using Pairs = std::map<std::pair<int, int>, FrameContact>;
  /// Adds what touches in this step.
  static void add_contacts(const StepView& step, Pairs& out);
  /// Adds the bodies' poses in the world, and shapes if there are none.
  static void add_poses(const Model& model, const std::vector<Pose>& X_WB, TraceFrames& out);
  /// Makes what has touched since the frame before a part of the last one, whose time is there.
  static void take_contacts(Pairs& contacts, TraceFrames& out);

  /// `bodies`: particles of which poses and contacts are kept, too. `ends`: s, when each particle's trace ends at the
  /// latest; it is stopped there.
  FrameWatch(std::uint32_t every, std::set<std::uint32_t> bodies, std::map<std::uint32_t, double> ends)
      : every_(every), bodies_(std::move(bodies)), ends_(std::move(ends)) {}
  bool see(const StepView& step) override;
  TraceFrames take(std::uint32_t particle) { return std::move(frames_[particle]); }

 private:
  static void add_rows(const StepView& step, TraceFrames& out);

  const std::uint32_t every_;
  const std::set<std::uint32_t> bodies_;
  const std::map<std::uint32_t, double> ends_;
  std::map<std::uint32_t, TraceFrames> frames_;
  std::map<std::uint32_t, Pairs> contacts_;  // since the last frame
};

}  // namespace graze
