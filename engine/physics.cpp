#include "engine/physics.h"

#include <cassert>

#include "engine/bullet/bullet_physics.h"
#include "engine/lane_physics/lane_physics.h"

namespace graze {

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

std::vector<std::string> physics_names() { return {"bullet", "lanes"}; }

std::vector<std::string> contact_models_of(const std::string& physics) {
  assert(physics == "bullet" || physics == "lanes");
  return physics == "lanes" ? lane_contact_models() : bullet::contact_model_names();
}

std::unique_ptr<BlockPhysics> make_physics(const std::string& name, const Model& nominal) {
  assert(name == "bullet" || name == "lanes");
  if (name == "lanes") return std::make_unique<LanePhysics>(nominal);
  return std::make_unique<bullet::BulletPhysics>(nominal);
}

}  // namespace graze
