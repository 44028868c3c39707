#include "analysis/junit.h"

#include <fmt/format.h>

#include <algorithm>

#include "archive/files/utf8.h"

namespace graze {
namespace {

/// Text for an attribute or between tags; lines stay in the latter.
std::string xml(const std::string& text, bool attribute) {
  std::string out;
  for (const char c : attribute ? printable(text) : printable_lines(text)) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  // Two characters of UTF-8 that XML 1.0 has not.
  for (const auto& [character, escaped] :
       {std::pair{"\xEF\xBF\xBE", "\\ufffe"}, std::pair{"\xEF\xBF\xBF", "\\uffff"}}) {
    for (std::size_t at = out.find(character); at != std::string::npos; at = out.find(character, at)) {
      out.replace(at, 3, escaped);
    }
  }
  return out;
}

std::size_t count(const std::vector<TestCase>& cases, TestCase::Result result) {
  return static_cast<std::size_t>(
      std::count_if(cases.begin(), cases.end(), [&](const TestCase& one) { return one.result == result; }));
}

std::string case_xml(const TestCase& one) {
  std::string out =
      fmt::format("    <testcase classname=\"{}\" name=\"{}\" time=\"0\"", xml(one.group, true), xml(one.name, true));
  const std::string text = xml(one.text, false);
  if (one.result == TestCase::Result::passed) {
    return out + (text.empty() ? "/>\n" : ">\n      <system-out>" + text + "</system-out>\n    </testcase>\n");
  }
  const char* const tag = one.result == TestCase::Result::failed ? "failure" : "error";
  return out + fmt::format(">\n      <{0} type=\"{1}\" message=\"{2}\">{3}</{0}>\n    </testcase>\n", tag,
                           xml(one.kind, true), xml(one.message, true), text);
}

std::string counts_xml(const std::vector<TestCase>& cases) {
  return fmt::format("tests=\"{}\" failures=\"{}\" errors=\"{}\"", cases.size(), count(cases, TestCase::Result::failed),
                     count(cases, TestCase::Result::error));
}

}  // namespace

std::string junit_xml(const std::vector<TestSuite>& suites) {
  std::vector<TestCase> all;
  for (const TestSuite& suite : suites) all.insert(all.end(), suite.cases.begin(), suite.cases.end());
  std::string out = fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"graze score\" {}>\n",
                                counts_xml(all));
  for (const TestSuite& suite : suites) {
    out += fmt::format("  <testsuite name=\"{}\" {} skipped=\"0\" time=\"0\">\n", xml(suite.name, true),
                       counts_xml(suite.cases));
    for (const TestCase& one : suite.cases) out += case_xml(one);
    out += "  </testsuite>\n";
  }
  return out + "</testsuites>\n";
}

}  // namespace graze
