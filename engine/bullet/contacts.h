#pragma once
// From Bullet's manifolds to the engine's contacts: before the solve each point gets its coefficients and the speed at
// which it shall part; after the step it is read back with impulse, gap, features and mode.

#include <vector>

#include "engine/block_physics.h"
#include "engine/bullet/narrow_phase.h"
#include "engine/bullet/solver.h"

namespace graze::bullet {

/// Overlaps are pushed apart at a fifth of their depth per step, but never faster than this, m/s (our choice).
inline constexpr double kRecovery = 0.1;

class ContactSet {
 public:
  ContactSet(const Model& model, const std::vector<Solid>& solids) : model_(model), solids_(solids) {}

  /// Takes over the points of a detection at the beginning of a step of h seconds. The forest's twists are those of
  /// the beginning too: Newton's restitution counts from them.
  void prepare(const std::vector<NearPair>& pairs, const Forest& forest, double h);
  std::vector<btPersistentManifold*>& manifolds() { return manifolds_; }

  /// Reads impulses (null solver: none), gaps and modes after the impulses have changed the velocities but before the
  /// bodies have moved: what the solver decided holds at the points of the detection. The gap is the one after moving
  /// to first order, phi + h v_n, which is the quantity that the solver kept from turning negative.
  void read(const ContactSolver* solver, const Forest& forest, double h);
  /// Positions and features where the bodies are now; sorted by (a, b, position).
  void place(std::vector<Contact>& out);

 private:
  struct Point {
    const ColliderPair* pair;
    btManifoldPoint* point;
    bool swapped;     // Bullet's body 0 is collider b
    int row;          // number in the solver, or -1 if it was left out
    double gap;       // at detection, m
    double approach;  // normal speed before the step, m/s; positive: closing
    Vec3 p_W;         // at detection
    Contact contact;
  };
  /// Of collider a against b at the point of detection, at the forest's poses.
  Vec3 relative_velocity(const Point& point, const Forest& forest) const;
  /// As ContactMode::roll has it, m/s.
  double rolling_speed(const Point& point, const Forest& forest) const;
  void set_target(Point& point, const Forest& forest, double h);
  void read_point(Point& point, const ContactSolver* solver, const Forest& forest, double h) const;
  void place_point(Point& point) const;

  const Model& model_;
  const std::vector<Solid>& solids_;
  std::vector<Point> points_;
  std::vector<btPersistentManifold*> manifolds_;
};

}  // namespace graze::bullet
