#include "engine/model/newton_limit.h"

#include <algorithm>
#include <vector>

#include "engine/model/model.h"

namespace graze {

bool is_deep_tree(const Model& model) {
  std::vector<int> depth;
  bool follows = false;
  for (const Body& body : model.bodies) {  // parents come before their children
    const int own = body.type == JointType::floating ? 6 : 1;
    depth.push_back(own + (body.parent < 0 ? 0 : depth[static_cast<std::size_t>(body.parent)]));
    follows = follows || body.mimics >= 0;
  }
  return !follows && !depth.empty() && *std::max_element(depth.begin(), depth.end()) >= kDeepTree;
}

}  // namespace graze
