// graze score: how often each policy succeeds, how it fails, whether policies differ, and gates for CI.
#include <fmt/format.h>

#include <iostream>
#include <memory>
#include <sstream>

#include "analysis/score.h"
#include "jobs/commands.h"

namespace graze {
namespace {

struct Arguments {
  std::vector<std::string> archives;
  std::vector<std::string> require;
  std::string policy = "*";
  bool failures = false, json = false;
};

/// `p >= 0.9`: the success rate of each chosen policy must reach a bound.
struct Gate {
  double bound;
  std::string text;
};

Gate parse_gate(const std::string& text) {
  std::istringstream in(text);
  std::string name, relation, rest;
  Gate gate{0, text};
  if (!(in >> name >> relation >> gate.bound) || (in >> rest) || name != "p" || relation != ">=" ||
      !(gate.bound >= 0 && gate.bound <= 1)) {
    throw InputError(fmt::format("--require '{}': not of the form 'p >= RATE' with a rate from 0 to 1", text));
  }
  return gate;
}

/// Met when the whole interval lies at or above the bound, missed when all of it lies below, else inconclusive.
ExitCode judge(const Gate& gate, const PolicyScore& policy) {
  if (policy.interval.low >= gate.bound) return kDone;
  return policy.interval.high < gate.bound ? kGateMissed : kInconclusive;
}

/// A missed gate outweighs an inconclusive one.
ExitCode worse(ExitCode a, ExitCode b) {
  if (a == kGateMissed || b == kGateMissed) return kGateMissed;
  return a == kDone ? b : a;
}

ExitCode judge_all(const std::vector<Gate>& gates, const std::string& pattern, const Score& score, std::ostream& out) {
  ExitCode code = kDone;
  bool any = gates.empty();
  for (const Gate& gate : gates) {
    for (const PolicyScore& policy : score.policies) {
      if (!matches(pattern, policy.policy)) continue;
      any = true;
      const ExitCode one = judge(gate, policy);
      const char* word = one == kDone ? "met" : one == kGateMissed ? "MISSED" : "inconclusive";
      out << fmt::format("{}: {}: {} (95 % interval {:.4f} to {:.4f}, {} traces)\n", gate.text, policy.policy, word,
                         policy.interval.low, policy.interval.high, policy.n);
      code = worse(code, one);
    }
  }
  if (any) return code;
  std::vector<std::string> names;
  for (const PolicyScore& policy : score.policies) names.push_back(policy.policy);
  throw InputError(
      fmt::format("--policy '{}' matches no policy of the archive; nearest: {}", pattern, nearest(pattern, names)));
}

/// The score with every failure, streamed: there may be more of them than memory holds.
void print_json(const Archive& archive, const Score& result, bool all_failures) {
  std::string text = score_json(result, !all_failures);
  if (!all_failures) {
    std::cout << text;
    return;
  }
  text.resize(text.rfind('}'));
  while (text.back() == '\n') text.pop_back();
  std::cout << text << ",\n  \"failures_listed\": \"all\",\n  \"failures\": [";
  list_failures_json(archive, result.archive, std::cout);
  std::cout << "\n  ]\n}";
}

void print_text(const Archive& archive, const Score& result, bool all_failures) {
  std::cout << format_score(result, !all_failures);
  if (!all_failures) return;
  std::cout << "\nFailures\n";
  list_failures(archive, result.archive, std::cout);
}

int score_archives(const Arguments& arguments) {
  std::vector<Gate> gates;
  for (const std::string& text : arguments.require) gates.push_back(parse_gate(text));
  ExitCode code = kDone;
  const bool several = arguments.archives.size() > 1;
  if (arguments.json && several) std::cout << "[\n";
  for (std::size_t i = 0; i < arguments.archives.size(); ++i) {
    const std::string& file = arguments.archives[i];
    const Archive archive(file);
    const Score result = score(archive);
    if (arguments.json) {
      if (i > 0) std::cout << ",\n";
      print_json(archive, result, arguments.failures);
    } else {
      if (several) std::cout << file << "\n";
      print_text(archive, result, arguments.failures);
      if (several) std::cout << "\n";
    }
    code = worse(code, judge_all(gates, arguments.policy, result, arguments.json ? std::cerr : std::cout));
    if (!result.complete && code == kDone) code = kMachineFailed;
  }
  if (arguments.json) std::cout << (several ? "\n]\n" : "\n");
  return code;
}

}  // namespace

void add_score(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      add_verb(app, "score", "Success rates with intervals, failures by requirement, paired comparison",
               "  graze score quadruped_curb.graze\n"
               "  graze score curb.h5 --json\n"
               "  graze score curb.h5 --policy 'step/4cm' --require 'p >= 0.9'   # a gate for CI\n"
               "  graze score curb.h5 --failures                                  # with replay commands\n");
  verb->add_option("archives", arguments->archives, "Campaign directories or packed files")->required();
  verb->add_option(
          "--require", arguments->require,
          "Gate on the success rate: exit 0 if the 95 % interval lies at or above, 1 if below, 4 if it straddles")
      ->type_name("'p >= RATE'")
      ->allow_extra_args(false);
  verb->add_option("--policy", arguments->policy, "Policies that the gate is for (glob)")->capture_default_str();
  verb->add_flag("--failures", arguments->failures, "List every failed trace, each with its replay command");
  verb->add_flag("--json", arguments->json, "Print JSON");
  verb->callback([arguments, &action] { action = [arguments] { return score_archives(*arguments); }; });
}

}  // namespace graze
