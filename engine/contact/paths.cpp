#include "engine/contact/paths.h"

#include <algorithm>

namespace graze {

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
  std::sort(table.dofs.rbegin(), table.dofs.rend());
  int base = -1;
  const int root_a = body_a < 0 ? -1 : topology_.root[body_a], root_b = body_b < 0 ? -1 : topology_.root[body_b];
  const bool one_tree = body_a < 0 || body_b < 0 || root_a == root_b;
  if (one_tree && std::max(root_a, root_b) >= 0) base = topology_.v[std::max(root_a, root_b)];
  views_.push_back({static_cast<int>(table.dofs.size()), table.dofs.data(), static_cast<int>(table.bodies.size()),
                    table.bodies.data(), table.signs.data(), body_a, body_b, table.bodies.size() < sides.size(), base});
  return place->second;
}

}  // namespace graze
