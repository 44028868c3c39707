#pragma once
// A joint that follows another as a row of Bullet's constraint solver. Bullet's own btMultiBodyGearConstraint puts the
// two joints of one tree on two sides of a row, between which its solvers leave out the coupling, and takes errors back
// without a bound; here both stand on one side.

#include "engine/bullet/joint_rows.h"

namespace graze::bullet {

class MimicRow : public TreeRows {
 public:
  /// Body `index` of `model`, whose joint follows another.
  MimicRow(const Model& model, const Forest& forest, int index);

  /// Impulse along the row over the last step, N m s or N s.
  double impulse() const { return m_data[0]; }

  void finalizeMultiDof() override;
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override;

 private:
  const Body& body_;
  int other_link_;
};

}  // namespace graze::bullet
