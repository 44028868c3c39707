#pragma once
// Joint limits and dry joint friction as rows of Bullet's constraint solver. Bullet's own limit constraint acts only
// after the limit has been passed and gives back the overshoot as speed; this one holds v+ >= -gap/h before
// (Eq. 67's gap term, for joints) and returns at most kLimitRecovery after.

#include <BulletDynamics/Featherstone/btMultiBodyConstraint.h>

#include "engine/bullet/tree.h"

namespace graze::bullet {

/// Fastest return from beyond a joint limit, rad/s or m/s (our choice).
inline constexpr double kLimitRecovery = 0.2;

class JointRows : public btMultiBodyConstraint {
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
  int getIslandIdA() const override { return -1; }
  int getIslandIdB() const override { return -1; }
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override;
  void debugDraw(btIDebugDraw*) override {}

 private:
  enum Row { lower, upper, friction, count };
  bool limit_near(double gap, double closing, double h) const;
  /// One row: sign * v >= target (limits) or v = 0 (friction) with impulses between the bounds.
  void add_row(Row row, double target, double low, double high, btMultiBodyConstraintArray& rows,
               btMultiBodyJacobianData& data, const btContactSolverInfo& info);

  const Body& body_;
  double limit_impulse_ = 0;
};

}  // namespace graze::bullet
