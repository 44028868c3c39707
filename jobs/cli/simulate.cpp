#include "jobs/cli/simulate.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <new>

#include "analysis/score.h"
#include "archive/archive.h"
#include "archive/directory/campaign_directory.h"
#include "archive/directory/finished.h"
#include "archive/files/shell_word.h"
#include "archive/files/utf8.h"
#include "engine/library/library_use.h"
#include "jobs/campaign/signals.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/progress.h"
#include "simulation/contained.h"

namespace graze {
namespace {

/// Whether traces are on the disk, those included that were finished and not yet written.
bool keeps_traces(CampaignWriter& writer, const CampaignInfo& info) {
  try {
    writer.check_in_place();
    writer.flush();
    return traces_kept(writer.directory(), info) > 0;
  } catch (const MachineError&) {
    return false;
  }
}

/// The machine's failure, and what it has left.
std::string failed(CampaignWriter& writer, const CampaignInfo& info, const MachineError& error) {
  const std::string directory = writer.directory().string();
  try {
    writer.check_in_place();
  } catch (const MachineError&) {
    return error.what();  // what is found under the path is another's
  }
  try {
    writer.flush();  // what other threads have finished meanwhile
  } catch (const MachineError&) {
    // Perhaps the very disk that has failed: what it holds counts.
  }
  const std::uint64_t kept = traces_kept(writer.directory(), info);
  if (kept == 0) return fmt::format("{}; no trace had been written yet", error.what());
  return fmt::format("{}; {} of {} traces are kept, and '{}' does the rest when that is mended", error.what(), kept,
                     info.part.count(info.particles) * info.policies.size(),
                     resume_command(directory, needs_trust(info)));
}

/// Whether every trace is in the shards. What ranks say that they have simulated is no proof of what there is.
bool holds_all(const Archive& archive, std::uint64_t answered_at) {
  const CampaignInfo& info = archive.info();
  const std::uint64_t wanted = answered_at > 0 ? answered_at : info.part.count(info.particles);
  return std::all_of(info.policies.begin(), info.policies.end(), [&](const std::string& policy) {
    std::uint64_t found = 0;
    archive.scan(
        policy, 0, [&](const TraceRows& traces) { found += traces.size(); },
        [&](std::uint32_t particle, Outcome) { return answered_at == 0 || particle < answered_at; });
    return found == wanted;
  });
}

/// What was left undone without anything having failed.
std::string incomplete(const std::string& directory, const CampaignEnd& end, std::uint64_t failed_ranks,
                       const CampaignInfo& info) {
  const bool trust = needs_trust(info);
  const std::vector<UnfinishedTrace> unfinished = read_unfinished(std::filesystem::path(directory));
  std::string text;
  const std::string by = stop_signal().empty() ? "" : " by " + stop_signal();
  if (failed_ranks == 0 && end.stopped && unfinished.empty() && shard_names(std::filesystem::path(directory)).empty()) {
    return fmt::format("{}: stopped{} before any trace was finished; nothing is kept", directory, by);
  }
  if (failed_ranks > 0) {
    text =
        fmt::format("{} of the other ranks failed (their messages are above); what was finished is kept", failed_ranks);
  } else if (end.stopped) {
    text = fmt::format("stopped{} before the campaign was complete; what was finished is kept", by);
  }
  if (!unfinished.empty()) {
    text += fmt::format("{}traces unfinished {}: {}", text.empty() ? "" : "; ", why_unfinished(unfinished),
                        unfinished.size());
    if (!info.until.questions.empty()) {
      text +=
          "; --until ends with the first of them, since its next look at the answers would wait for it in vain, "
          "where a run without --until goes on";
    }
  }
  return fmt::format("{}: {}; '{}' does the rest{}", directory, text, resume_command(directory, trust),
                     unfinished_text(unfinished, directory, trust));
}

/// What there is to say about a campaign that is not complete, as an exception.
std::exception_ptr why_incomplete(CampaignWriter& writer, const CampaignInfo& info, const CampaignEnd& end,
                                  std::uint64_t failed_ranks, const Communicator& comm) {
  if (!end.error) {
    return std::make_exception_ptr(MachineError(incomplete(writer.directory().string(), end, failed_ranks, info)));
  }
  const auto told = [&](const MachineError& error) {
    const std::string who = comm.size() > 1 ? rank_name(comm) + ": " : "";
    return std::make_exception_ptr(MachineError(who + failed(writer, info, error)));
  };
  try {
    std::rethrow_exception(end.error);
  } catch (const MachineError& error) {
    return told(error);
  } catch (const InputError& error) {
    // It was taken when the campaign began: a file has changed since, such as a controller's.
    return keeps_traces(writer, info) ? told(MachineError(error.what())) : end.error;
  } catch (const std::bad_alloc&) {
    return told(MachineError("out of memory"));
  } catch (...) {
    return end.error;
  }
}

/// A refuted question outweighs an open one.
ExitCode verdict_of(const Score& score) {
  const auto any = [&](Verdict verdict) {
    return std::any_of(score.answers.begin(), score.answers.end(),
                       [&](const Answer& answer) { return answer.verdict == verdict_name(verdict); });
  };
  return any(Verdict::refuted) ? kGateMissed : any(Verdict::open) ? kInconclusive : kDone;
}

/// Prints the table of all that the archive holds.
void print_table(const Score& result, const Printing& printing) {
  std::cout << (printing.json ? score_json(result) + "\n" : format_score(result)) << std::flush;
  if (std::cout) return;
  const int error = errno;
  spdlog::warn("the table could not be printed; 'graze score' prints it again");
  if (error == EPIPE) std::cout.clear();  // a reader that has left does not miss it
}

/// A policy without a valid trace has no rate: whatever fails all robots is told in full, where the table has no room.
void tell_of_invalid(const Score& result) {
  for (const PolicyScore& policy : result.policies) {
    if (policy.n > 0 || policy.invalid == 0) continue;
    const auto first = std::ranges::find_if(result.failures, [&](const Failure& one) {
      return one.policy == policy.policy && one.outcome == Outcome::invalid;
    });
    const std::string why = first == result.failures.end() ? "" : "; the first: " + printable(first->what);
    spdlog::warn("policy {}: no trace of {} is valid, so there is no rate{}", printable(policy.policy), policy.invalid,
                 why);
  }
}

/// A controller of the user's own under which no robot does its task is wrong more often than all of these robots are.
void tell_of_failing_controllers(const Scenario& scenario, const Score& result) {
  for (const PolicyScore& policy : result.policies) {
    if (policy.n == 0 || policy.success > 0) continue;
    const auto spec =
        std::ranges::find_if(scenario.policies, [&](const PolicySpec& one) { return one.name == policy.policy; });
    if (spec == scenario.policies.end() || !is_from_outside(spec->settings)) continue;
    std::cout << fmt::format(
        "policy {}: none of {} traces succeeds; 'graze check --trust' of the scenario tells whether its controller "
        "leaves the joints limp or keeps them at their limits\n",
        printable(policy.policy), policy.n);
  }
}

/// Marks the campaign, prints its table, and returns its exit code.
ExitCode close(CampaignWriter& writer, const Scenario& scenario, bool complete, std::uint64_t answered_at,
               const Printing& printing) {
  writer.check_in_place();
  if (complete && !holds_all(Archive(writer.directory(), Seals::trusted), answered_at)) {
    throw MachineError(fmt::format("{}: finished traces are gone: something else has changed the campaign's files",
                                   writer.directory().string()));
  }
  writer.finish(complete, answered_at);
  // The table takes as long as it takes to read everything, which the sender of a signal may not grant.
  if (!complete && !stop_signal().empty()) return kMachineFailed;
  const Score result = score(Archive(writer.directory()), printing.archive);
  if (printing.table) print_table(result, printing);
  tell_of_invalid(result);
  if (printing.table && !printing.json) tell_of_failing_controllers(scenario, result);
  if (!complete) return kMachineFailed;
  if (printing.completed) printing.completed();
  return verdict_of(result);
}

}  // namespace

void choose_policies(Scenario& scenario, const std::vector<std::string>& patterns) {
  std::vector<std::string> names;
  for (const PolicySpec& policy : scenario.policies) names.push_back(policy.name);
  const std::vector<std::string> chosen = chosen_names(names, patterns, scenario.file);
  std::erase_if(scenario.policies, [&](const PolicySpec& policy) {
    return std::find(chosen.begin(), chosen.end(), policy.name) == chosen.end();
  });
}

std::string why_unfinished(const std::vector<UnfinishedTrace>& traces) {
  const auto by_controllers =
      std::count_if(traces.begin(), traces.end(), [](const UnfinishedTrace& one) { return one.by_controller; });
  if (by_controllers == 0) return "by the fault of this machine, not of the robot";
  const std::string text = "because their controller did not come back, so that nobody knows how they end";
  return by_controllers == std::ssize(traces) ? text : text + ", or by the fault of this machine";
}

std::string unfinished_text(const std::vector<UnfinishedTrace>& traces, const std::string& directory, bool trust) {
  constexpr std::size_t kMost = 20;
  std::string text;
  for (std::size_t i = 0; i < std::min(traces.size(), kMost); ++i) {
    const UnfinishedTrace& trace = traces[i];
    text += fmt::format("\n  policy {}, particle {}: {}; {} --unverified", trace.policy, trace.particle, trace.reason,
                        replay_command(directory, trace.policy, trace.particle, trust));
  }
  if (traces.size() > kMost) text += fmt::format("\n  … all {}: {}/{}", traces.size(), directory, kUnfinishedFile);
  return text;
}

void add_watchdog(CLI::App& verb, double& seconds) {
  seconds = 600;
  add_read_option(
      verb, "--watchdog",
      "Cut off a trace that takes longer than this on the clock (0.01 at the least), leave it unfinished and go on; "
      "0: never",
      [&seconds](const std::string& text, const std::string& option) {
        seconds = parse_seconds(text, option, kShortestWatchdog, 1e8);
      })
      ->type_name("SECONDS")
      ->default_str("600");
}

ExitCode simulate_into(CampaignWriter& writer, const Scenario& scenario, CampaignOptions options,
                       const CampaignInfo& info, const Printing& printing, Start& start,
                       const FinishedTraces& finished) {
  Communicator& comm = start.comm();
  const std::string directory = writer.directory().string();
  set_out(options, writer, finished);
  if (options.threads == 0) options.threads = default_threads();
  options.workers = static_cast<std::uint64_t>(options.threads) * static_cast<std::uint64_t>(comm.size());
  std::optional<StoppingRule> rule;
  if (!info.until.questions.empty()) {
    rule.emplace(comm, info);
    if (options.finished > 0) rule->count_finished(Archive(writer.directory()));
    if (rule->answered_at() > 0) stop_all(comm);  // by what is there already
    options.stopping_rule = &*rule;
  }
  const std::uint64_t total = options.part.count(options.particles) * scenario.policies.size() - options.finished;
  start.give({std::filesystem::absolute(directory), options.particles, options.workers, options.watchdog,
              writer.shards(), finished.done});
  CampaignEnd end;
  {
    const ProgressReport report(comm, total, printing.quiet, options.stopping_rule);
    end = together(comm, [&] { return run_share(scenario, options, comm, writer); });
  }
  const std::uint64_t answered_at = rule ? rule->answered_at() : 0;
  const std::uint64_t failed_ranks = comm.read(kFailedRanks, 1).front();
  const bool complete = failed_ranks == 0 && (answered_at > 0 || progress_of(comm).traces == total);
  ExitCode code = kMachineFailed;
  try {
    if (!end.error) code = close(writer, scenario, complete, answered_at, printing);
  } catch (...) {
    end.error = std::current_exception();
  }
  if (complete && !end.error && end.hanging.empty()) return code;
  if (end.hanging.empty()) std::rethrow_exception(why_incomplete(writer, info, end, failed_ranks, comm));
  if (!complete || end.error) code = report_error(why_incomplete(writer, info, end, failed_ranks, comm));
  leave_hanging(comm, code);
}

}  // namespace graze
