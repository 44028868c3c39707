#pragma once
// The Bullet back end: particles on Bullet's Featherstone multibodies and contact solvers, one World per lane, looped
// over inside the block interface. In: a Particle per lane and actuator torques. Out: BlockState, contacts, faults.
// Reading order: world.h (what a step does), tree.h (bodies and frames), narrow_phase.h and analytic.h (contact
// points), contacts.h (coefficients in, impulses out), solver.h, joint_rows.h (limits and dry friction), energy.h
// (which steps are not physical). docs/physics.md states the choices and their limits.

#include <array>
#include <memory>
#include <string>

#include "engine/block_physics.h"
#include "engine/bullet/world.h"

namespace graze::bullet {

/// Of the library that this program was compiled against: "3.24".
std::string bullet_version();

class BulletPhysics : public BlockPhysics {
 public:
  explicit BulletPhysics(const Model& nominal);
  void start(int lane, const Particle& particle) override;
  void step(double h, LaneMask active, const BlockArray& tau) override;
  void push(int lane, int body, const Vec3& p_B, const Vec3& impulse_W) override;
  void load(int lane, int body, const Vec3& p_B, double mass) override;
  std::shared_ptr<const SavedLane> save(int lane) const override;
  void restore(int lane, const SavedLane& saved) override;

 private:
  struct Saved;
  void publish(int lane);

  const std::uint64_t numbering_;
  HullCache hulls_;
  std::array<std::unique_ptr<World>, kLanes> worlds_;
  ContactLists lists_;
  Eigen::VectorXd tau_;  // na
};

}  // namespace graze::bullet
