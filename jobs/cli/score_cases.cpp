#include "jobs/cli/score_cases.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <span>

#include "archive/files/files.h"
#include "archive/files/parent_folders.h"
#include "archive/files/shell_word.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

namespace fs = std::filesystem;
using Result = TestCase::Result;

/// A gate is a question about what is there: met if its answer holds, missed if it is refuted.
ExitCode code_of(Verdict verdict) {
  return verdict == Verdict::holds ? kDone : verdict == Verdict::refuted ? kGateMissed : kInconclusive;
}

std::string interval_text(const Interval& interval) {
  return fmt::format("95 % interval {:.4f} to {:.4f}", interval.low, interval.high);
}

/// "31 of 100 traces (0.3100, 95 % interval 0.2213 to 0.4103)"
std::string share_text(std::uint64_t k, const PolicyScore& policy, const Score& score) {
  if (policy.n == 0) return "of no valid trace";
  return fmt::format("{} of {} traces ({:.4f}, {})", k, policy.n,
                     static_cast<double>(k) / static_cast<double>(policy.n),
                     interval_text(score.interval(k, policy.n)));
}

std::string no_valid_trace(const PolicyScore& policy) {
  return fmt::format("policy {} has no valid trace{}", policy.policy,
                     policy.invalid == 0 ? "" : fmt::format(", all {} are invalid", policy.invalid));
}

std::string policy_text(const PolicyScore& policy, const Score& score) {
  std::string out = "success: " + share_text(policy.success, policy, score) + "\n";
  out +=
      fmt::format("known failures {}, unknown failures {}, invalid {}\n", policy.known, policy.unknown, policy.invalid);
  for (const Failure& failure : score.failures) {
    if (failure.policy != policy.policy) continue;
    out += fmt::format("{}: {} traces, for example: {}\n", failure.what, failure.alike,
                       replay_command(score.archive, failure.policy, failure.particle, failure.trust));
  }
  return out;
}

/// Of one way to fail; `blamed`: the policy's rate is too low.
TestCase way_case(const std::string& group, const std::string& name, const std::string& what, bool blamed) {
  TestCase out{group, name, Result::passed, "", "", what + "\n"};
  if (!blamed) return out;
  out.result = Result::failed;
  out.kind = "violated";
  out.message = what;
  return out;
}

/// Of a policy without a valid trace, of which nothing is known: a controller that never worked has passed nothing.
void add_unknown(TestSuite& suite, const PolicyScore& policy, const Score& score, const std::vector<Judged>& judged) {
  const std::string group = suite.name + "." + policy.policy;
  const std::string text = no_valid_trace(policy);
  TestCase out{group, "success rate", Result::error, "no valid trace", text, policy_text(policy, score)};
  bool asked = false;
  for (const Judged& one : judged) {
    if (one.policy.policy != policy.policy) continue;
    asked = true;
    out.name = one.gate.text;
    suite.cases.push_back(out);
  }
  if (!asked) suite.cases.push_back(std::move(out));
}

void add_policy(TestSuite& suite, const PolicyScore& policy, const Score& score, const std::vector<Judged>& judged) {
  if (policy.n == 0) return add_unknown(suite, policy, score, judged);
  const std::string group = suite.name + "." + policy.policy;
  const std::string all = policy_text(policy, score);
  bool too_low = false;
  std::size_t gates = 0;
  for (const Judged& one : judged) {
    if (one.policy.policy != policy.policy) continue;
    ++gates;
    TestCase out{group, one.gate.text, Result::passed, "", "", one.text + "\n" + all};
    if (one.code != kDone) {
      out.result = Result::failed;
      out.kind = one.code == kGateMissed ? "missed" : "inconclusive";
      out.message = one.text;
      too_low |= one.gate.kind == Question::Kind::rate_above;
    }
    suite.cases.push_back(std::move(out));
  }
  if (gates == 0) suite.cases.push_back({group, "success rate", Result::passed, "", "", all});
  for (std::size_t i = 0; i < score.requirements.size(); ++i) {
    const std::uint64_t k = policy.by_requirement.at(i);
    suite.cases.push_back(way_case(group, "requirement " + score.requirements[i],
                                   "violated first in " + share_text(k, policy, score), too_low && k > 0));
  }
  suite.cases.push_back(way_case(group, "objective",
                                 "missed without any violation in " + share_text(policy.unknown, policy, score),
                                 too_low && policy.unknown > 0));
}

