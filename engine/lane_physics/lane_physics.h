#pragma once
// The back end "lanes": a block of kLanes particles in one LaneEngine, or in several that have fewer lanes each.

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "engine/block_physics.h"
#include "engine/lane_physics/lane_engine.h"

namespace graze {

class LanePhysics : public BlockPhysics {
 public:
  /// `width`: lanes of an engine, one that kernel_of() has; 0: as many as a register of the chosen instruction set
  /// holds, but all of the block where it has none of such a width. No bit depends on it.
  explicit LanePhysics(const Model& nominal, int width = 0);
  ~LanePhysics() override;

  void start(int lane, const Particle& particle) override;
  void step(double h, LaneMask active, const BlockArray& tau) override;

  bool solves_drives() const override { return true; }
  void drive(double h, LaneMask active, const Drive& drive, DriveResult& result) override;
  SolverEffort effort(int lane) const override;

  void push(int lane, int body, const Vec3& p_B, const Vec3& impulse_W) override;
  void load(int lane, int body, const Vec3& p_B, double mass) override;

  std::shared_ptr<const SavedLane> save(int lane) const override;
  void restore(int lane, const SavedLane& saved) override;

  /// Effort and result of the contact solver in the last step: sweeps, and the largest change of a contact's velocity
  /// in the last of them, m/s.
  double sweeps(int lane) const { return engine(lane).sweeps(lane % width_); }
  double residual(int lane) const { return engine(lane).residual(lane % width_); }
  /// Kinetic and potential energy, J.
  double energy(int lane) const { return engine(lane).energy(lane % width_); }
  /// Work of the joint torques over the last step, J.
  double work(int lane) const { return engine(lane).work(lane % width_); }

 private:
  struct Part;
  const LaneEngine& engine(int lane) const;
  bool whole() const { return width_ == kLanes; }
  /// Without the lanes that are no longer physical, which stand still.
  LaneMask physical(LaneMask active) const;
  /// Steps each part; `run(part, lanes)` does it.
  template <class Run>
  void step_parts(LaneMask active, const Run& run);
  void take_state(const Part& part);
  void report_contacts();
  void report_contacts_of_parts();
  void find_faults();
  std::string why_not_physical(int lane) const;

  struct Saved;
  /// The block's points without those of a lane.
  void forget_points(int lane);

  const int width_;
  const std::uint64_t numbering_;
  std::vector<std::string> names_;  // of the bodies
  std::vector<std::unique_ptr<Part>> parts_;
  BlockArray report_;                        // kContactRows per contact point, where the parts' own are gathered
  std::array<BlockArray, kLanes> restored_;  // the same of points that were restored
};

}  // namespace graze
