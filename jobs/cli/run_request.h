#pragma once
// What `graze run` is asked for, checked before anything is simulated. `submit` checks the same of the job that it
// queues, so that no job finds hours later what could have been said at once.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "archive/archive.h"
#include "jobs/campaign/campaign.h"
#include "jobs/cli/commands.h"

namespace graze {

/// The options of `graze run`.
struct RunArguments {
  ScenarioArguments scenario;
  DrawArguments draw;
  RecordArguments record;
  int threads = 0;
  double watchdog = 0;  // s
  std::vector<std::string> policies;
  std::vector<std::string> until;
  std::string confidence, part;
  std::string output;
  bool ignore_space = false, force = false, json = false, quiet = false;

  void add_to(CLI::App& verb);
};

/// A campaign that can begin.
struct RunRequest {
  Scenario scenario;  // with the policies that were chosen
  CampaignOptions options;
  CampaignInfo info;
  std::filesystem::path directory;              // where it is written
  std::optional<std::filesystem::path> packed;  // the file that it is packed into if the output ends in .h5
};

/// Reads the scenario and everything that was asked for; prints the scenario's warnings. Throws InputError for whatever
/// cannot be run. Looks neither at the directory nor at the disk.
RunRequest prepare_run(const RunArguments& arguments, const std::string& command_line);

/// Throws InputError for a name of an output that campaigns do not have: `x.txt`.
void check_campaign_output(const std::filesystem::path& output);

/// Throws MachineError if the campaign (or the part of it that was asked for) cannot fit on the disk of `directory`,
/// warns if it may not, unless it was told not to look. `packed`: it will be packed there, too.
void check_space(const RunArguments& arguments, const RunRequest& request, const std::filesystem::path& directory,
                 bool packed);

}  // namespace graze
