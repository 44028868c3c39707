#pragma once
// Bullet's three contact solvers behind one door, with the impulses of single contact points made readable.

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>

#include <memory>
#include <string>
#include <vector>

namespace graze::bullet {

/// Names of the contact models, in the order of contact.model's choices.
///   sequential_impulse: Gauss-Seidel on impulses, circular friction cone (btMultiBodyConstraintSolver)
///   dantzig: direct pivoting on the mixed LCP, friction pyramid (btDantzigSolver)
///   projected_gauss_seidel: iterative on the same LCP and pyramid (btSolveProjectedGaussSeidel)
const std::vector<std::string>& contact_model_names();

class ContactSolver {
 public:
  virtual ~ContactSolver() = default;
  /// Changes the velocities of all multibodies that the manifolds and joint rows act on.
  virtual void solve(std::vector<btPersistentManifold*>& manifolds, std::vector<btMultiBodyConstraint*>& joints,
                     double h, btDispatcher& dispatcher) = 0;
  /// Impulse that a contact point gave its body 0 in the last solve (world, N s), by number: points count in the order
  /// of the manifolds and of the points in them, without those that were put out of reach.
  virtual btVector3 impulse(int point) const = 0;
  virtual int points() const = 0;
};

/// Asserts that the name is one of contact_model_names().
std::unique_ptr<ContactSolver> make_contact_solver(const std::string& name);

}  // namespace graze::bullet
