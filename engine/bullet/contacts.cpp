#include "engine/bullet/contacts.h"

#include <algorithm>
#include <cassert>
#include <tuple>

#include "engine/contact/bullet_convert.h"
#include "engine/contact/features.h"

namespace graze::bullet {
namespace {

/// Part of an overlap that is taken back per step (Baumgarte; Bullet's erp2 at its default).
constexpr double kOverlapRecovery = 0.2;
/// A point beyond Bullet's processing threshold (1e30 in double precision) is left out of the solve.
constexpr double kOutOfReach = 1e40;
/// Slower approach than gravity makes in two steps is rest, not an impact.
constexpr double kRestSteps = 2;
/// A gap may close this much faster than at the beginning of the step, m/s (500 m/s^2 for 1 ms).
constexpr double kSpeedUp = 0.5;
/// A contact slips when it is faster than this, m/s (our choice, here and below) …
constexpr double kSlipSpeed = 1e-3;
/// … or when this share of its friction is used up and it is faster than what the solver may leave of a stick.
constexpr double kConeShare = 0.999;

Vec3 velocity_at(const Collider& collider, const Forest& forest, const Vec3& p_W) {
  if (collider.body < 0) return Vec3::Zero();
  return forest.twist(collider.body).at(p_W - forest.pose(collider.body).translation());
}

}  // namespace

Vec3 ContactSet::relative_velocity(const Point& point, const Forest& forest) const {
  return velocity_at(model_.colliders[point.pair->a], forest, point.p_W) -
         velocity_at(model_.colliders[point.pair->b], forest, point.p_W);
}

void ContactSet::prepare(const std::vector<NearPair>& pairs, const Forest& forest, double h) {
  points_.clear();
  manifolds_.clear();
  int row = 0;
  for (const NearPair& near : pairs) {
    manifolds_.push_back(near.manifold);
    const bool swapped = near.manifold->getBody0() != solids_[near.pair->a].object.get();
    for (int k = 0; k < near.manifold->getNumContacts(); ++k) {
      points_.push_back({near.pair, &near.manifold->getContactPoint(k), swapped, -1, 0, 0, Vec3::Zero(), {}});
      set_target(points_.back(), forest, h);
      if (points_.back().point->getDistance() < kOutOfReach) points_.back().row = row++;
    }
  }
}

/// Bullet asks v+ >= -distance/h of a point that is apart (no stepping over) and v+ >= -erp distance/h of one that
/// overlaps. With the distance set to -h and erp to a speed the latter says v+ >= speed, which gives Newton's
/// restitution and a bounded recovery exactly.
void ContactSet::set_target(Point& point, const Forest& forest, double h) {
  btManifoldPoint& cp = *point.point;
  cp.m_combinedFriction = point.pair->friction;
  cp.m_combinedRestitution = cp.m_combinedRollingFriction = cp.m_combinedSpinningFriction = 0;
  const double gap = point.gap = cp.getDistance();
  point.contact.a = point.pair->a;
  point.contact.b = point.pair->b;
  point.contact.n_W = (point.swapped ? -1 : 1) * from_bt(cp.m_normalWorldOnB);
  point.p_W = 0.5 * from_bt(cp.getPositionWorldOnA() + cp.getPositionWorldOnB());
  const double approach = point.approach = -point.contact.n_W.dot(relative_velocity(point, forest));
  const bool bounces = point.pair->restitution > 0 && approach > kRestSteps * h * model_.gravity.norm();
  if (gap > 0) {
    // A bounce must not be braked by the gap term before it happens, and a row that cannot act costs as much as any.
    const bool reachable = gap < h * (2 * std::max(approach, 0.0) + kSpeedUp);
    if (bounces || !reachable) cp.setDistance(kOutOfReach);
    return;
  }
  const double recovery = std::min(-gap * kOverlapRecovery / h, kRecovery);
  cp.m_contactPointFlags |= BT_CONTACT_FLAG_HAS_CONTACT_ERP;
  cp.m_contactERP = bounces ? std::max(recovery, point.pair->restitution * approach) : recovery;
  cp.setDistance(-h);
}

void ContactSet::read(const ContactSolver* solver, const Forest& forest, double h) {
  for (Point& point : points_) read_point(point, solver, forest, h);
}

void ContactSet::read_point(Point& point, const ContactSolver* solver, const Forest& forest, double h) const {
  Contact& contact = point.contact;
  if (solver && point.row >= 0) {
    assert(solver->point(point.row) == point.point);
    contact.impulse_W = (point.swapped ? -1 : 1) * from_bt(solver->impulse(point.row));
  }
  const Vec3 u = relative_velocity(point, forest);
  const double normal_speed = contact.n_W.dot(u), normal = contact.normal_impulse();
  contact.phi = point.gap + h * normal_speed;
  const double tangential = (contact.impulse_W - normal * contact.n_W).norm();
  const double speed = (u - normal_speed * contact.n_W).norm();
  const bool used_up = tangential >= kConeShare * point.pair->friction * normal;
  const bool slips = speed > kSlipSpeed || (used_up && speed > kSolverSlack);
  const bool rolls = normal > 0 && rolling_speed(point, forest) > kRollSpeed;
  contact.mode = slips ? ContactMode::slip : rolls ? ContactMode::roll : ContactMode::stick;
  // The speed that the step begins with, and gravity's part of it; what is apart and does not close is new at the end.
  const double closing = point.approach + h * std::abs(contact.n_W.dot(model_.gravity));
  contact.age = point.gap <= 0 ? h : closing > 0 ? std::max(0.0, h - point.gap / closing) : 0.0;
}

double ContactSet::rolling_speed(const Point& point, const Forest& forest) const {
  const Collider *a = &model_.colliders[point.pair->a], *b = &model_.colliders[point.pair->b];
  const auto spin = [&](const Collider& c) { return c.body < 0 ? Vec3(Vec3::Zero()) : forest.twist(c.body).angular; };
  const Vec3 w = spin(*a) - spin(*b), n = point.contact.n_W;
  double most = 0;
  for (const Collider* c : {a, b}) {
    const double radius = c->shape.size.x();
    if (c->shape.kind == ShapeKind::sphere) most = std::max(most, radius * (w - n.dot(w) * n).norm());
    if (c->shape.kind != ShapeKind::capsule && c->shape.kind != ShapeKind::cylinder) continue;
    const Vec3 axis = (c->body < 0 ? c->X_BG : Pose(forest.pose(c->body) * c->X_BG)).linear().col(2);
    // A cylinder rolls on its side, where the normal is across the axis.
    if (c->shape.kind == ShapeKind::cylinder && std::abs(n.dot(axis)) > 1e-3) continue;
    most = std::max(most, radius * std::abs(w.dot(axis)));
  }
  return most;
}

void ContactSet::place(std::vector<Contact>& out) {
  out.clear();
  for (Point& point : points_) {
    place_point(point);
    out.push_back(point.contact);
  }
  std::sort(out.begin(), out.end(), [](const Contact& x, const Contact& y) {
    return std::tuple(x.a, x.b, x.p_W.x(), x.p_W.y(), x.p_W.z()) <
           std::tuple(y.a, y.b, y.p_W.x(), y.p_W.y(), y.p_W.z());
  });
}

void ContactSet::place_point(Point& point) const {
  const btManifoldPoint& cp = *point.point;
  const Solid &a = solids_[point.pair->a], &b = solids_[point.pair->b];
  const btVector3& local_a = point.swapped ? cp.m_localPointB : cp.m_localPointA;
  const btVector3& local_b = point.swapped ? cp.m_localPointA : cp.m_localPointB;
  Contact& contact = point.contact;
  contact.p_W = 0.5 * from_bt(a.object->getWorldTransform() * local_a + b.object->getWorldTransform() * local_b);
  contact.feature_a = feature_of(a.collider->shape, from_bt(local_a));
  contact.feature_b = feature_of(b.collider->shape, from_bt(local_b));
}

}  // namespace graze::bullet
