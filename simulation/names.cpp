#include "simulation/names.h"

#include "engine/model/model.h"

namespace graze {
namespace {

void name_states(const Model& model, TraceNames& names) {
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (body.type != JointType::floating) {
      names.q_names.push_back(body.joint);
      names.v_names.push_back(body.joint);
      continue;
    }
    const std::string name = i == 0 && model.floating_base ? "base" : body.name;
    for (const char* part : {".qw", ".qx", ".qy", ".qz", ".x", ".y", ".z"}) names.q_names.push_back(name + part);
    for (const char* part : {".wx", ".wy", ".wz", ".vx", ".vy", ".vz"}) names.v_names.push_back(name + part);
  }
}

}  // namespace

TraceNames trace_names(const Model& model) {
  TraceNames out;
  for (const Collider& collider : model.colliders) out.colliders.push_back(collider.name);
  for (const Body& body : model.bodies) out.bodies.push_back(body.name);
  for (const Frame& frame : model.frames) out.links.push_back(frame.name);
  for (const int body : model.actuated) out.actuator_names.push_back(model.bodies[body].joint);
  name_states(model, out);
  return out;
}

}  // namespace graze
