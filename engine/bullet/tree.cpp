#include "engine/bullet/tree.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cassert>

#include "engine/contact/bullet_convert.h"

namespace graze::bullet {
namespace {

/// Bullet clamps every generalised velocity to this; far above anything that energy checks let pass.
constexpr double kNoVelocityLimit = 1e30;

/// Axes R_BC along which the inertia is diagonal, and the diagonal. Axes that are principal already stay as they are.
std::pair<Mat3, Vec3> principal_axes(const Mat3& inertia) {
  const Mat3 off = inertia - Mat3(inertia.diagonal().asDiagonal());
  if (off.cwiseAbs().maxCoeff() == 0) return {Mat3::Identity(), inertia.diagonal()};
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(inertia);
  Mat3 R = solver.eigenvectors();
  if (R.determinant() < 0) R.col(2) = -R.col(2);
  return {R, solver.eigenvalues()};
}

bool floats(const Body& body) { return body.type == JointType::floating; }

}  // namespace

Forest::Forest(const Model& model, const State& initial)
    : model_(model), X_WB_(model.bodies.size(), Pose::Identity()), twist_(model.bodies.size()) {
  q_.setZero(model.nq);
  v_.setZero(model.nv);
  for (const Body& body : model.bodies) {
    const auto [R_BC, inertia] = principal_axes(body.inertia);
    Pose X_BC = Pose::Identity();
    X_BC.linear() = R_BC;
    X_BC.translation() = body.com;
    X_BC_.push_back(X_BC);
    q_BC_.push_back(Quat(R_BC));
    principal_inertia_.push_back(inertia);
  }
  place_bodies();
  for (Tree& tree : trees_) build(tree);
  write_state(initial);
  refresh();
}

void Forest::place_bodies() {
  int fixed_tree = -1;
  for (int i = 0; i < static_cast<int>(model_.bodies.size()); ++i) {
    const Body& body = model_.bodies[i];
    int tree = body.parent >= 0 ? place_[body.parent].tree : fixed_tree;
    if (floats(body) || tree < 0) {
      tree = static_cast<int>(trees_.size());
      trees_.push_back({nullptr, floats(body) ? i : -1, {}, {}});
      if (!floats(body)) fixed_tree = tree;
    }
    if (!floats(body)) trees_[tree].links.push_back(i);
    place_.push_back({tree, floats(body) ? -1 : static_cast<int>(trees_[tree].links.size()) - 1});
  }
}

void Forest::build(Tree& tree) {
  const bool fixed = tree.base < 0;
  const double mass = fixed ? 0 : model_.bodies[tree.base].mass;
  const btVector3 inertia = fixed ? btVector3(0, 0, 0) : to_bt(principal_inertia_[tree.base]);
  const int n = static_cast<int>(tree.links.size());
  tree.body = std::make_unique<btMultiBody>(n, mass, inertia, fixed, /*canSleep=*/false);
  btMultiBody& multibody = *tree.body;
  for (int link = 0; link < n; ++link) setup_link(multibody, link, tree.links[link]);
  multibody.finalizeMultiDof();
  for (int link = 0; link < n; ++link) {
    const double damping = model_.bodies[tree.links[link]].damping;
    if (damping > 0) tree.damped.push_back({6 + multibody.getLink(link).m_dofOffset, damping});
  }
  multibody.setLinearDamping(0);
  multibody.setAngularDamping(0);
  multibody.setUseGyroTerm(true);
  multibody.setMaxCoordinateVelocity(kNoVelocityLimit);
  multibody.setMaxAppliedImpulse(kNoVelocityLimit);
}

void Forest::setup_link(btMultiBody& multibody, int link, int i) {
  const Body& body = model_.bodies[i];
  const Pose X_PCp = body.parent < 0 ? Pose::Identity() : X_BC_[body.parent];
  const int parent = body.parent < 0 ? -1 : place_[body.parent].link;
  const Mat3 R_CB = X_BC_[i].linear().transpose();
  const Mat3 R_CCp = R_CB * body.X_PB.linear().transpose() * X_PCp.linear();
  const btQuaternion parent_to_this = to_bt(Quat(R_CCp));
  const btVector3 axis = to_bt(Vec3(R_CB * body.axis));
  const btVector3 parent_to_pivot =
      to_bt(Vec3(X_PCp.linear().transpose() * (body.X_PB.translation() - X_PCp.translation())));
  const btVector3 pivot_to_com = to_bt(Vec3(R_CB * body.com));
  const btVector3 inertia = to_bt(principal_inertia_[i]);
  if (body.type == JointType::revolute) {
    multibody.setupRevolute(link, body.mass, inertia, parent, parent_to_this, axis, parent_to_pivot, pivot_to_com);
  } else {
    assert(body.type == JointType::prismatic);
    multibody.setupPrismatic(link, body.mass, inertia, parent, parent_to_this, axis, parent_to_pivot, pivot_to_com,
                             false);
  }
}

void Forest::write_state(const State& state) {
  assert(state.q.size() == model_.nq && state.v.size() == model_.nv);
  for (Tree& tree : trees_) {
    btMultiBody& multibody = *tree.body;
    if (tree.base >= 0) {
      const Body& body = model_.bodies[tree.base];
      const double* q = state.q.data() + body.q;
      const Quat q_WB = Quat(q[0], q[1], q[2], q[3]).normalized();
      const Quat q_WC = q_WB * q_BC_[tree.base];
      const Vec3 omega = state.v.segment<3>(body.v), offset = q_WB * body.com;
      multibody.setBasePos(to_bt(Vec3(state.q.segment<3>(body.q + 4) + offset)));
      multibody.setWorldToBaseRot(to_bt(q_WC.conjugate()));
      multibody.setBaseOmega(to_bt(omega));
      multibody.setBaseVel(to_bt(Vec3(state.v.segment<3>(body.v + 3) + omega.cross(offset))));
    }
    for (int link = 0; link < multibody.getNumLinks(); ++link) {
      const Body& body = model_.bodies[tree.links[link]];
      multibody.setJointPos(link, state.q[body.q]);
      multibody.setJointVel(link, state.v[body.v]);
    }
  }
}

Forest::Raw Forest::raw() const {
  Raw out;
  for (const Tree& tree : trees_) {
    const btMultiBody& multibody = *tree.body;
    const btQuaternion& turn = multibody.getWorldToBaseRot();
    const btVector3& place = multibody.getBasePos();
    std::vector<double>& numbers = out.emplace_back();
    numbers = {turn.x(), turn.y(), turn.z(), turn.w(), place.x(), place.y(), place.z()};
    const btScalar* velocity = multibody.getVelocityVector();
    numbers.insert(numbers.end(), velocity, velocity + 6 + multibody.getNumDofs());
    for (int link = 0; link < multibody.getNumLinks(); ++link) numbers.push_back(multibody.getJointPos(link));
  }
  return out;
}

void Forest::restore(const Raw& raw) {
  assert(raw.size() == trees_.size());
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    btMultiBody& multibody = *trees_[i].body;
    const double* x = raw[i].data();
    multibody.setWorldToBaseRot(btQuaternion(x[0], x[1], x[2], x[3]));
    multibody.setBasePos(btVector3(x[4], x[5], x[6]));
    multibody.setBaseOmega(btVector3(x[7], x[8], x[9]));
    multibody.setBaseVel(btVector3(x[10], x[11], x[12]));
    x += 13;
    // Every joint has one degree of freedom, and Bullet orders them as it does its links.
    for (int link = 0; link < multibody.getNumLinks(); ++link) multibody.setJointVel(link, x[link]);
    x += multibody.getNumDofs();
    for (int link = 0; link < multibody.getNumLinks(); ++link) multibody.setJointPos(link, x[link]);
  }
  refresh();
}

