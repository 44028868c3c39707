#include "jobs/simulate.h"

#include <fmt/format.h>

#include <atomic>
#include <csignal>
#include <iostream>

#include "analysis/score.h"
#include "jobs/progress.h"

namespace graze {
namespace {

std::atomic<bool> stop_requested{false};

void request_stop(int) { stop_requested = true; }

/// A refuted question outweighs an open one.
ExitCode verdict_of(const Score& score) {
  const auto any = [&](Verdict verdict) {
    return std::any_of(score.answers.begin(), score.answers.end(),
                       [&](const Answer& answer) { return answer.verdict == verdict_name(verdict); });
  };
  return any(Verdict::refuted) ? kGateMissed : any(Verdict::open) ? kInconclusive : kDone;
}

}  // namespace

void choose_policies(Scenario& scenario, const std::vector<std::string>& patterns) {
  if (patterns.empty()) return;
  std::vector<std::string> names;
  for (const PolicySpec& policy : scenario.policies) names.push_back(policy.name);
  for (const std::string& pattern : patterns) {
    const auto chosen = [&](const std::string& name) { return matches(pattern, name); };
    if (std::none_of(names.begin(), names.end(), chosen)) {
      throw InputError(fmt::format("--policy {}: no policy of that name in {}; nearest: {}", pattern, scenario.file,
                                   nearest(pattern, names)));
    }
  }
  std::erase_if(scenario.policies, [&](const PolicySpec& policy) {
    return std::none_of(patterns.begin(), patterns.end(),
                        [&](const std::string& pattern) { return matches(pattern, policy.name); });
  });
}

ExitCode simulate_into(CampaignWriter& writer, const Scenario& scenario, CampaignOptions options,
                       const CampaignInfo& info, const Printing& printing) {
  options.stop = &stop_requested;
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  const std::unique_ptr<Crew> crew = make_local_crew();
  std::optional<Looks> looks;
  if (!info.until.questions.empty()) {
    looks.emplace(*crew, info);
    if (options.finished > 0) looks->count_finished(Archive(writer.directory()));
    options.looks = &*looks;
  }
  bool complete = false;
  if (looks && looks->answered_at() > 0) {
    complete = true;  // by what is there already
  } else {
    const std::uint64_t total = options.particles * scenario.policies.size() - options.finished;
    const ProgressReport report(*crew, total, printing.quiet);
    complete = run_campaign(scenario, options, *crew,
                            [&](int policy, std::vector<TraceRecord> traces, std::vector<double> values) {
                              writer.append(policy, std::move(traces), std::move(values));
                            });
  }
  writer.finish(complete, looks ? looks->answered_at() : 0);
  const Score result = score(Archive(writer.directory()));
  std::cout << (printing.json ? score_json(result) + "\n" : format_score(result));
  if (complete) return verdict_of(result);
  const std::string directory = writer.directory().string();
  throw MachineError(
      fmt::format("{}: stopped before the campaign was complete; what was finished is kept, and 'graze resume {}' does "
                  "the rest",
                  directory, directory));
}

}  // namespace graze
