#pragma once
// Bullet's three contact solvers behind one door, with the impulses of single contact points made readable.

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>

#include <memory>
#include <string>
#include <vector>

namespace graze::bullet {

/// Names of the contact models, in the order of contact.model's choices.
///   sequential_impulse: Gauss-Seidel on impulses, circular friction cone (btMultiBodyConstraintSolver)
///   dantzig: direct pivoting on the mixed LCP, friction pyramid whose size is taken once, from the normal impulses
///     that would act without friction (btDantzigSolver)
///   projected_gauss_seidel: iterative on the same LCP and pyramid (btSolveProjectedGaussSeidel)
const std::vector<std::string>& contact_model_names();

/// What a solver may leave of a speed that it was asked for, m/s.
inline constexpr double kSolverSlack = 1e-4;

class ContactSolver {
 public:
  virtual ~ContactSolver() = default;
  /// Changes the velocities of all multibodies that the manifolds and joint rows act on.
  virtual void solve(std::vector<btPersistentManifold*>& manifolds, std::vector<btMultiBodyConstraint*>& joints,
                     double h, btDispatcher& dispatcher) = 0;
  /// Contact points of the last solve, and the impulse that each gave its manifold's body 0 (world, N s).
  virtual int points() const = 0;
  virtual const btManifoldPoint* point(int i) const = 0;
  virtual btVector3 impulse(int i) const = 0;
};

/// Empty: the first of contact_model_names(). Throws InputError if the name is none of them.
std::unique_ptr<ContactSolver> make_contact_solver(const std::string& name);

}  // namespace graze::bullet
