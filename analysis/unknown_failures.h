#pragma once
// Unknown failures: traces that violated nothing and still missed the objective. Which kinds of them there are, a
// typical trace of each, and a requirement that would have caught it.

#include <cstdint>
#include <string>
#include <vector>

#include "archive/archive.h"

namespace graze {

/// One number in which a kind of failures differs from the successes.
struct Trait {
  std::string name, unit;          // "base.z", "m"
  double here = 0, successes = 0;  // medians
  double deviation = 0;  // of `here`, in robust standard deviations of the successes (or of all failures, if none)
};

/// A requirement, chosen on the traces of even particles and tried on those of odd ones.
struct ProposedWitness {
  std::string yaml;                         // "no_contact: [BODY0, curb]", as under task.requirements
  std::uint64_t caught = 0, of = 0;         // odd traces of this kind
  std::uint64_t alarms = 0, successes = 0;  // odd successes
  bool in_objective = false;                // the objective judges the same quantity: it says nothing new
};

struct FailureKind {
  std::uint64_t traces = 0;
  std::uint32_t typical = 0;             // particle: of the trace nearest to all others of its kind
  std::vector<std::uint32_t> particles;  // by particle
  std::vector<Trait> traits;             // the most telling first
  bool tried = false;                    // there were enough traces of it and of successes to look for a requirement
  /// The best first, those that the objective judges already behind all others; empty: none catches more than half of
  /// it with fewer alarms.
  std::vector<ProposedWitness> witnesses;
};

struct UnknownFailures {
  std::string policy;
  bool trust = false;                                      // needs_trust(), of the campaign
  std::uint64_t traces = 0, successes = 0, looked_at = 0;  // looked_at: of the unknown failures, the first so many
  double silhouette = 0;                                   // of the division into kinds, -1 … 1; 0 if there is one
  std::vector<FailureKind> kinds;                          // most traces first
};

/// Kinds by final state, margins, and impulses between parts: k-medoids over robustly standardised numbers; as many
/// kinds (at most six) as give the largest mean silhouette (Rousseeuw 1987), one unless that exceeds 0.25.
UnknownFailures unknown_failures(const Archive& archive, const std::string& policy);

/// `complete`: whether the campaign is; if not, that is told first.
std::string format_unknown_failures(const std::vector<UnknownFailures>& all, const std::string& archive, bool complete);
std::string unknown_failures_json(const std::vector<UnknownFailures>& all, const std::string& archive, bool complete);

}  // namespace graze
