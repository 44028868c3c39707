#include "engine/model/mass.h"

namespace graze {

double robot_mass(const Model& model) {
  double mass = 0;
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const bool base = i == 0 && model.floating_base;
    if (base || body.type != JointType::floating) mass += body.mass;
  }
  return mass;
}

double robot_weight(const Model& model) { return robot_mass(model) * model.gravity.norm(); }

}  // namespace graze