constexpr std::string_view kBegin = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites ";

bool is_junit(const fs::path& file) {
  std::string begin(kBegin.size(), '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return in && begin == kBegin;
}

}  // namespace

std::vector<Judged> judge_all(const std::vector<Question>& gates, const Score& score) {
  const auto interval = [&](std::uint64_t k, std::uint64_t n) { return score.interval(k, n); };
  std::vector<Judged> out;
  for (const Question& gate : gates) {
    for (const PolicyScore& policy : score.policies) {
      if (!matches(gate.selector, policy.policy)) continue;
      const ExitCode code = code_of(judge(gate, policy.interval));
      if (policy.n == 0) {
        out.push_back({gate, policy, code,
                       fmt::format("{}: {}: NOT KNOWN: {}", gate.text, policy.policy, no_valid_trace(policy))});
        continue;
      }
      const ExitCode cautious =
          code_of(judge(gate, with_invalid({policy.success, policy.n, policy.invalid}, interval)));
      if (cautious != code) {  // decided without traces that may have gone either way
        out.push_back(
            {gate, policy, kInconclusive,
             fmt::format("{}: {}: inconclusive ({}, {} traces, and {} invalid ones, of which nobody knows how "
                         "they would have ended, leave it open)",
                         gate.text, policy.policy, interval_text(policy.interval), policy.n, policy.invalid)});
        continue;
      }
      const char* word = code == kDone ? "met" : code == kGateMissed ? "MISSED" : "inconclusive";
      out.push_back({gate, policy, code,
                     fmt::format("{}: {}: {} ({}, {} traces)", gate.text, policy.policy, word,
                                 interval_text(policy.interval), policy.n)});
    }
  }
  return out;
}

TestSuite score_cases(const std::string& name, const Score& score, const std::vector<Judged>& judged) {
  TestSuite suite{name, {}};
  TestCase complete{name, "complete", Result::passed, "", "", ""};
  if (!score.complete) {
    complete.result = Result::error;
    complete.kind = "incomplete";
    complete.message =
        fmt::format("not all traces are there; {} does the rest", resume_command(score.archive, score.trust));
  }
  suite.cases.push_back(std::move(complete));
  for (const PolicyScore& policy : score.policies) add_policy(suite, policy, score, judged);
  return suite;
}

void check_junit_output(const fs::path& file, const std::vector<std::string>& archives) {
  check_ending(file, "test results are written as XML", {".xml"}, Endings::only, NamedBy::word);
  std::error_code error;
  const bool replaces = fs::is_regular_file(file, error) && is_junit(file);
  if (!replaces && fs::is_regular_file(file, error) && fs::file_size(file, error) > 0) {
    throw InputError(fmt::format("{}: exists already and is not of --junit; choose another name", file.string()));
  }
  check_new_file(file, replaces, {archives.begin(), archives.end()}, NamedBy::word);
  if (const std::string problem = cannot_make(file); !problem.empty()) {
    throw MachineError(fmt::format("{}: cannot be written: {}", file.string(), problem));
  }
}

void write_junit(const fs::path& file, const std::vector<TestSuite>& suites) {
  const std::string text = junit_xml(suites);
  const ParentFolders folders(file);
  NewFile out(file, true);
  if (const int error = write_all(out.descriptor(), std::as_bytes(std::span(text)))) fail_writing(file, error);
  out.publish();
}

}  // namespace graze
