#pragma once
// A ContactProblem given to the lanes' solver, one lane: Y is a square root of A, so that the degrees of freedom stand
// for those of a mechanism with that Delassus matrix.

#include <vector>

#include "engine/contact/newton_solve.h"
#include "engine/contact/reference_contact.h"
#include "engine/contact/residuals.h"
#include "engine/lane_physics/lane_memory.h"

namespace graze::test {

struct LaneSolution {
  Eigen::VectorXd lambda;
  double sweeps = 0, residual = 0;  // as the solver reports them
  ContactResidualsT<double> measured;
};

class LaneProblem {
 public:
  explicit LaneProblem(const ContactProblem& problem) : contacts_(problem.contacts()), memory_(contacts_.size()) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(problem.A);
    // As many degrees of freedom as A has rank; eigenvalues ascend.
    const Eigen::VectorXd& values = eigen.eigenvalues();
    const auto nv = static_cast<int>((values.array() > 1e-13 * values.maxCoeff()).count());
    root_ = eigen.eigenvectors().rightCols(nv) * values.tail(nv).cwiseSqrt().asDiagonal();
    for (int k = nv - 1; k >= 0; --k) dofs_.push_back(k);
    path_ = {nv, dofs_.data(), 0, nullptr, nullptr, 0, -1, false, -1};
    rows_.resize(static_cast<std::size_t>(2) * nv * contacts_.size());
    for (std::size_t i = 0; i < contacts_.size(); ++i) set_up(problem, static_cast<int>(i));
  }
  LaneProblem(const LaneProblem&) = delete;

  /// `warm`: where the sweeps start; empty: at zero.
  LaneSolution solve(const ContactLawT<double>& law, int most_sweeps, double tolerance,
                     const Eigen::VectorXd& warm = {}) {
    return solve(law, SolveBounds{most_sweeps, most_sweeps, 0, tolerance}, warm);
  }
  LaneSolution solve(const ContactLawT<double>& law, const SolveBounds& bounds, const Eigen::VectorXd& warm = {}) {
    std::vector<double> dz(dofs_.size());
    ChangeT<double> change(dz.data());
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      ContactT<double>& c = contacts_[i];
      const Eigen::Index k = 3 * static_cast<Eigen::Index>(i);
      c.lambda = warm.size() ? Vec3T<double>{warm[k], warm[k + 1], warm[k + 2]} : Vec3T<double>{0, 0, 0};
      c.slip_rate = 0;
      change.turn_to(path_);
      apply_impulse(path_, c, c.lambda, change);
    }
    change.in_memory();
    ConstraintsT<double> set{contacts_.data(), static_cast<int>(contacts_.size()), nullptr, 0, 0, &path_,
                             memory_.data()};
    LaneSolution out;
    // b has how fast they are; that they are fast lets no impulse count as a jam's.
    const std::vector<double> inverse_D(dofs_.size(), 1.0), start(dofs_.size(), 1e9), free(dofs_.size(), 0.0);
    const NewtonT<double> newton{path_.count, inverse_D.data(), start.data(), free.data(), newton_memory()};
    solve_constraints<double>(law, bounds, 1, newton, set, dz.data(), out.sweeps, out.residual);
    out.measured = contact_residuals<double>(law, set, dz.data());
    out.lambda.resize(3 * static_cast<Eigen::Index>(contacts_.size()));
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      const Vec3T<double>& x = contacts_[i].lambda;
      out.lambda.segment<3>(3 * static_cast<Eigen::Index>(i)) << x.x, x.y, x.z;
    }
    return out;
  }

  ContactT<double>& contact(int i) { return contacts_[static_cast<std::size_t>(i)]; }

 private:
  void set_up(const ContactProblem& problem, int i) {
    ContactT<double>& c = contacts_[static_cast<std::size_t>(i)];
    const int nv = path_.count;
    c.y = rows_.data() + static_cast<std::size_t>(2) * nv * i;
    RowSinkT<double> sink(c, nv);
    for (int k = 0; k < nv; ++k) {
      const Eigen::Vector3d y = root_.block<3, 1>(3 * i, dofs_[static_cast<std::size_t>(k)]);
      sink.put(k, {y.x(), y.y(), y.z()}, 1.0);
    }
    sink.finish(c);
    c.guard = c.compliance = guard_of(c);  // as set_up_contact
    c.ann += c.guard, c.ass += c.guard, c.att += c.guard;
    c.inverse_ann = 1 / c.ann;
    invert_A(c);
    c.friction = problem.mu[i];
    c.b = {problem.b[3 * i], problem.b[3 * i + 1], problem.b[3 * i + 2]};
    c.lanes = 1;
    c.path = 0;
  }

  NewtonMemory newton_memory() {
    numbers_.grow(newton_numbers(dofs_.size(), contacts_.size(), 0));
    indices_.resize(newton_indices(dofs_.size(), contacts_.size(), 0));
    return {numbers_.data(), indices_.data()};
  }

  Eigen::MatrixXd root_;
  std::vector<int> dofs_;
  PathView path_;
  std::vector<Vec3T<double>> rows_;
  std::vector<ContactT<double>> contacts_;
  std::vector<SweepMemoryT<double>> memory_;
  LaneMemory numbers_;
  std::vector<int> indices_;
};

}  // namespace graze::test
