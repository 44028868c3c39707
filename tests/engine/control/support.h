#pragma once
// What the tests of sensing, actuation and control share: the LINKS robot on a plane, and a closed loop around it.

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "engine/control/policy.h"
#include "engine/model/fabrication.h"
#include "engine/model/urdf.h"
#include "tests/reference_kinematics.h"

namespace graze {

inline std::string shipped_robot(const std::string& file) {
  return std::string(GRAZE_SOURCE_DIR) + "/data/robots/" + file;
}

/// LINKS at the published initial joint angles on a plane z = 0; as published, only torso and feet touch the ground.
inline World links_world(const std::string& urdf = "links.urdf") {
  World world;
  world.robot = load_urdf(shipped_robot(urdf));
  Object ground;
  ground.name = "ground";
  ground.shape.kind = ShapeKind::plane;
  world.objects.push_back(ground);
  world.contact.ignore = {{"*_LEG_*", "*"}};
  world.initial.on_ground = true;
  const std::pair<const char*, double> legs[] = {{"LF", 1}, {"RF", -1}, {"LH", -1}, {"RH", 1}};
  for (const auto& [leg, sign] : legs) {
    world.initial.joint_position[std::string(leg) + "_X_1"] = sign * 0.2;
    world.initial.joint_position[std::string(leg) + "_Y_2"] = sign * 0.8;
    world.initial.joint_position[std::string(leg) + "_Y_3"] = sign * 1.2;
  }
  return world;
}

/// The same with a movable object of 157 kg, many times the robot's mass.
inline World links_world_with_anvil() {
  World world = links_world();
  Object anvil;
  anvil.name = "anvil";
  anvil.shape = {ShapeKind::box, {0.4, 0.25, 0.2}, nullptr, nullptr};
  anvil.X_WO.translation() = Vec3(5, 0, 0.1);
  anvil.movable = true;
  anvil.inertia = MassMoments::of_shape(anvil.shape, 7850);
  world.objects.push_back(anvil);
  return world;
}

/// World, model and initial state that belong together.
struct Scene {
  World world;
  Model model;
  State initial;
  explicit Scene(World w) : world(std::move(w)), model(compile(world)), initial(initial_state(world, model)) {}
  ControlContext context(double period = 0.001) const { return {model, initial, period}; }
  Particle particle(std::uint32_t id = 0) const {
    Particle out;
    out.id = id;
    out.model = model;
    out.initial = initial;
    out.joint_zero.assign(model.na(), 0.0);
    out.sensor_bias.assign(channel_names(world.robot).size(), 0.0);
    return out;
  }
};

/// The message of the InputError that `action` throws; a failed test if it throws none.
template <typename Action>
std::string input_error(Action action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  ADD_FAILURE() << "no InputError";
  return "";
}

/// A back end whose state and contacts are set by hand.
class FakePhysics : public BlockPhysics {
 public:
  explicit FakePhysics(const Model& model) {
    state_.q = BlockArray(model.nq);
    state_.v = state_.a = BlockArray(model.nv);
    state_.X = BlockArray(12 * static_cast<int>(model.bodies.size()));
  }
  void start(int lane, const Particle& particle) override {
    state_.q.set_column(lane, particle.initial.q);
    state_.v.set_column(lane, particle.initial.v);
  }
  void step(double, LaneMask, const BlockArray&) override {}
  BlockState& mutable_state() { return state_; }
  void set_contacts(int lane, const std::vector<Contact>& contacts) {
    lists_[lane] = contacts;
    points_ = lists_.gather();
  }

 private:
  ContactLists lists_;
};

/// An observation of LINKS at rest in its initial posture, in every lane, and a place for the commands that answer it.
struct SensedAtRest {
  Scene scene{links_world()};
  Observation observation;
  ActuatorCommand command{scene.model.na()};
  SensedAtRest() {
    observation.joint_position = observation.joint_velocity = BlockArray(scene.model.na());
    observation.base_position = observation.base_rpy = BlockArray(3);
    observation.link_force = BlockArray(static_cast<int>(scene.model.frames.size()));
    for (int lane = 0; lane < kLanes; ++lane) {
      for (int k = 0; k < scene.model.na(); ++k) {
        observation.joint_position(k, lane) = scene.initial.q[scene.model.bodies[scene.model.actuated[k]].q];
      }
    }
  }
};

}  // namespace graze
