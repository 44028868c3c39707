#pragma once
// Which parameters decide which way traces go at a bifurcation: find_causes() asked about the branches of each node of
// an event tree. docs/statistics.md says what the numbers mean and how often they are wrong.

#include <cstddef>
#include <vector>

#include "analysis/causes.h"
#include "analysis/event_tree.h"
#include "analysis/events_words.h"
#include "analysis/particle_values.h"

namespace graze {

/// Causes are looked for among the first so many particles: rank tests of 100,000 miss nothing that matters, and the
/// table of a larger campaign may not fit in memory.
inline constexpr std::uint64_t kMostExplained = 100'000;

/// What explains that traces at a node take a branch (1) and not another one (0).
struct BifurcationCauses {
  std::size_t branch = 0;  // of EventNode::branches
  Causes causes;
};

/// [node]: a question for each branch, of two branches for one; none about `cut`, whose traces do not count. Corrected
/// for all parameters of all questions of the tree: where no parameter matters, any is called significant in at most
/// 5 % of calls. `stories`: those that the tree was grown from; `words` tell them; `values` has columns and rows.
std::vector<std::vector<BifurcationCauses>> bifurcation_causes(const EventTree& tree, const Stories& stories,
                                                               const EventWords& words, const ParticleValues& values);

}  // namespace graze
