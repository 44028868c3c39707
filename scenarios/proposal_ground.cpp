#include "scenarios/proposal_ground.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/model/placement.h"
#include "scenarios/overlaps.h"
#include "scenarios/proposal_words.h"

namespace graze {
namespace {

constexpr double kSlack = 0.01;  // m below z = 0: a foot's plate or a mesh's rim

/// World z, m, of the lowest of the robot's shapes and links.
double lowest_part(const Model& model, const Eigen::VectorXd& q) {
  const std::vector<Pose> X_WB = place_bodies(model, q);
  double out = lowest_point(model, X_WB);
  for (int f = 0; f < static_cast<int>(model.frames.size()); ++f)
    out = std::min(out, frame_pose(model, X_WB, f).translation().z());
  return out;
}

/// The same wherever one joint goes while the others stay.
double lowest_reach(const Model& model, const Eigen::VectorXd& begin) {
  constexpr int kSteps = 16;
  double out = lowest_part(model, begin);
  for (const int body : model.actuated) {
    const Body& one = model.bodies[body];
    const double far = one.type == JointType::prismatic ? 1 : std::numbers::pi;  // m or rad, if no limit is nearer
    const double low = std::max(one.lower, begin[one.q] - far), high = std::min(one.upper, begin[one.q] + far);
    Eigen::VectorXd q = begin;
    for (int i = 0; i <= kSteps; ++i) {
      q[one.q] = low + (high - low) * i / kSteps;
      out = std::min(out, lowest_part(model, q));
    }
  }
  return out;
}

/// "ground", unless a link of the robot is called so.
std::string ground_name(const Model& model) {
  std::string name = "ground";
  for (int i = 1; model.frame(name) >= 0; ++i) name = i == 1 ? "floor" : fmt::format("floor_{}", i);
  return name;
}

}  // namespace

bool stands_clear(const Model& model, const State& initial) {
  return model.floating_base || lowest_part(model, initial.q) >= -kSlack;
}

std::string proposed_ground(const Model& model, const State& initial) {
  const std::string name = ground_name(model), ground = fmt::format("environment:\n  {}: {{plane: z}}", name);
  if (model.floating_base) return ground + "\n";
  const double reach = lowest_reach(model, initial.q);
  if (!stands_clear(model, initial)) {
    return fmt::format(
        "# No ground: the robot is fixed to the world and begins with parts {:.2g} m below z = 0. One below its "
        "reach:\n# environment: {{{}: {{plane: z, position: [0, 0, {:g} m]}}}}\n",
        -lowest_part(model, initial.q), name, std::floor(10 * reach - 1) / 10);
  }
  return ground + (reach < -kSlack ? fmt::format("  # its joints can take it {:.2g} m below\n", -reach) : "\n");
}

std::string ignored_overlaps(const Model& model, const State& initial) {
  std::vector<Clearance::Overlap> found =
      clearance_of_all_parts(model).overlaps(beginning(model, initial), kBeginningLane);
  std::erase_if(found, [&](const Clearance::Overlap& one) {
    return model.colliders[one.a].is_object || model.colliders[one.b].is_object;
  });
  if (found.empty()) return "";
  std::string out = "  # Links that are in each other as the robot begins; they pass through each other.\n  ignore:\n";
  for (const Clearance::Overlap& one : found) {
    out += fmt::format("    - [{}, {}]  # by {:.2g} mm\n", quoted(model.colliders[one.a].name),
                       quoted(model.colliders[one.b].name), 1000 * one.depth);
  }
  return out;
}

}  // namespace graze
