#include "engine/bullet/solver.h"

#include <BulletDynamics/Featherstone/btMultiBodyMLCPConstraintSolver.h>
#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <BulletDynamics/MLCPSolvers/btSolveProjectedGaussSeidel.h>

#include <cassert>

#include "engine/model/model.h"

namespace graze::bullet {
namespace {

/// Iterations of the iterative solvers at most; sequential impulse ends earlier when the largest change of a row's
/// velocity in a sweep is below kResidual.
constexpr int kIterations = 30;
/// Where a light joint follows a heavy one, sweeps over its row and its contacts creep: ten times as many (our choice).
constexpr int kGearedIterations = 300;
constexpr double kResidual = 1e-7;  // m/s or rad/s
/// Compliance that keeps redundant contacts (a box on four corners) solvable by pivoting: velocity per impulse, s/kg
/// after Bullet divides by h. At 10 N s it moves a contact by 1e-5 m/s.
constexpr double kPivotCompliance = 1e-6;

btContactSolverInfo solver_info(double h, double compliance, bool geared) {
  btContactSolverInfo info;
  info.m_timeStep = h;
  info.m_numIterations = geared ? kGearedIterations : kIterations;
  info.m_leastSquaresResidualThreshold = kResidual * kResidual;
  info.m_globalCfm = compliance * h;
  info.m_frictionERP = 0;  // no positional memory of friction
  info.m_splitImpulse = false;
  info.m_linearSlop = 0;
  info.m_restitutionVelocityThreshold = 0;                             // each point carries its own target speed
  info.m_solverMode = SOLVER_SIMD | SOLVER_USE_2_FRICTION_DIRECTIONS;  // no random order, no warm start
  return info;
}

/// One side of a row: its multibody, Jacobian and response to a unit impulse.
struct Side {
  const btMultiBody* body;
  const btScalar *jacobian, *response;
};

template <class Base>
class Exposed : public Base, public ContactSolver {
 public:
  template <class... Arguments>
  explicit Exposed(double compliance, Arguments... arguments) : Base(arguments...), compliance_(compliance) {}

  void solve(std::vector<btPersistentManifold*>& manifolds, std::vector<btMultiBodyConstraint*>& joints, bool geared,
             double h, btDispatcher& dispatcher) override {
    this->solveMultiBodyGroup(nullptr, 0, manifolds.data(), static_cast<int>(manifolds.size()), nullptr, 0,
                              joints.data(), static_cast<int>(joints.size()), solver_info(h, compliance_, geared),
                              nullptr, &dispatcher);
  }
  int points() const override { return this->m_multiBodyNormalContactConstraints.size(); }
  const btManifoldPoint* point(int i) const override {
    return static_cast<const btManifoldPoint*>(this->m_multiBodyNormalContactConstraints[i].m_originalContactPoint);
  }
  btVector3 impulse(int i) const override {
    const auto along = [](const btMultiBodySolverConstraint& row) {
      return row.m_contactNormal1 * btScalar(row.m_appliedImpulse);
    };
    const btMultiBodyConstraintArray& friction = this->m_multiBodyFrictionContactConstraints;
    assert(friction[2 * i].m_frictionIndex == i && friction[2 * i + 1].m_frictionIndex == i);
    return along(this->m_multiBodyNormalContactConstraints[i]) + along(friction[2 * i]) + along(friction[2 * i + 1]);
  }

 protected:
  double compliance_;
};

using SequentialImpulse = Exposed<btMultiBodyConstraintSolver>;

/// The mixed-LCP solvers. Bullet leaves out of its matrix the coupling between the two sides of a contact of one tree
/// with itself; this adds it.
class MixedLcp : public Exposed<btMultiBodyMLCPConstraintSolver> {
 public:
  explicit MixedLcp(std::unique_ptr<btMLCPSolverInterface> pivot)
      : Exposed(kPivotCompliance, pivot.get()), pivot_(std::move(pivot)) {}

 protected:
  void createMLCPFast(const btContactSolverInfo& info) override {
    btMultiBodyMLCPConstraintSolver::createMLCPFast(info);
    const int n = m_multiBodyAllConstraintPtrArray.size();
    bool self = false;
    for (int i = 0; i < n; ++i) self = self || touches_itself(*m_multiBodyAllConstraintPtrArray[i]);
    for (int i = 0; self && i < n; ++i) {
      for (int j = i; j < n; ++j) {
        const double a = coupling(*m_multiBodyAllConstraintPtrArray[i], *m_multiBodyAllConstraintPtrArray[j]);
        m_multiBodyA.setElem(i, j, i == j ? a + info.m_globalCfm / info.m_timeStep : a);
        m_multiBodyA.setElem(j, i, m_multiBodyA(i, j));
      }
    }
  }

 private:
  static bool touches_itself(const btMultiBodySolverConstraint& row) {
    return row.m_multiBodyA == row.m_multiBodyB && row.m_orgConstraint == nullptr;
  }
  Side side(const btMultiBody* body, int index) const {
    if (!body) return {nullptr, nullptr, nullptr};
    return {body, &m_data.m_jacobians[index], &m_data.m_deltaVelocitiesUnitImpulse[index]};
  }
  double coupling(const btMultiBodySolverConstraint& i, const btMultiBodySolverConstraint& j) const {
    double sum = 0;
    for (const Side& s : {side(i.m_multiBodyA, i.m_jacAindex), side(i.m_multiBodyB, i.m_jacBindex)}) {
      for (const Side& t : {side(j.m_multiBodyA, j.m_jacAindex), side(j.m_multiBodyB, j.m_jacBindex)}) {
        if (!s.body || s.body != t.body) continue;
        for (int k = 0; k < 6 + s.body->getNumDofs(); ++k) sum += s.response[k] * t.jacobian[k];
      }
    }
    return sum;
  }

  std::unique_ptr<btMLCPSolverInterface> pivot_;
};

struct SolverRow {
  PhysicsText::ContactModel text;
  std::unique_ptr<ContactSolver> (*make)();
};

const std::vector<SolverRow>& solvers() {
  using Made = std::unique_ptr<ContactSolver>;
  static const std::vector<SolverRow> rows = {
      {{"sequential_impulse", "projected Gauss-Seidel on impulses, circular friction cone"},
       []() -> Made { return std::make_unique<SequentialImpulse>(0.0); }},
      {{"dantzig", "pivoting on the mixed LCP, friction pyramid sized without friction"},
       []() -> Made { return std::make_unique<MixedLcp>(std::make_unique<btDantzigSolver>()); }},
      {{"projected_gauss_seidel", "iteration on the same LCP and pyramid"},
       []() -> Made { return std::make_unique<MixedLcp>(std::make_unique<btSolveProjectedGaussSeidel>()); }}};
  return rows;
}

}  // namespace

std::vector<PhysicsText::ContactModel> contact_models() {
  std::vector<PhysicsText::ContactModel> out;
  for (const SolverRow& row : solvers()) out.push_back(row.text);
  return out;
}

std::unique_ptr<ContactSolver> make_contact_solver(const std::string& name) {
  std::vector<std::string> names;
  for (const SolverRow& row : solvers()) names.push_back(row.text.name);
  return solvers()[contact_model_index(name, "bullet", names)].make();
}

}  // namespace graze::bullet
