#pragma once
// Bullet's three contact solvers behind one door, with the impulses of single contact points made readable.

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>

#include <memory>
#include <string>
#include <vector>

#include "engine/physics.h"

namespace graze::bullet {

/// The contact models, in the order of contact.model's choices. By Bullet's names: btMultiBodyConstraintSolver,
/// btDantzigSolver (whose pyramid is sized once, by the normal impulses that would act without friction) and
/// btSolveProjectedGaussSeidel.
std::vector<PhysicsText::ContactModel> contact_models();

/// What a solver may leave of a speed that it was asked for, m/s.
inline constexpr double kSolverSlack = 1e-4;

class ContactSolver {
 public:
  virtual ~ContactSolver() = default;
  /// Changes the velocities of all multibodies that the manifolds and joint rows act on. `geared`: some rows hold
  /// joints to others, which iterations need long for.
  virtual void solve(std::vector<btPersistentManifold*>& manifolds, std::vector<btMultiBodyConstraint*>& joints,
                     bool geared, double h, btDispatcher& dispatcher) = 0;
  /// Contact points of the last solve, and the impulse that each gave its manifold's body 0 (world, N s).
  virtual int points() const = 0;
  virtual const btManifoldPoint* point(int i) const = 0;
  virtual btVector3 impulse(int i) const = 0;
};

/// Empty: the first of contact_models(). Throws InputError if the name is none of them.
std::unique_ptr<ContactSolver> make_contact_solver(const std::string& name);

}  // namespace graze::bullet
