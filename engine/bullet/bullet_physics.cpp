#include "engine/bullet/bullet_physics.h"

#include <LinearMath/btScalar.h>
#include <fmt/format.h>

#include <cassert>
#include <stdexcept>

#include "engine/bullet/solver.h"
#include "engine/physics.h"

namespace graze::bullet {

namespace {

constexpr const char* kBullet = "bullet";

}  // namespace

/// One world, and what the block shows of it that it does not keep.
struct BulletPhysics::Saved final : SavedLane {
  World::Saved world;
  Eigen::VectorXd a;  // nv

  Saved(std::uint64_t numbering, World::Saved saved, Eigen::VectorXd acceleration)
      : SavedLane(kBullet, numbering), world(std::move(saved)), a(std::move(acceleration)) {}
};

std::string bullet_version() { return fmt::format("{}.{:02}", BT_BULLET_VERSION / 100, BT_BULLET_VERSION % 100); }

BulletPhysics::BulletPhysics(const Model& nominal) : numbering_(numbering_of(nominal)), tau_(nominal.na()) {
  state_.q = BlockArray(nominal.nq);
  state_.v = BlockArray(nominal.nv);
  state_.a = BlockArray(nominal.nv);
  state_.X = BlockArray(12 * static_cast<int>(nominal.bodies.size()));
}

void BulletPhysics::start(int lane, const Particle& particle) {
  assert(particle.model.nq == state_.q.rows() && particle.model.nv == state_.v.rows());
  worlds_[lane].reset();
  worlds_[lane] = std::make_unique<World>(particle.model, particle.initial, hulls_);
  lists_[lane].clear();
  points_ = lists_.gather();
  fault_[lane].reset();
  publish(lane);
  for (int i = 0; i < state_.a.rows(); ++i) state_.a(i, lane) = 0;
}

void BulletPhysics::push(int lane, int body, const Vec3& p_B, const Vec3& impulse_W) {
  assert(worlds_[lane]);
  worlds_[lane]->push({body, p_B, impulse_W});
}

void BulletPhysics::load(int lane, int body, const Vec3& p_B, double mass) {
  assert(worlds_[lane]);
  worlds_[lane] = std::make_unique<World>(*worlds_[lane], body, p_B, mass, hulls_);
  publish(lane);
}

std::shared_ptr<const SavedLane> BulletPhysics::save(int lane) const {
  if (!worlds_[lane]) throw std::invalid_argument(fmt::format("lane {} has no particle that could be saved", lane));
  return std::make_shared<Saved>(numbering_, worlds_[lane]->save(), state_.a.column(lane));
}

void BulletPhysics::restore(int lane, const SavedLane& saved) {
  const Saved& from = own<Saved>(saved, kBullet, numbering_);
  worlds_[lane].reset();
  worlds_[lane] = std::make_unique<World>(from.world, hulls_);
  lists_[lane] = from.world.contacts;
  points_ = lists_.gather();
  fault_[lane] = from.world.fault;
  publish(lane);
  state_.a.set_column(lane, from.a);
}

void BulletPhysics::step(double h, LaneMask active, const BlockArray& tau) {
  assert(h > 0 && tau.rows() == tau_.size());
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!active[lane] || fault_[lane]) continue;  // what is no longer physical stands still
    assert(worlds_[lane]);
    World& world = *worlds_[lane];
    for (int k = 0; k < tau_.size(); ++k) tau_[k] = tau(k, lane);
    world.step(h, tau_);
    for (int i = 0; i < state_.a.rows(); ++i) {
      state_.a(i, lane) = (world.forest().v()[i] - state_.v(i, lane)) / h;
    }
    lists_[lane] = world.contacts();
    fault_[lane] = world.fault();
    publish(lane);
  }
  points_ = lists_.gather();
}

void BulletPhysics::publish(int lane) {
  const Forest& forest = worlds_[lane]->forest();
  for (int i = 0; i < state_.q.rows(); ++i) state_.q(i, lane) = forest.q()[i];
  for (int i = 0; i < state_.v.rows(); ++i) state_.v(i, lane) = forest.v()[i];
  for (int body = 0; 12 * body < state_.X.rows(); ++body) {
    const Pose& X = forest.pose(body);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) state_.X(12 * body + 3 * r + c, lane) = X.linear()(r, c);
      state_.X(12 * body + 9 + r, lane) = X.translation()[r];
    }
  }
}

namespace {

const PhysicsRegistration bullet_registration(
    kBullet,
    {"multibodies and contact solvers of Bullet in double precision, one particle after the other", contact_models(),
     bullet_version(), false},
    [](const Model& nominal) { return std::make_unique<BulletPhysics>(nominal); });

}  // namespace

}  // namespace graze::bullet
