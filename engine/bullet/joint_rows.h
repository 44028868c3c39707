#pragma once
// Joint limits and dry joint friction as rows of Bullet's constraint solver. Bullet's own limit constraint acts only
// after the limit has been passed and gives back the overshoot as speed; this one holds v+ >= -gap/h before
// (Eq. 67's gap term, for joints) and returns at most kLimitRecovery after.

#include <BulletDynamics/Featherstone/btMultiBodyConstraint.h>

#include "engine/bullet/tree.h"

namespace graze::bullet {

/// Fastest return from beyond a joint limit, rad/s or m/s (our choice).
inline constexpr double kLimitRecovery = 0.2;
/// Part of an overshoot that is taken back per step, as for contacts.
inline constexpr double kOvershootRecovery = 0.2;
/// Bullet's own upper bound of impulses.
inline constexpr double kUnbounded = 1e10;

/// Rows that stand on joints of one tree.
class TreeRows : public btMultiBodyConstraint {
 public:
  int getIslandIdA() const override { return -1; }
  int getIslandIdB() const override { return -1; }
  void debugDraw(btIDebugDraw*) override {}

 protected:
  TreeRows(const Forest& forest, int body, int rows, bool unilateral, btTypedMultiBodyConstraintType type);
  /// Row `row`: J v = target as far as impulses between the bounds allow.
  void add_row(int row, double target, double low, double high, btMultiBodyConstraintArray& rows,
               btMultiBodyJacobianData& data, const btContactSolverInfo& info);
};

class JointRows : public TreeRows {
 public:
  JointRows(const Body& body, const Forest& forest, int index);
  static bool needed(const Body& body);

  /// True if the next step needs a row: friction, or a limit that may be reached within h.
  bool active(double h) const;
  /// Impulse at the limits over the last step, N m s or N s.
  double limit_impulse() const { return limit_impulse_; }
  void clear() { limit_impulse_ = 0; }
  void after_solve();

  void finalizeMultiDof() override;
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override;

 private:
  enum Row { lower, upper, friction, count };
  bool limit_near(double gap, double closing, double h) const;

  const Body& body_;
  double limit_impulse_ = 0;
};

}  // namespace graze::bullet
