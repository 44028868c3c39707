#include "analysis/bifurcation_causes.h"

#include <limits>

namespace graze {
namespace {

/// Branches that are asked about. What distinguishes one of two branches distinguishes the other.
std::vector<std::size_t> asked_branches(const EventNode& node) {
  std::vector<std::size_t> out;
  for (std::size_t b = 0; b < node.branches.size(); ++b) {
    if (node.branches[b].kind != EventBranch::Kind::cut) out.push_back(b);
  }
  if (out.size() != 2) return out;
  const bool second = node.branches[out[0]].kind != EventBranch::Kind::contact &&
                      node.branches[out[1]].kind == EventBranch::Kind::contact;
  return {out[second ? 1 : 0]};
}

/// 1: takes the branch; 0: takes another one; NaN: does not stand at the node, was cut off before, or has no values.
std::vector<double> ways(const EventNode& node, std::size_t asked, const Stories& stories,
                         const ParticleValues& values) {
  std::vector<double> out(values.particles.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t b = 0; b < node.branches.size(); ++b) {
    if (node.branches[b].kind == EventBranch::Kind::cut) continue;
    for (const std::size_t trace : node.branches[b].traces) {
      const std::size_t row = values.row_of(stories[trace].particle);
      if (row < out.size()) out[row] = b == asked ? 1 : 0;
    }
  }
  return out;
}

}  // namespace

std::vector<std::vector<BifurcationCauses>> bifurcation_causes(const EventTree& tree, const Stories& stories,
                                                               const EventWords& words, const ParticleValues& values) {
  std::vector<std::vector<BifurcationCauses>> out(tree.nodes.size());
  std::vector<CauseTarget> targets;
  for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
    const EventNode& node = tree.nodes[n];
    for (const std::size_t b : asked_branches(node)) {
      out[n].push_back({b, {}});
      targets.push_back({"bifurcation at " + words.place(tree, n) + ": " + words.branch(node.branches[b]),
                         ways(node, b, stories, values)});
    }
  }
  std::vector<Causes> found = find_causes(values.table, targets);
  std::size_t next = 0;
  for (auto& of_node : out) {
    for (BifurcationCauses& one : of_node) one.causes = std::move(found[next++]);
  }
  return out;
}

}  // namespace graze
