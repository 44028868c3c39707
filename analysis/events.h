#pragma once
// What `graze events` tells of a campaign: where behaviour divides, which contact sequences there are, what is new.

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/bifurcation_causes.h"
#include "analysis/sequences.h"

namespace graze {

struct EventsRequest {
  std::string name;                   // the archive as commands that are printed shall name it; empty: its path
  std::vector<std::string> policies;  // empty: all
  StoryRules rules;
  EventTreeRules tree;
  double cycle = 0;       // s, of a gait; 0: not told by cycles
  std::string reference;  // another archive of the same robot and world; empty: the policy's own successes
  /// In place of a reference: simulates the nominal trace of each of these policies, with its contact phases. Called
  /// when all has been read.
  std::function<std::vector<TraceRecord>(const std::vector<std::string>& policies)> nominal;
};

struct PolicyEvents {
  std::string policy;
  EventTree tree;                                      // words with features, at least
  std::vector<std::vector<BifurcationCauses>> causes;  // [node]; empty: CampaignEvents::no_causes says why
  std::vector<SequenceCount> sequences;
  std::vector<CycleCount> cycles;
  std::vector<Novelty> novelties;
  std::uint64_t reference = 0;                                // traces that novelties are told against
  std::optional<std::pair<Outcome, double /* s */>> nominal;  // how and when the nominal trace ended, if it is told
                                                              // against that
  /// About a bifurcation and a branch, [node][branch]: the sequence of all parts that most of its traces have from
  /// before until after the moment at which they part.
  struct Around {
    double from = 0, to = 0;  // s
    std::vector<std::uint32_t> words;
    std::uint64_t alike = 0, n = 0;
  };
  std::vector<std::vector<Around>> around;
  /// Near misses: the two parts of a contact that some branch has came near in traces that went another way: the least
  /// gap that a witness saw between them, where it was the nearest of its pairs.
  struct NearMiss {
    std::size_t node = 0, branch = 0;  // the branch that had the contact
    std::string witness;
    std::uint64_t n = 0, other = 0;  // traces of other branches whose margin is that of these parts; of all others
    Quantiles gap{};                 // m; positive: they did not touch
  };
  std::vector<NearMiss> near_misses;
};

struct CampaignEvents {
  std::string archive, campaign;
  bool complete = true;
  EventsRequest request;
  CampaignInfo info;
  std::vector<PolicyEvents> policies;
  ParticleTable parameters;  // that causes were looked for in: of the first 5,000 particles
  std::string no_causes;     // why none were
};

/// Throws NoStories: no phases in the archive; InputError: another robot in the reference, no such policy, an invalid
/// nominal trace.
CampaignEvents campaign_events(const Archive& archive, const EventsRequest& request);

/// For people; `most`: sequences and novelties listed of each kind.
std::string format_events(const CampaignEvents& events, std::size_t most);
std::string events_json(const CampaignEvents& events);
/// One line per sequence: policy, traces, outcomes, share of success with its interval, an example, the sequence.
std::string sequences_csv(const CampaignEvents& events);
/// One line per branch of a bifurcation: its traces, outcomes, time and impulse, and what explains it.
std::string branches_csv(const CampaignEvents& events);
/// One line per bifurcation, branch and parameter: the numbers of docs/statistics.md.
std::string causes_csv(const CampaignEvents& events);

}  // namespace graze
