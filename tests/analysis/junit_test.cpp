// Claim: results as JUnit XML are well-formed whatever stands in names and texts, and counts are those of the cases.
#include "analysis/junit.h"

#include <gtest/gtest.h>
#include <tinyxml2.h>

namespace graze {
namespace {

TEST(JUnit, HoldsAnyTextAndCountsItsCases) {
  const std::string evil = "a<b>&\"c'\x1b[2J\x01\xff\xEF\xBF\xBE ]]> é";
  const std::string shown = "a<b>&\"c'\\u001b[2J\\u0001\\xff\\ufffe ]]> é";
  const std::vector<TestSuite> suites = {
      {evil,
       {{"g", evil, TestCase::Result::failed, "missed", evil + "\nline", "one\n" + evil},
        {"g", "b", TestCase::Result::passed, "", "", evil},
        {"g", "c"}}},
      {"second", {{"h", "d", TestCase::Result::error, "incomplete", "why", ""}}}};
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(junit_xml(suites).c_str()), tinyxml2::XML_SUCCESS) << junit_xml(suites);
  const auto* const root = document.RootElement();
  ASSERT_STREQ(root->Name(), "testsuites");
  EXPECT_EQ(root->IntAttribute("tests"), 4);
  EXPECT_EQ(root->IntAttribute("failures"), 1);
  EXPECT_EQ(root->IntAttribute("errors"), 1);
  const auto* const suite = root->FirstChildElement("testsuite");
  EXPECT_EQ(suite->Attribute("name"), shown);
  EXPECT_EQ(suite->IntAttribute("tests"), 3);
  EXPECT_EQ(suite->IntAttribute("errors"), 0);
  const auto* one = suite->FirstChildElement("testcase");
  EXPECT_EQ(one->Attribute("name"), shown);
  EXPECT_EQ(one->FirstChildElement("failure")->Attribute("message"), shown + "\\u000aline");
  EXPECT_EQ(one->FirstChildElement("failure")->GetText(), "one\n" + shown);
  one = one->NextSiblingElement();
  EXPECT_EQ(one->FirstChildElement("system-out")->GetText(), shown);
  EXPECT_EQ(one->NextSiblingElement()->FirstChildElement(), nullptr);
  EXPECT_STREQ(suite->NextSiblingElement()->FirstChildElement()->FirstChildElement("error")->Attribute("type"),
               "incomplete");
}

}  // namespace
}  // namespace graze
