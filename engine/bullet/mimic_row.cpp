#include "engine/bullet/mimic_row.h"

#include <algorithm>
#include <cassert>

namespace graze::bullet {

MimicRow::MimicRow(const Model& model, const Forest& forest, int index)
    : TreeRows(forest, index, 1, false, MULTIBODY_CONSTRAINT_GEAR),
      body_(model.bodies[index]),
      other_link_(forest.link(body_.mimics)) {
  assert(forest.multibody(index) == forest.multibody(body_.mimics));
  finalizeMultiDof();
}

void MimicRow::finalizeMultiDof() {
  allocateJacobiansMultiDof();
  for (int i = 0; i < m_data.size(); ++i) m_data[i] = 0;
  jacobianA(0)[6 + m_bodyA->getLink(m_linkA).m_dofOffset] = 1;
  jacobianA(0)[6 + m_bodyA->getLink(other_link_).m_dofOffset] = -body_.multiplier;
  m_numDofsFinalized = m_jacSizeBoth;
}

void MimicRow::createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                                    const btContactSolverInfo& info) {
  m_data[0] = 0;
  const double led = body_.multiplier * m_bodyA->getJointPos(other_link_) + body_.offset;
  const double error = m_bodyA->getJointPos(m_linkA) - led;
  const double target = std::clamp(-error * kOvershootRecovery / info.m_timeStep, -kLimitRecovery, kLimitRecovery);
  add_row(0, target, -kUnbounded, kUnbounded, rows, data, info);
}

}  // namespace graze::bullet
