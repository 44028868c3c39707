#pragma once
// Where traces of a policy part: the contacts at which what happens next decides how a trace ends (§3.6.1, Figures 5,
// 6), found from the stories of many traces.
//
// A trace is followed by threads: the contacts of one part (a foot, the body) alone, or of one pair of parts alone, in
// their order. Traces whose thread has had the same contacts so far stand at the same node; its next contact (or that
// it has none until the trace's natural end) parts them. A node is a bifurcation if ends differ between its branches:
// Fisher's exact test (for large counts the chi-square test) of each branch against the rest and each class of ends
// against the rest, times their number, Holm's correction over all nodes. Ends are success and failure; or, if the
// rules say so, success, each requirement that was violated first, and an unmet objective. Among the bifurcations the
// earliest is taken that tells at least half as much about the end (mutual information) as the one that tells most; its
// branches are looked at in the same way, at half the error rate. So where ends hang on nothing that touches, a node is
// found with at most the probability `error_rate`.

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "analysis/quantiles.h"
#include "analysis/score.h"
#include "analysis/stories.h"

namespace graze {

struct EventTreeRules {
  double error_rate = 0.01;
  int depth = 4;                                           // bifurcations one below another at most
  std::uint64_t fewest = 5;                                // traces of a branch; smaller ones are put together
  bool kinds = false;                                      // kinds of failures are different ends
  double until = std::numeric_limits<double>::infinity();  // s: later contacts are not in the stories
};

/// How some traces ended.
struct OutcomeCounts {
  std::uint64_t n = 0, success = 0, unknown = 0;
  std::vector<std::uint64_t> violated;  // by requirement
  explicit OutcomeCounts(std::size_t requirements = 0) : violated(requirements) {}
  void add(const Story& story);
  double rate() const;        // of success; NaN: none
  Interval interval() const;  // 95 %, Clopper-Pearson
};

/// What a part does next: touches something, or nothing until the natural end of its trace.
struct EventBranch {
  enum class Kind { contact, nothing, others /* rare contacts together */, cut /* the trace ended before */ };
  Kind kind = Kind::contact;
  std::uint32_t word = 0;  // of a contact
  OutcomeCounts outcomes;
  Quantiles time{}, impulse{};      // s, N s: of the contact
  std::vector<std::size_t> traces;  // rows of Stories
  int node = -1;                    // bifurcation further down
};

/// A bifurcation.
struct EventNode {
  int part = 0;                     // whose contacts, row of CampaignInfo::colliders
  int with = -1;                    // only those with this part; -1: all
  std::vector<std::uint32_t> past;  // its contacts before, words
  double time = 0;                  // s: of the median trace, the earliest branch's
  double p_value = 1;               // after correction
  double information = 0;           // about the class of outcomes, as a share of what there is to know
  int depth = 0, parent = -1, parent_branch = -1;
  std::vector<EventBranch> branches;  // most traces first; `cut` last
};

struct EventTree {
  OutcomeCounts all;
  std::vector<EventNode> nodes;  // parents first
  std::uint64_t tested = 0;      // nodes that were looked at, in all
  bool kinds = false;            // kinds of failures were told apart
};

/// `parts`: which are followed, rows of CampaignInfo::colliders (moving_parts()). `end`: s, when traces end naturally.
EventTree event_tree(const Stories& stories, const std::vector<int>& parts, std::size_t requirements, double end,
                     const EventTreeRules& rules = {});

/// Parts of the robot and of movable objects.
std::vector<int> moving_parts(const CampaignInfo& info);

/// Of a policy of a campaign: all moving parts are followed; kinds of failures are told apart where no trace succeeds,
/// too. `stories` are read with features, at least.
EventTree event_tree(const Stories& stories, const CampaignInfo& info, EventTreeRules rules = {});

}  // namespace graze