void Forest::refresh() {
  for (Tree& tree : trees_) tree.body->forwardKinematics(scratch_q_, scratch_v_);
  for (int i = 0; i < static_cast<int>(place_.size()); ++i) read_pose(i);
  refresh_twists();
}

void Forest::refresh_twists() {
  for (int i = 0; i < static_cast<int>(place_.size()); ++i) read_twist(i);
}

void Forest::read_pose(int i) {
  const Body& body = model_.bodies[i];
  const btMultiBody& multibody = *this->multibody(i);
  Pose& X_WB = X_WB_[i];
  if (floats(body)) {
    const Quat q_WB = from_bt(multibody.getWorldToBaseRot()).conjugate() * q_BC_[i].conjugate();
    X_WB.linear() = q_WB.toRotationMatrix();
    X_WB.translation() = from_bt(multibody.getBasePos()) - X_WB.linear() * body.com;
    q_.segment<4>(body.q) << q_WB.w(), q_WB.x(), q_WB.y(), q_WB.z();
    q_.segment<3>(body.q + 4) = X_WB.translation();
    return;
  }
  const btTransform& X_WC = multibody.getLink(link(i)).m_cachedWorldTransform;
  X_WB.linear() = from_bt(X_WC.getBasis()) * X_BC_[i].linear().transpose();
  X_WB.translation() = from_bt(X_WC.getOrigin()) - X_WB.linear() * body.com;
  q_[body.q] = multibody.getJointPos(link(i));
}

