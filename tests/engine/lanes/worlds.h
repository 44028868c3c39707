#pragma once
// A busy world for tests of bits: LINKS is dropped on the ground beside a curb, with a movable box on its way.

#include "engine/lane_physics/lane_engine.h"
#include "engine/lane_physics/lane_physics.h"
#include "engine/lanes/isa.h"
#include "engine/model/urdf.h"
#include "sampling/stream.h"
#include "tests/engine/bullet/worlds.h"
#include "tests/reference_kinematics.h"

namespace graze::test {

inline World busy_world(const std::string& model = "complementarity") {
  World world;
  world.robot = load_urdf(std::string(GRAZE_SOURCE_DIR) + "/data/robots/links.urdf");
  world.objects.push_back(fixed("ground", plane()));
  world.objects.push_back(fixed("curb", box(0.3, 0.01, 0.04), at(0.1, -0.1, 0.01)));
  world.objects.push_back(movable("crate", box(0.05, 0.04, 0.03), 0.1, at(0.15, 0.05, 0.05)));
  world.contact.model = model;
  world.contact.ignore = {{"*_LEG_*", "*"}};
  world.initial.on_ground = true;
  world.initial.clearance = 0.02;
  world.initial.linear_velocity = {0.3, -0.2, 0};
  for (const Joint& joint : world.robot.joints) {
    const double sign = joint.name.starts_with("LF") || joint.name.starts_with("RH") ? 1 : -1;
    const double angle = joint.name.ends_with("X_1") ? 0.2 : joint.name.ends_with("Y_2") ? 0.8 : 1.2;
    world.initial.joint_position[joint.name] = sign * angle;
  }
  return world;
}

/// Particle `id` of the busy world: masses, friction, springs and posture differ.
inline Particle busy_particle(std::uint32_t id, const std::string& model = "complementarity") {
  Particle particle = particle_of(busy_world(model));
  particle.id = id;
  const auto spread = [&](const std::string& name) { return 2 * uniform(1, id, name_hash(name), 0) - 1; };
  for (Body& body : particle.model.bodies) {
    const double factor = 1 + 0.1 * spread(body.name);
    body.mass *= factor;
    body.inertia *= factor;
    body.damping = 0.1;
  }
  for (std::size_t i = 0; i < particle.model.pairs.size(); ++i) {
    ColliderPair& pair = particle.model.pairs[i];
    pair.friction = 0.7 + 0.3 * spread("friction");
    if (i % 3 == 0) continue;  // these have the derived spring
    pair.spring.stiffness = 4e4 * (1 + 0.5 * spread(std::to_string(i)));
    if (i % 3 == 1) pair.spring.damping = 200 * (1 + 0.5 * spread("damping"));
  }
  for (int body : particle.model.actuated) {
    particle.initial.q[particle.model.bodies[body].q] += 0.1 * spread(particle.model.bodies[body].joint);
  }
  return particle;
}

}  // namespace graze::test
