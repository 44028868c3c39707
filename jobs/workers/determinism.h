#pragma once
// Whether controllers keep their promise: that a trace depends on (scenario, seed, particle) alone, and neither on the
// lane, nor on neighbours, nor on what was simulated before.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "scenarios/scenario.h"

namespace graze {

/// A trace that came out in two ways.
struct BrokenPromise {
  std::uint32_t particle;
  std::string company;  // "alone", "in other lanes, beside others"
  std::string difference;
};

struct PromiseReport {
  std::string policy;
  std::size_t particles = 0, comparisons = 0;
  std::vector<BrokenPromise> broken;
  std::size_t invalid = 0;     // of the first traces
  std::size_t unfinished = 0;  // of all traces: these compare with nothing
  std::size_t mixed_up = 0;    // blocks that failed, and none of their particles did when it was alone
  std::string failed = {};     // what the first of these threw
  std::size_t late = 0;        // of these: blocks that did not come back in time

  /// Whether there were valid traces at all: invalid ones say nothing of what the controller does.
  bool compared() const { return invalid < particles && comparisons > 0; }
};

/// Told of each simulation of a policy before it: "particle 3 alone", how many are done, of how many.
using SimulationBegins =
    std::function<void(const std::string& policy, const std::string& what, std::size_t done, std::size_t all)>;

/// Simulates a block of particles of each policy four times: as it is, again by the same controller, in reverse order
/// beside others, and each alone by a fresh controller. `ends` is given each policy's report as soon as it is there.
/// Throws InputError as try_controllers().
std::vector<PromiseReport> check_promises(const Scenario& scenario, double watchdog,
                                          const SimulationBegins& begins = {},
                                          const std::function<void(const PromiseReport&)>& ends = {});

/// As lines for people.
std::string promise_text(const PromiseReport& report);

}  // namespace graze
