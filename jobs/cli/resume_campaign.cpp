#include "jobs/cli/resume_campaign.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/campaign_files.h"
#include "archive/directory/finished.h"
#include "archive/directory/newer_format.h"
#include "archive/directory/set_aside.h"
#include "archive/files/shell_word.h"
#include "engine/settings/paths.h"
#include "jobs/campaign/archived_scenario.h"
#include "jobs/campaign/describe_campaign.h"
#include "jobs/cli/size_estimate.h"
#include "jobs/workers/controllers.h"

namespace graze {
namespace {

/// As many as before, or more.
std::uint64_t number_of_particles(const ResumeArguments& arguments, const CampaignInfo& info) {
  if (arguments.particles == 0 || arguments.particles == info.particles) return info.particles;
  if (arguments.particles < info.particles) {
    throw InputError(
        fmt::format("-n {}: the campaign has {} particles; it can only grow", arguments.particles, info.particles));
  }
  if (info.part.end > 0) {
    throw InputError(fmt::format(
        "-n {}: this is one part of a campaign of {} particles; run more particles as a campaign of their own",
        arguments.particles, info.particles));
  }
  if (info.design == "latin_hypercube") {
    throw InputError(
        fmt::format("-n {}: a Latin hypercube of {} points has none of the points of one of {}; run the "
                    "scenario anew, or use the designs random or sobol for campaigns that grow",
                    arguments.particles, arguments.particles, info.particles));
  }
  return arguments.particles;
}

/// The campaign's policies and those that are asked for.
void choose(Scenario& scenario, const CampaignInfo& info, const std::vector<std::string>& added) {
  Scenario more = scenario;
  choose_policies(more, added.empty() ? info.policies : added);
  const auto kept = [&](const PolicySpec& policy) {
    const auto same = [&](const PolicySpec& other) { return other.name == policy.name; };
    return std::count(info.policies.begin(), info.policies.end(), policy.name) > 0 ||
           std::any_of(more.policies.begin(), more.policies.end(), same);
  };
  std::erase_if(scenario.policies, [&](const PolicySpec& policy) { return !kept(policy); });
}

/// A campaign that was stopped goes on with its questions. One that has its answers gets the number of particles that
/// it is asked for, and its questions are answered from these. `all`: they are answered from all particles alone.
UntilInfo ask_again(const CampaignInfo& before, std::uint64_t particles, bool all) {
  UntilInfo until = before.until;
  if (until.questions.empty()) return until;
  until.most = particles;
  if (until.answered_at > 0 || all) until.least = particles;
  until.answered_at = 0;
  return until;
}

/// A campaign that grows must fit.
void check_growth(Scenario scenario, const CampaignInfo& before, const CampaignInfo& after,
                  const std::string& directory) {
  const std::uint64_t traces = before.particles * before.policies.size();
  const std::uint64_t more = after.particles * after.policies.size() - traces;
  if (more == 0 || !after.until.questions.empty()) return;
  scenario.particles = (more + after.policies.size() - 1) / after.policies.size();
  check_space(estimate_size(scenario), directory, false);
}

/// Throws unless a campaign was described in a directory, or there is something that one may be made of.
void check_begun(const Directory& directory) {
  for (const char* name : {kDescriptionFile, kDescriptionCopy, kReplacingFolder, kReplacedFolder}) {
    if (directory.has(name)) return;
  }
  if (!shard_names(directory).empty()) return;
  const std::string path = directory.path().string();
  if (const auto writer = writer_of(directory)) {
    throw MachineError(fmt::format("{}: {} is just beginning a campaign here", path, *writer));
  }
  if (!only_begun(directory)) {
    throw InputError(no_campaign_text(directory));
  }
  throw InputError(
      fmt::format("{}: has no campaign to resume: none was begun, or it ended before it was described; 'graze run "
                  "SCENARIO -o {}' runs it from its start",
                  path, shell_path(path)));
}

/// The directory's lock, before anything there is read: what another writer changes meanwhile would be undone.
std::shared_ptr<const DirectoryLock> hold(const Directory& directory) {
  check_begun(directory);
  auto lock = std::make_shared<const DirectoryLock>(directory);
  refuse_newer_files(directory);
  if (recover_set_aside(directory)) {
    spdlog::warn("{}: the campaign that was to replace this one ended before it had a shard; this one is back",
                 directory.path().string());
  }
  return lock;
}

}  // namespace

ExitCode resume_campaign(const ResumeArguments& arguments, Start& start) {
  const std::string& directory = arguments.directory;
  if (!std::filesystem::is_directory(directory)) {
    if (!std::filesystem::exists(directory)) {
      throw InputError(directory + ": is not there" + path_suggestion(directory, {".graze"}));
    }
    throw InputError(fmt::format(
        "{}: is no campaign directory; packed files cannot go on, the directories that they were made of can",
        directory));
  }
  const auto lock = hold(std::filesystem::path(directory));
  const std::vector<DescriptionFile> descriptions = description_files(lock->directory());
  const CampaignInfo before = described_by(lock->directory(), descriptions);
  check_results_version(directory, before, "resume it with that program, or run the scenario anew");
  const ArchivedScenario archived(directory, before, "it cannot be resumed");
  Scenario scenario = archived.scenario();
  choose(scenario, before, arguments.policies);
  try_controllers(scenario);
  CampaignOptions options;
  options.particles = number_of_particles(arguments, before);
  options.part = before.part;
  options.seed = before.seed;
  options.threads = arguments.threads;
  options.watchdog = arguments.watchdog;
  CampaignInfo info = describe_campaign(scenario, options.particles, before.command_line);
  info.start_time = before.start_time;
  info.part = before.part;
  info.until = ask_again(before, options.particles, arguments.all);
  info.program_revision = before.program_revision;
  info.build = before.build;
  if (!arguments.ignore_space) check_growth(scenario, before, info, directory);
  if (!info.until.questions.empty()) check_stopping_rule(info);
  warn(clear_places(lock->directory(), descriptions));
  CampaignWriter writer(directory, info, {lock});
  const FinishedTraces finished = repair_and_list(lock->directory(), info);
  warn(finished.notes);
  if (!arguments.quiet && arguments.table) {
    spdlog::info("{}: {} of {} traces are there", directory, finished.count,
                 options.part.count(options.particles) * scenario.policies.size());
  }
  Printing printing{arguments.json, arguments.quiet};
  printing.table = arguments.table;
  return simulate_into(writer, scenario, options, info, printing, start, finished);
}

}  // namespace graze
