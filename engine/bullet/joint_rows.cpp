#include "engine/bullet/joint_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace graze::bullet {
namespace {

/// Contact or torque may speed a joint up within a step: rows start this fast a joint early, rad/s or m/s.
constexpr double kLimitWatchSpeed = 5.0;

double target_speed(double gap, double h) {
  return gap > 0 ? -gap / h : std::min(-gap * kOvershootRecovery / h, kLimitRecovery);
}

}  // namespace

TreeRows::TreeRows(const Forest& forest, int body, int rows, bool unilateral, btTypedMultiBodyConstraintType type)
    : btMultiBodyConstraint(forest.multibody(body), forest.multibody(body), forest.link(body),
                            forest.multibody(body)->getParent(forest.link(body)), rows, unilateral, type) {}

JointRows::JointRows(const Body& body, const Forest& forest, int index)
    : TreeRows(forest, index, count, true, MULTIBODY_CONSTRAINT_LIMIT), body_(body) {
  finalizeMultiDof();
}

bool JointRows::needed(const Body& body) {
  return body.type != JointType::floating &&
         (body.friction > 0 || std::isfinite(body.lower) || std::isfinite(body.upper));
}

bool JointRows::limit_near(double gap, double closing, double h) const {
  return gap < h * std::max(2 * closing, kLimitWatchSpeed);
}

bool JointRows::active(double h) const {
  const double q = m_bodyA->getJointPos(m_linkA), v = m_bodyA->getJointVel(m_linkA);
  return body_.friction > 0 || limit_near(q - body_.lower, -v, h) || limit_near(body_.upper - q, v, h);
}

void JointRows::after_solve() { limit_impulse_ = std::abs(m_data[lower]) + std::abs(m_data[upper]); }

void JointRows::finalizeMultiDof() {
  allocateJacobiansMultiDof();
  for (int i = 0; i < m_data.size(); ++i) m_data[i] = 0;
  const int column = 6 + m_bodyA->getLink(m_linkA).m_dofOffset;
  jacobianA(lower)[column] = 1;
  jacobianA(upper)[column] = -1;
  jacobianA(friction)[column] = 1;
  m_numDofsFinalized = m_jacSizeBoth;
}

void JointRows::createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                                     const btContactSolverInfo& info) {
  const double h = info.m_timeStep, q = m_bodyA->getJointPos(m_linkA), v = m_bodyA->getJointVel(m_linkA);
  m_data[lower] = m_data[upper] = m_data[friction] = 0;
  const double above = q - body_.lower, below = body_.upper - q;
  if (limit_near(above, -v, h)) add_row(lower, target_speed(above, h), 0, kUnbounded, rows, data, info);
  if (limit_near(below, v, h)) add_row(upper, target_speed(below, h), 0, kUnbounded, rows, data, info);
  if (body_.friction > 0) {
    add_row(friction, 0, -body_.friction * h, body_.friction * h, rows, data, info);
  }
}

void TreeRows::add_row(int row, double target, double low, double high, btMultiBodyConstraintArray& rows,
                       btMultiBodyJacobianData& data, const btContactSolverInfo& info) {
  btMultiBodySolverConstraint& constraint = rows.expandNonInitializing();
  constraint.m_orgConstraint = this;
  constraint.m_orgDofIndex = row;
  const btVector3 zero(0, 0, 0);
  const double speed = fillMultiBodyConstraint(constraint, data, jacobianA(row), jacobianB(row), zero, zero, zero, zero,
                                               0, info, low, high);
  constraint.m_rhs = (target - speed) * constraint.m_jacDiagABInv;
  constraint.m_rhsPenetration = 0;
  // No joint reaction is reported, so the row's wrench on the links is left out.
  constraint.m_contactNormal1 = constraint.m_contactNormal2 = zero;
  constraint.m_relpos1CrossNormal = constraint.m_relpos2CrossNormal = zero;
}

}  // namespace graze::bullet
