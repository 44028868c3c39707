#include "scenarios/overlaps.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/dynamics/dynamics_model.h"
#include "engine/settings/warnings.h"

namespace graze {
namespace {

using Overlap = Clearance::Overlap;

class Neighbours {
 public:
  explicit Neighbours(const Model& model) : model_(model), shaped_(model.bodies.size()), mass_(moving_mass(model)) {
    for (const Collider& collider : model.colliders) {
      if (collider.body >= 0) shaped_[static_cast<std::size_t>(collider.body)] = true;
    }
  }
  bool operator()(int a, int b) const { return hangs_on(a, b) || hangs_on(b, a); }

 private:
  /// Across bodies that are next to nothing.
  bool hangs_on(int body, int other) const {
    while (body >= 0) {
      body = model_.bodies[static_cast<std::size_t>(body)].parent;
      if (body == other) return true;
      if (body >= 0 && !next_to_nothing(static_cast<std::size_t>(body))) return false;
    }
    return false;
  }
  bool next_to_nothing(std::size_t body) const {
    constexpr double kNothing = 1e-3;  // of the mass
    return !shaped_[body] && model_.bodies[body].mass < kNothing * mass_;
  }

  const Model& model_;
  std::vector<bool> shaped_;
  double mass_;  // kg
};

void keep_apart(const Model& model, int a, int b, World& world) {
  world.contact.apart.emplace_back(model.colliders[static_cast<std::size_t>(a)].name,
                                   model.colliders[static_cast<std::size_t>(b)].name);
}

void ignore_overlaps(const Settings& wanted, const Model& model, World& world) {
  std::vector<Overlap> links =
      clearance_of_all_parts(model).overlaps(beginning(model, initial_state(world, model)), kBeginningLane);
  std::erase_if(links, [&](const Overlap& one) {
    const Collider &a = model.colliders[one.a], &b = model.colliders[one.b];
    const auto& apart = world.contact.apart;
    return a.is_object || b.is_object ||
           std::find(apart.begin(), apart.end(), std::pair(a.name, b.name)) != apart.end();
  });
  if (links.empty()) return;
  for (const Overlap& one : links) keep_apart(model, one.a, one.b, world);
  std::stable_sort(links.begin(), links.end(), [](const Overlap& a, const Overlap& b) { return a.depth > b.depth; });
  warn(wanted,
       fmt::format("{} of links begin in each other and never touch: {}",
                   links.size() == 1 ? "1 pair" : fmt::format("{} pairs", links.size()), overlaps_text(model, links)));
}

}  // namespace

BlockState beginning(const Model& model, const State& state) {
  BlockState out;
  out.q = BlockArray(model.nq);
  out.v = out.a = BlockArray(model.nv);
  out.X = BlockArray(12 * static_cast<int>(model.bodies.size()));
  out.q.set_column(kBeginningLane, state.q);
  out.v.set_column(kBeginningLane, state.v);
  const DynamicsModel robot(model);
  DynamicsData<double> data(robot);
  update_poses(data.tree(), state.q.data());
  for (int body = 0; body < robot.bodies(); ++body) {
    const PoseT<double>& X_WB = data.tree().pose[body];
    for (int i = 0; i < 9; ++i) out.X(12 * body + i, kBeginningLane) = X_WB.R.m[i];
    out.X.set_column(kBeginningLane, to_eigen(X_WB.p), 12 * body + 9);
  }
  return out;
}

Clearance clearance_of_all_parts(const Model& model) {
  const Parts all{std::vector<unsigned>(model.colliders.size(), ~0u)};
  return {model, all, all, 1e-3};
}

std::string overlaps_text(const Model& model, const std::vector<Overlap>& overlaps) {
  constexpr std::size_t kShown = 3;
  const auto length = [](double m) {
    return m < 0.1 ? fmt::format("{:.2g} mm", 1000 * m) : fmt::format("{:.3g} m", m);
  };
  std::string out;
  for (std::size_t i = 0; i < std::min(kShown, overlaps.size()); ++i) {
    out += fmt::format("{}{} and {} by {}", i > 0 ? ", " : "", model.colliders[overlaps[i].a].name,
                       model.colliders[overlaps[i].b].name, length(overlaps[i].depth));
  }
  if (overlaps.size() == kShown + 1) return out + " and 1 pair more";
  if (overlaps.size() > kShown) out += fmt::format(" and {} pairs more", overlaps.size() - kShown);
  return out;
}

std::string ignore_text(const Model& model, const std::vector<Overlap>& overlaps) {
  std::string out;
  for (const Overlap& one : overlaps) {
    out += fmt::format("{}[{}, {}]", out.empty() ? "" : ", ", model.colliders[one.a].name, model.colliders[one.b].name);
  }
  return "[" + out + "]";
}

bool keep_apart(const Settings& root, const Model& model, World& world) {
  const Neighbours neighbours(model);
  for (const ColliderPair& pair : model.pairs) {
    const Collider &a = model.colliders[pair.a], &b = model.colliders[pair.b];
    if (!a.is_object && !b.is_object && neighbours(a.body, b.body)) keep_apart(model, pair.a, pair.b, world);
  }
  const auto wanted = root.at("robot").find("ignore_initial_overlaps");
  if (wanted && wanted->flag()) ignore_overlaps(*wanted, model, world);
  return !world.contact.apart.empty();
}

}  // namespace graze
