#pragma once
// What `run` and `resume` share: simulate into an archive, heed signals, print the table.

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "archive/directory/finished.h"
#include "archive/directory/unfinished.h"
#include "jobs/campaign/ranks.h"
#include "jobs/cli/commands.h"

namespace graze {

/// Keeps the policies that the globs choose, in the order of the scenario (so that an archive does not depend on the
/// order in which they were asked for). No globs: all. Throws InputError with the nearest name.
void choose_policies(Scenario& scenario, const std::vector<std::string>& patterns);

struct Printing {
  bool json = false, quiet = false;
  std::string archive = {};              // as replay commands shall name it; empty: the directory
  std::function<void()> completed = {};  // what else there is to do with a complete campaign
  bool table = true;                     // print it
};

/// Whose fault it is: "by the fault of this machine, …", "because their controller …".
std::string why_unfinished(const std::vector<UnfinishedTrace>& traces);

/// Some lines, each begun by a line break: unfinished traces, why, and how to replay them.
std::string unfinished_text(const std::vector<UnfinishedTrace>& traces, const std::string& directory, bool trust);

/// Adds --watchdog, with its default, to a verb.
void add_watchdog(CLI::App& verb, double& seconds);

/// Simulates what is not finished yet and writes it, together with all ranks of the communicator. Signals
/// (jobs/campaign/signals.h) end it after the blocks under way. Prints the table of all that the archive holds, unless
/// a signal ended it. Returns the answer to the questions of --until: kDone, kGateMissed (one of them is refuted) or
/// kInconclusive. Throws MachineError if it was stopped, if traces are unfinished or if the disk fails; it says what is
/// kept and how to go on. Does not return (but leaves with that message and its exit code) if a thread hangs.
ExitCode simulate_into(CampaignWriter& writer, const Scenario& scenario, CampaignOptions options,
                       const CampaignInfo& info, const Printing& printing, Start& start,
                       const FinishedTraces& finished = {});

}  // namespace graze
