#include "jobs/cli/robot_facts.h"

#include <fmt/format.h>

#include <cmath>
#include <map>

#include "engine/model/measures.h"

namespace graze {
namespace {

constexpr const char* kKinds[] = {"box", "sphere", "cylinder", "capsule", "mesh", "plane", "heightfield"};

/// By ShapeKind.
std::map<int, int> count_shapes(const Model& model) {
  std::map<int, int> out;
  for (const Collider& collider : model.colliders) ++out[static_cast<int>(collider.shape.kind)];
  return out;
}

nlohmann::json limit(double x) { return std::isfinite(x) ? nlohmann::json(x) : nlohmann::json(); }

}  // namespace

std::string shapes_text(const Model& model) {
  std::string out;
  for (const auto& [kind, n] : count_shapes(model)) {
    const char* plural =
        kKinds[kind] == std::string_view("box") || kKinds[kind] == std::string_view("mesh") ? "es" : "s";
    out += fmt::format("{}{} {}{}", out.empty() ? "" : ", ", n, kKinds[kind], n == 1 ? "" : plural);
  }
  return out;
}

nlohmann::json robot_as_json(const Scenario& scenario) {
  const Model& model = scenario.model;
  const State initial = initial_state(*scenario.world, model);
  const Vec3 size = robot_extent(model, initial);
  nlohmann::json out = {{"name", scenario.world->robot.name},
                        {"mass", whole_mass(scenario.world->robot)},
                        {"moving_mass", robot_mass(model)},
                        {"floating", model.floating_base},
                        {"links", scenario.world->robot.links.size()},
                        {"size", {size.x(), size.y(), size.z()}},
                        {"joints", nlohmann::json::array()},
                        {"shapes", nlohmann::json::object()},
                        {"pairs", model.pairs.size()},
                        {"mimic", nlohmann::json::array()}};
  for (const int body : model.actuated) {
    const Body& joint = model.bodies[body];
    out["joints"].push_back({{"name", joint.joint},
                             {"kind", joint.type == JointType::prismatic ? "prismatic" : "revolute"},
                             {"lower", limit(joint.lower)},
                             {"upper", limit(joint.upper)},
                             {"effort", limit(joint.effort)},
                             {"velocity", limit(joint.velocity)},
                             {"damping", joint.damping},
                             {"gear", scenario.world->robot.joint(joint.joint).gear},
                             {"rotor_inertia", scenario.world->robot.joint(joint.joint).rotor_inertia},
                             {"reflected_inertia", joint.armature},
                             {"initial", initial.q[joint.q]}});
  }
  for (const Body& joint : model.bodies) {
    if (joint.mimics < 0) continue;
    out["mimic"].push_back({{"name", joint.joint},
                            {"follows", model.bodies[joint.mimics].joint},
                            {"multiplier", joint.multiplier},
                            {"offset", joint.offset},
                            {"initial", initial.q[joint.q]}});
  }
  for (const auto& [kind, n] : count_shapes(model)) out["shapes"][kKinds[kind]] = n;
  return out;
}

}  // namespace graze
