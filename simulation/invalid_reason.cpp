#include "simulation/invalid_reason.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

namespace graze {
namespace {

/// A pair that touches: its deepest point, and what all its points press with.
struct Touch {
  int a = 0, b = 0;
  double depth = 0;    // m
  double impulse = 0;  // N s
};

/// Less than that is no overlap, but what a contact may leave, m.
constexpr double kTold = 1e-4;
/// More pairs than that are not told, of either kind.
constexpr std::size_t kShown = 2;

std::vector<Touch> touches_of(const BlockPhysics& physics, int lane) {
  std::map<std::pair<int, int>, Touch> pairs;
  for (const Contact& contact : physics.contacts(lane)) {
    if (contact.phi > 0 && !(contact.normal_impulse() > 0)) continue;
    Touch& touch = pairs.try_emplace({contact.a, contact.b}, Touch{contact.a, contact.b, 0, 0}).first->second;
    // Numbers that are none (the state has left the range of a double) tell nothing.
    if (contact.phi < -touch.depth) touch.depth = -contact.phi;
    if (contact.normal_impulse() > 0) touch.impulse += contact.normal_impulse();
  }
  std::vector<Touch> out;
  for (const auto& [key, touch] : pairs) out.push_back(touch);
  return out;
}

/// The first few by `number`, as far as it is more than `least`.
template <class Number>
std::vector<Touch> most(std::vector<Touch> touches, double least, const Number& number) {
  std::erase_if(touches, [&](const Touch& touch) { return !(number(touch) > least); });
  std::stable_sort(touches.begin(), touches.end(),
                   [&](const Touch& x, const Touch& y) { return number(x) > number(y); });
  touches.resize(std::min(touches.size(), kShown));
  return touches;
}

/// N m: torques above are told as the cause of what follows; no robot's joint has a tenth of it (our choice).
constexpr double kBeyondMotors = 1e5;

std::string culprits(const Model& model, const std::vector<Touch>& touches) {
  std::vector<std::string> parts;
  const auto name = [&](int collider) -> const std::string& {
    return model.colliders[static_cast<std::size_t>(collider)].name;
  };
  for (const Touch& touch : most(touches, kTold, [](const Touch& x) { return x.depth; })) {
    parts.push_back(fmt::format("'{}' in '{}' by {:.2g} mm", name(touch.a), name(touch.b), 1000 * touch.depth));
  }
  for (const Touch& touch : most(touches, 0, [](const Touch& x) { return x.impulse; })) {
    parts.push_back(fmt::format("'{}' against '{}' with {:.2g} N s", name(touch.a), name(touch.b), touch.impulse));
  }
  if (parts.empty()) return touches.empty() ? "nothing touched" : "";
  std::string out = parts.front();
  for (std::size_t i = 1; i < parts.size(); ++i) out += ", " + parts[i];
  return out;
}

}  // namespace

std::string invalid_reason(const std::string& fault, std::uint32_t step, double time, const Model& model,
                           const BlockPhysics& physics, int lane) {
  const std::string who = culprits(model, touches_of(physics, lane));
  return fmt::format("step {} ({:.6g} s){}{}: {}", step, time, who.empty() ? "" : ", ", who, fault);
}

std::string controller_failure(const Model& model, const ActuatorCommand& command, int lane) {
  const auto joint = [&](int k) -> const std::string& { return model.bodies[model.actuated[k]].joint; };
  const std::pair<const char*, const BlockArray*> asked[] = {{"torque", &command.tau}, {"position", &command.q},
                                                             {"velocity", &command.v}, {"stiffness", &command.kp},
                                                             {"damping", &command.kd}, {"integral gain", &command.ki}};
  int most = -1;
  for (int k = 0; k < command.tau.rows(); ++k) {
    for (const auto& [what, rows] : asked) {
      if (std::isfinite((*rows)(k, lane))) continue;
      return fmt::format("the controller asks joint {} for a {} that is not finite: ", joint(k), what);
    }
    if (most < 0 || std::abs(command.tau(k, lane)) > std::abs(command.tau(most, lane))) most = k;
  }
  if (most < 0 || std::abs(command.tau(most, lane)) < kBeyondMotors) return "";
  return fmt::format("the controller asks joint {} for {:.2g} N m: ", joint(most), command.tau(most, lane));
}

}  // namespace graze
