#pragma once
// What `graze score --junit` writes: a test case for each claim about a policy, each requirement and the objective.

#include <filesystem>
#include <string>
#include <vector>

#include "analysis/junit.h"
#include "analysis/score.h"
#include "analysis/sequential.h"
#include "jobs/campaign/exit_code.h"

namespace graze {

/// What became of one gate (--require) for one policy.
struct Judged {
  Question gate;
  PolicyScore policy;
  ExitCode code;     // kDone, kGateMissed or kInconclusive
  std::string text;  // "p >= 0.9: step/4cm: met (95 % interval …)"
};

/// Those gates that are about policies of the score, by gate, then by policy.
std::vector<Judged> judge_all(const std::vector<Question>& gates, const Score& score);

/// Test cases of one archive. One fails or is in error exactly if a gate is not met or the campaign is not complete, as
/// the exit code tells: gates themselves, and of a policy whose rate is too low also the requirements (and the
/// objective) that it failed by. `name`: of the suite.
TestSuite score_cases(const std::string& name, const Score& score, const std::vector<Judged>& judged);

/// Throws InputError unless the file may be written: it ends in .xml and is new, or a document of this kind, which it
/// replaces.
void check_junit_output(const std::filesystem::path& file, const std::vector<std::string>& archives);
/// Writes the document; it appears whole or not at all. Throws MachineError.
void write_junit(const std::filesystem::path& file, const std::vector<TestSuite>& suites);

}  // namespace graze
