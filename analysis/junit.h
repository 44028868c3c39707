#pragma once
// Test results as XML that CI systems show: the JUnit dialect that GitHub actions, GitLab and Jenkins read.

#include <string>
#include <vector>

namespace graze {

struct TestCase {
  enum class Result { passed, failed, error };
  std::string group, name;  // unique together
  Result result = Result::passed;
  std::string kind = {};     // of a failure, a word: "missed"
  std::string message = {};  // of a failure, one line
  std::string text = {};     // what else is to be told, lines
};

struct TestSuite {
  std::string name;
  std::vector<TestCase> cases;
};

/// The whole document. Any bytes may stand in the texts: what XML cannot hold is escaped as in printable().
std::string junit_xml(const std::vector<TestSuite>& suites);

}  // namespace graze
