#pragma once
// Contact impulses of one lane of inverse dynamics as complementarity problems (dissertation §7.3 and §7.4): joints
// move as they are told, so that contacts feel the inertia A of the base and of held objects alone. Scalar: the same
// bits for every instruction set.

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "engine/control/kernel.h"
#include "engine/lanes/lane_tape.h"

namespace graze {

/// Contacts of a robot whose joints move as they are told.
struct BaseContacts {
  Eigen::MatrixXd A;         // 6 f x 6 f: inertia of the base and of objects, f bodies that are free
  Eigen::MatrixXd J;         // 3 n x 6 f: normal and two tangents of each contact
  Eigen::VectorXd u;         // 3 n: velocities without impulses plus gap terms
  Eigen::VectorXd friction;  // n
  Eigen::MatrixXd delassus() const { return J * A.llt().solve(J.transpose()); }
};

/// Impulses [3 n] of contacts with pyramids of four edges as friction cones (Eqs. 86 to 101), by Lemke's algorithm, or
/// none if it ends on a ray: for as many of the contacts as leave no other approaching. `closest`: of all solutions
/// those that are nearest to these impulses [3 n] (Algorithm 5), where no more than two contacts allow that they be
/// enumerated.
Eigen::VectorXd pivot_coulomb(const BaseContacts& contacts, const Eigen::VectorXd* closest = nullptr);

/// A tangent whose part that is independent of those before is less than this share of it counts as dependent (our
/// choice): the square of 1 cm in 1 m, by which feet at two heights can tell forces along the line between them apart.
/// Less, and they would press against each other with more than a hundred times what moves the robot.
inline constexpr double kIndependent = 1e-4;

/// Impulses [3 n] of contacts that do not slip (Eqs. 68 to 77), or none if what the joints do contradicts them. Of
/// the tangents those count that Algorithm 3 finds independent. `active`: contacts that pressed in the last solution,
/// with which the principal pivoting begins (Algorithm 4), and then those of this one. `independent`: as kIndependent.
Eigen::VectorXd pivot_no_slip(const BaseContacts& contacts, std::vector<int>& active,
                              double independent = kIndependent);

/// Which solution.
enum class Pivoting { no_slip, coulomb, closest };

/// The solver behind InverseDynamicsView::pivot.
class ContactPivoting {
 public:
  ContactPivoting() = default;
  explicit ContactPivoting(Pivoting which) : which_(which) {}
  void start(int lane) {
    pressing_[lane].clear();
    impulses_[lane].clear();
  }
  /// `view`: whose contacts are solved; outlives the calls. Sets its solver.
  void serve(InverseDynamicsView& view);
  /// What a lane keeps from call to call.
  void carry(int lane, LaneTape& tape) {
    tape.carry(pressing_[lane]);
    tape.carry(impulses_[lane]);
  }

 private:
  void solve(int lane, int count);
  BaseContacts read(int lane, int count);
  Eigen::VectorXd solve_no_slip(int lane, const BaseContacts& contacts);
  Eigen::VectorXd solve_closest(int lane, const BaseContacts& contacts);

  Pivoting which_ = Pivoting::coulomb;
  const InverseDynamicsView* view_ = nullptr;
  std::vector<int> contacts_;                         // of the lane, indices into the memory
  std::array<std::vector<int>, kLanes> pressing_;     // links, of the last solution
  std::array<std::vector<double>, kLanes> impulses_;  // of `closest`: three for each of them
};

}  // namespace graze
