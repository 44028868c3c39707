#include "engine/block_physics.h"

#include <fmt/format.h>

#include <cassert>
#include <stdexcept>

#include "engine/lanes/running_digest.h"

namespace graze {

namespace {

void add_shape(const Shape& shape, RunningDigest& digest) {
  digest.add(static_cast<int>(shape.kind));
  if (shape.mesh) {
    digest.add(shape.mesh->vertices.size());
    for (const Vec3& vertex : shape.mesh->vertices) digest.add_all(vertex);
    if (shape.hull) {
      for (const Vec3& corner : shape.hull->corners) digest.add_all(corner);
    }
  }
  if (shape.grid) {
    digest.add(shape.grid->nx), digest.add(shape.grid->ny);
    for (const double height : shape.grid->height) {
      if (!shape.spectrum) digest.add(height);
    }
  }
}

}  // namespace

std::uint64_t numbering_of(const Model& model) {
  RunningDigest digest;
  digest.add(model.bodies.size());
  for (const Body& body : model.bodies) {
    digest.add(static_cast<int>(body.type)), digest.add(body.parent);
    digest.add(body.name), digest.add(body.joint);
    digest.add(body.mimics);
  }
  digest.add(model.actuated.size());
  for (const int body : model.actuated) digest.add(body);
  digest.add(model.colliders.size());
  for (const Collider& collider : model.colliders) {
    digest.add(collider.body), digest.add(collider.name);
    add_shape(collider.shape, digest);
  }
  digest.add(model.pairs.size());
  for (const ColliderPair& pair : model.pairs) digest.add(pair.a), digest.add(pair.b);
  return digest.value();
}

Mat3 BlockState::rotation(int body, int lane) const {
  Mat3 R;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) R(r, c) = X(12 * body + 3 * r + c, lane);
  }
  return R;
}

Pose BlockState::pose(int body, int lane) const {
  Pose out = Pose::Identity();
  if (body < 0) return out;
  out.linear() = rotation(body, lane);
  out.translation() = position(body, lane);
  return out;
}

LaneMask ContactPoint::touching() const {
  const double *gap = row(kGap), *impulse = row(kNormalImpulse);
  unsigned out = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    out |= (static_cast<unsigned>(gap[lane] <= 0) | static_cast<unsigned>(impulse[lane] > 0)) << lane;
  }
  return LaneMask(out & lanes.bits());
}

Contact ContactPoint::contact(int lane) const {
  const auto vec3 = [&](int row) {
    return Vec3(rows[row * kLanes + lane], rows[(row + 1) * kLanes + lane], rows[(row + 2) * kLanes + lane]);
  };
  const auto number = [&](ContactRow row) { return static_cast<int>((*this)(row, lane)); };
  Contact out;
  out.a = a;
  out.b = b;
  out.feature_a = static_cast<Feature>(number(kFeatureA));
  out.feature_b = static_cast<Feature>(number(kFeatureB));
  out.p_W = vec3(kPoint);
  out.n_W = vec3(kNormal);
  out.phi = (*this)(kGap, lane);
  out.impulse_W = vec3(kImpulse);
  out.mode = static_cast<ContactMode>(number(kMode));
  out.age = (*this)(kAge, lane);
  return out;
}

void BlockPhysics::drive(double, LaneMask, const Drive&, DriveResult&) { assert(!"this back end takes torques"); }

SolverEffort BlockPhysics::effort(int) const { return {}; }

void BlockPhysics::push(int, int, const Vec3&, const Vec3&) {
  throw std::logic_error("this back end does not push bodies");
}

void BlockPhysics::load(int, int, const Vec3&, double) { throw std::logic_error("this back end does not load bodies"); }

std::shared_ptr<const SavedLane> BlockPhysics::save(int) const {
  throw std::logic_error("this back end does not save lanes");
}

void BlockPhysics::restore(int, const SavedLane&) { throw std::logic_error("this back end does not restore lanes"); }

void BlockPhysics::check_own(const SavedLane& saved, const std::string& back_end, std::uint64_t numbering) {
  if (saved.back_end() != back_end) {
    throw std::invalid_argument(
        fmt::format("a lane that the back end '{}' saved cannot be restored by '{}'; save it "
                    "with the back end that goes on from it",
                    saved.back_end(), back_end));
  }
  if (saved.numbering() != numbering) {
    throw std::invalid_argument(
        "a lane of another model cannot be restored here: bodies, joints, colliders, meshes or terrain differ; restore "
        "it in a block that is made for particles of the same scenario");
  }
}

std::vector<Contact> BlockPhysics::contacts(int lane) const {
  std::vector<Contact> out;
  for (const ContactPoint& point : points_) {
    if (point.lanes[lane]) out.push_back(point.contact(lane));
  }
  return out;
}

std::vector<ContactPoint> ContactLists::gather() {
  std::size_t count = 0;
  for (const auto& list : lists_) count += list.size();
  if (static_cast<std::size_t>(rows_.rows()) < count * kContactRows) {
    rows_ = BlockArray(static_cast<int>(2 * count) * kContactRows);
  }
  std::vector<ContactPoint> points;
  int first = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    for (const Contact& contact : lists_[lane]) {
      LaneMask lanes;
      lanes.set(lane);
      points.push_back({contact.a, contact.b, lanes, rows_.row(first)});
      for (int i = 0; i < 3; ++i) {
        rows_(first + kPoint + i, lane) = contact.p_W[i];
        rows_(first + kNormal + i, lane) = contact.n_W[i];
        rows_(first + kImpulse + i, lane) = contact.impulse_W[i];
      }
      rows_(first + kGap, lane) = contact.phi;
      rows_(first + kNormalImpulse, lane) = contact.normal_impulse();
      rows_(first + kMode, lane) = static_cast<double>(contact.mode);
      rows_(first + kAge, lane) = contact.age;
      rows_(first + kFeatureA, lane) = static_cast<double>(contact.feature_a);
      rows_(first + kFeatureB, lane) = static_cast<double>(contact.feature_b);
      first += kContactRows;
    }
  }
  return points;
}

}  // namespace graze