void Forest::read_twist(int i) {
  const Body& body = model_.bodies[i];
  const btMultiBody& multibody = *this->multibody(i);
  const Pose& X_WB = X_WB_[i];
  Twist& twist = twist_[i];
  if (floats(body)) {
    twist.angular = from_bt(multibody.getBaseOmega());
    twist.linear = from_bt(multibody.getBaseVel()) - twist.angular.cross(X_WB.linear() * body.com);
    v_.segment<3>(body.v) = twist.angular;
    v_.segment<3>(body.v + 3) = twist.linear;
    return;
  }
  twist = {};
  if (body.parent >= 0) {
    const Twist& parent = twist_[body.parent];
    twist = {parent.angular, parent.at(X_WB.translation() - X_WB_[body.parent].translation())};
  }
  const double rate = v_[body.v] = multibody.getJointVel(link(i));
  (body.type == JointType::revolute ? twist.angular : twist.linear) += X_WB.linear() * (rate * body.axis);
}

void Forest::set_forces(const Eigen::VectorXd& joint_force) {
  const btVector3 gravity = to_bt(model_.gravity);
  for (Tree& tree : trees_) {
    btMultiBody& multibody = *tree.body;
    multibody.clearForcesAndTorques();
    if (tree.base >= 0) multibody.addBaseForce(gravity * multibody.getBaseMass());
    for (int link = 0; link < multibody.getNumLinks(); ++link) {
      multibody.addLinkForce(link, gravity * multibody.getLinkMass(link));
      multibody.addJointTorque(link, joint_force[model_.bodies[tree.links[link]].v]);
    }
  }
}

void Forest::add_force(int i, const Vec3& p_B, const Vec3& force) {
  btMultiBody& multibody = *this->multibody(i);
  const Vec3 arm = X_WB_[i].linear() * (p_B - model_.bodies[i].com);  // Bullet's frames are at the centres of mass
  const btVector3 f = to_bt(force), torque = to_bt(Vec3(arm.cross(force)));
  if (floats(model_.bodies[i])) {
    multibody.addBaseForce(f);
    multibody.addBaseTorque(torque);
  } else {
    multibody.addLinkForce(link(i), f);
    multibody.addLinkTorque(link(i), torque);
  }
}

void Forest::accelerate(double h) {
  for (Tree& tree : trees_) {
    tree.body->computeAccelerationsArticulatedBodyAlgorithmMultiDof(h, scratch_r_, scratch_v_, scratch_m_,
                                                                    /*isConstraintPass=*/false, false, false);
  }
}

void Forest::damp(double h) {
  for (const Tree& tree : trees_) {
    const int n = static_cast<int>(tree.damped.size());
    if (n == 0) continue;
    btMultiBody& multibody = *tree.body;
    const int dofs = 6 + multibody.getNumDofs();
    unit_impulse_.setZero(dofs);
    response_.resize(dofs, n);
    Eigen::MatrixXd system(n, n);
    Eigen::VectorXd speed(n);
    for (int k = 0; k < n; ++k) {
      unit_impulse_[tree.damped[k].row] = 1;
      multibody.calcAccelerationDeltasMultiDof(unit_impulse_.data(), response_.col(k).data(), scratch_r_, scratch_v_);
      unit_impulse_[tree.damped[k].row] = 0;
      speed[k] = multibody.getVelocityVector()[tree.damped[k].row];
    }
    for (int k = 0; k < n; ++k) system.row(k) = response_.row(tree.damped[k].row);
    for (int k = 0; k < n; ++k) system(k, k) += 1 / (h * tree.damped[k].damping);
    const Eigen::VectorXd change = response_ * system.llt().solve(-speed);
    multibody.applyDeltaVeeMultiDof(change.data(), 1);
  }
}

void Forest::apply_impulses() {
  for (Tree& tree : trees_) tree.body->processDeltaVeeMultiDof2();
}

void Forest::move(double h) {
  for (Tree& tree : trees_) tree.body->stepPositionsMultiDof(h);
}

}  // namespace graze::bullet
