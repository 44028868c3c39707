#pragma once
// The back end "lanes": a block of kLanes particles in one LaneEngine.

#include "engine/lane_physics/lane_engine.h"
#include "engine/physics.h"

namespace graze {

class LanePhysics : public BlockPhysics {
 public:
  explicit LanePhysics(const Model& nominal);

  void start(int lane, const Particle& particle) override;
  void step(double h, LaneMask active, const BlockArray& tau) override;

  bool solves_drives() const override { return true; }
  void drive(double h, LaneMask active, const Drive& drive, DriveResult& result) override;
  SolverEffort effort(int lane) const override;

  /// Effort and result of the contact solver in the last step: sweeps, and the largest change of a contact's velocity
  /// in the last of them, m/s.
  double sweeps(int lane) const { return engine_.sweeps(lane); }
  double residual(int lane) const { return engine_.residual(lane); }
  /// Kinetic and potential energy, J.
  double energy(int lane) const { return engine_.energy(lane); }
  /// Work of the joint torques over the last step, J.
  double work(int lane) const { return engine_.work(lane); }

 private:
  void report_contacts();
  void find_faults();
  std::string why_not_physical(int lane) const;

  LaneEngine engine_;
};

}  // namespace graze
