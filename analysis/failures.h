#pragma once
// Failed traces, each with the command that replays it.

#include <cstdint>
#include <iosfwd>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "archive/outcomes.h"

namespace graze {

/// One failed or flagged trace.
struct Failure {
  std::string policy;
  std::uint32_t particle = 0;
  Outcome outcome = Outcome::invalid;
  std::string what;  // the requirement that was violated first; "objective", met or not; why it is invalid
  double time = 0;   // s: of the violation, else of the end; NaN: not known
  double margin = 0;
  std::string unit = {};     // of the margin; of an objective: of the witness that gave it
  std::string culprit = {};  // the part that was below 0 first, or that missed the objective; empty: not to be told
  std::uint64_t alike = 1;   // traces of the policy that failed in the same way
  double unconverged = 0;    // share of its steps whose contacts did not converge; NaN: not known
  bool flagged = false;      // that is more than the scenario lets pass
  bool trust = false;        // needs_trust(), of its campaign
};

/// Whether the scenario of a campaign names code that runs with the user's rights: without --trust commands that
/// simulate it refuse it.
bool needs_trust(const CampaignInfo& info);
/// `graze replay …` for a shell; `trust`: needs_trust().
std::string replay_command(const std::string& archive, const std::string& policy, std::uint32_t particle,
                           bool trust = false);
/// `graze resume …` for a shell, as that.
std::string resume_command(const std::string& archive, bool trust);

/// The ways in which traces of a policy failed (a requirement, the objective, invalid): how many went each way and the
/// lowest particle among them, which stands for all.
class WaysToFail {
 public:
  /// In any order, each particle once.
  void add(const TraceOutcome& trace);
  /// By particle. Reads the rows of the particles that stand for all, no others.
  std::vector<Failure> firsts(const Archive& archive, const std::string& policy) const;

 private:
  struct Way {
    std::uint64_t traces = 0;
    std::uint32_t first = 0;  // particle
  };
  std::map<std::pair<Outcome, int>, Way> ways_;  // by outcome and violated requirement
};

/// The table of such failures, no more than `most` lines; `archive`: as replay commands shall name it; `list`: the
/// command that lists all.
std::string format_failures(const std::vector<Failure>& failures, const std::string& archive, const std::string& list,
                            std::size_t most);
/// Which traces are listed: all that failed; all that are flagged, successes among them.
enum class Listed { failures, flagged };

/// Every such trace under these policies, a line each, by policy and particle. `flagged`: with a column that tells
/// which are.
void list_traces(const Archive& archive, Listed which, const std::vector<std::string>& policies,
                 const std::string& name, bool flagged, std::ostream& out);
/// The same as the elements of a JSON array, without its brackets.
void list_traces_json(const Archive& archive, Listed which, const std::vector<std::string>& policies,
                      const std::string& name, std::ostream& out);
/// One failure as JSON.
std::string failure_json(const Failure& failure, const std::string& archive);

}  // namespace graze
