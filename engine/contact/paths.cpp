#include "engine/contact/paths.h"

#include <algorithm>
#include <functional>

namespace graze {

std::vector<int> mimic_dofs(const Model& model, const TopologyView& topology) {
  std::vector<int> out;
  for (const Body& body : model.bodies) {
    if (body.mimics < 0) continue;
    for (int dof : {body.v, model.bodies[body.mimics].v}) {
      for (; dof >= 0; dof = topology.dof_parent[dof]) out.push_back(dof);
    }
  }
  std::sort(out.rbegin(), out.rend());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

bool Paths::add_mimics(std::vector<int>& dofs) const {
  const auto moved = [&](int dof) {
    return std::binary_search(mimic_dofs_.begin(), mimic_dofs_.end(), dof, std::greater<>());
  };
  if (std::none_of(dofs.begin(), dofs.end(), moved)) return false;
  dofs.insert(dofs.end(), mimic_dofs_.begin(), mimic_dofs_.end());
  std::sort(dofs.rbegin(), dofs.rend());
  dofs.erase(std::unique(dofs.begin(), dofs.end()), dofs.end());
  return true;
}

JointPathView Paths::joint(int dof) {
  const int* chain = topology_.chain + topology_.row[dof];
  const int count = topology_.dof_depth[dof] + 1;
  std::vector<int> dofs(chain, chain + count);
  if (!add_mimics(dofs)) return {count, chain, false};
  const std::vector<int>& kept = joint_dofs_.emplace_back(std::move(dofs));
  return {static_cast<int>(kept.size()), kept.data(), true};
}

int Paths::add(int body_a, int body_b) {
  const auto [place, fresh] = index_.try_emplace({body_a, body_b}, static_cast<int>(views_.size()));
  if (!fresh) return place->second;
  std::map<int, int> sides;  // body -> sum of its signs
  for (int b = body_a; b >= 0; b = topology_.parent[b]) sides[b] += 1;
  for (int b = body_b; b >= 0; b = topology_.parent[b]) sides[b] -= 1;
  Table& table = tables_.emplace_back();
  for (const auto& [body, sign] : sides) {
    const int count = topology_.kind[body] == kFloating ? 6 : 1;
    for (int k = 0; k < count; ++k) table.dofs.push_back(topology_.v[body] + k);
    if (sign == 0) continue;
    table.bodies.push_back(body);
    table.signs.push_back(sign);
  }
  const bool mimics = add_mimics(table.dofs);
  std::sort(table.dofs.rbegin(), table.dofs.rend());
  int base = -1;
  const int root_a = body_a < 0 ? -1 : topology_.root[body_a], root_b = body_b < 0 ? -1 : topology_.root[body_b];
  const bool one_tree = body_a < 0 || body_b < 0 || root_a == root_b;
  if (one_tree && std::max(root_a, root_b) >= 0) base = topology_.v[std::max(root_a, root_b)];
  views_.push_back({static_cast<int>(table.dofs.size()), table.dofs.data(), static_cast<int>(table.bodies.size()),
                    table.bodies.data(), table.signs.data(), body_a, body_b,
                    mimics || table.bodies.size() < sides.size(), base, mimics});
  return place->second;
}

}  // namespace graze
