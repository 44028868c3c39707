// graze score: how often each policy succeeds, how it fails, whether policies differ, and gates for CI.
#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>

#include "analysis/score.h"
#include "analysis/sequential.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/reading_verb.h"
#include "jobs/cli/score_cases.h"
#include "jobs/cli/shared_options.h"

namespace graze {
namespace {

struct ScoreArguments {
  std::vector<std::string> archives;
  std::vector<std::string> require;
  std::vector<std::string> policies;
  std::string junit;
  bool failures = false, flagged = false, json = false;
};

/// A missed gate outweighs an inconclusive one.
ExitCode worse(ExitCode a, ExitCode b) {
  if (a == kGateMissed || b == kGateMissed) return kGateMissed;
  return a == kDone ? b : a;
}

std::vector<std::string> policies_of(const Score& score) {
  std::vector<std::string> names;
  for (const PolicyScore& policy : score.policies) names.push_back(policy.policy);
  return names;
}

/// The score with every failure or flagged trace, streamed: there may be more of them than memory holds.
void print_json(const Archive& archive, const Score& result, const ScoreArguments& arguments) {
  std::string text = score_json(result, !arguments.failures);
  if (!arguments.failures && !arguments.flagged) {
    std::cout << text;
    return;
  }
  text.resize(text.rfind('}'));
  while (text.back() == '\n') text.pop_back();
  std::cout << text;
  const auto list = [&](const char* head, Listed which) {
    std::cout << ",\n  " << head << ": [";
    list_traces_json(archive, which, policies_of(result), result.archive, std::cout);
    std::cout << "\n  ]";
  };
  if (arguments.failures) list("\"failures_listed\": \"all\",\n  \"failures\"", Listed::failures);
  if (arguments.flagged) list("\"flagged\"", Listed::flagged);
  std::cout << "\n}";
}

void print_text(const Archive& archive, const Score& result, const ScoreArguments& arguments) {
  const bool lists = arguments.failures || arguments.flagged;
  std::cout << format_score(result, !lists);
  const bool flagged = std::any_of(result.policies.begin(), result.policies.end(),
                                   [](const PolicyScore& policy) { return policy.convergence.flagged_all() > 0; });
  if (arguments.failures) {
    std::cout << "\nFailures\n";
    list_traces(archive, Listed::failures, policies_of(result), result.archive, flagged, std::cout);
  }
  if (arguments.flagged) {
    std::cout << "\nFlagged traces\n";
    list_traces(archive, Listed::flagged, policies_of(result), result.archive, true, std::cout);
  }
}

/// An archive, and the policies of it that are asked about.
struct Asked {
  std::unique_ptr<const Archive> archive;
  std::vector<std::string> policies;
};

/// Opens all of them: what one of them must refuse is said before another one's table is printed.
std::vector<Asked> open_all(const ScoreArguments& arguments, const std::vector<Question>& gates) {
  std::vector<Asked> out;
  for (const std::string& file : arguments.archives) {
    auto archive = std::make_unique<const Archive>(file);
    warn(archive->warnings());
    std::vector<std::string> policies = chosen_names(archive->info().policies, arguments.policies, file);
    check_selectors(gates, policies, "--require");
    out.push_back({std::move(archive), std::move(policies)});
  }
  return out;
}

int score_archives(const ScoreArguments& arguments) {
  std::vector<Question> gates;
  for (const std::string& text : arguments.require) gates.push_back(parse_question(text, "--require"));
  if (!arguments.junit.empty()) check_junit_output(arguments.junit, arguments.archives);
  const std::vector<Asked> asked = open_all(arguments, gates);
  ExitCode code = kDone;
  const bool several = asked.size() > 1;
  std::vector<TestSuite> suites;
  if (arguments.json && several) std::cout << "[\n";
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const Archive& archive = *asked[i].archive;
    const Score result = score(archive, "", asked[i].policies);
    if (arguments.json) {
      if (i > 0) std::cout << ",\n";
      print_json(archive, result, arguments);
    } else {
      if (several) std::cout << arguments.archives[i] << "\n";
      print_text(archive, result, arguments);
      if (several) std::cout << "\n";
    }
    const std::vector<Judged> judged = judge_all(gates, result);
    for (const Judged& one : judged) {
      (arguments.json ? std::cerr : std::cout) << one.text << "\n";
      code = worse(code, one.code);
    }
    // What is missing may answer what is open.
    if (!result.complete && code != kGateMissed) code = kMachineFailed;
    const std::string name = several ? fmt::format("{} ({})", result.campaign, arguments.archives[i]) : result.campaign;
    suites.push_back(score_cases(name, result, judged));
  }
  if (!arguments.junit.empty()) write_junit(arguments.junit, suites);
  if (arguments.json) std::cout << (several ? "\n]\n" : "\n");
  return code;
}

}  // namespace

void add_score(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<ScoreArguments>();
  CLI::App* verb = add_verb(
      app, "score", "Success rates with intervals, failures by requirement, paired comparison, what did not converge",
      "  graze score quadruped_curb.graze\n"
      "  graze score curb.h5 --json\n"
      "  graze score curb.h5 --policy 'step/4cm' --require 'p >= 0.9'   # a gate for CI\n"
      "  graze score curb.h5 --require 'p >= 0.9' --junit score.xml      # for what a CI system shows\n"
      "  graze score curb.h5 --failures                                  # with replay commands\n");
  verb->add_option("archives", arguments->archives, "Campaign directories or packed files")->required();
  verb->add_option("--require", arguments->require,
                   "Gate: '[POLICY:] p >= RATE', 'p < RATE' or 'ci < WIDTH'; exit 0 if it holds for the whole 95 % "
                   "interval, 1 if it is refuted, 4 if the interval straddles it (may be repeated: all of them)")
      ->type_name("QUESTION")
      ->allow_extra_args(false);
  add_policies(*verb, arguments->policies);
  verb->add_option("--junit", arguments->junit,
                   "Also write gates, requirements and objective as test cases (JUnit XML), for CI systems; replaces "
                   "such a file")
      ->type_name("FILE");
  verb->add_flag("--failures", arguments->failures, "List every failed trace, each with its replay command");
  verb->add_flag("--flagged", arguments->flagged,
                 "List every trace with more unconverged steps than the scenario lets pass, successes among them, each "
                 "with its replay command");
  verb->add_flag("--json", arguments->json, "Print JSON");
  verb->callback([arguments, &action] {
    action = [arguments] { return in_reading_child(arguments->archives, [&] { return score_archives(*arguments); }); };
  });
}

}  // namespace graze
