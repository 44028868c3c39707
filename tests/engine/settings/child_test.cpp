// Claim: work in a child process returns what it makes; what crashes, hangs, floods or takes all memory ends the child
// alone and is named, and an InputError passes.
#include "engine/settings/child.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <string>
#include <vector>

#include "engine/settings/settings.h"
#include "tests/message_of.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

constexpr ChildLimits kSmall = {1, std::size_t{200} << 20, std::size_t{1} << 20};

ChildRun child(const std::function<std::string()>& work) { return run_in_child(work, kSmall); }

TEST(Child, ReturnsWhatItMakes) {
  const std::string bytes = std::string(300'000, 'x') + '\0' + "end";
  const ChildRun run = child([&] { return bytes; });
  EXPECT_EQ(run.problem, "");
  EXPECT_TRUE(run.output == bytes);
  EXPECT_EQ(child([] { return std::string(); }).problem, "");
}

TEST(Child, RefusalsPass) {
  const std::string message =
      testing::message_of([] { child([]() -> std::string { throw InputError("a.ply:3: no"); }); });
  EXPECT_EQ(message, "a.ply:3: no");
}

TEST(Child, CrashesAreNamed) {
  EXPECT_EQ(child([]() -> std::string {
              std::raise(SIGSEGV);
              return "";
            }).problem,
            "crashed (SIGSEGV)");
  EXPECT_EQ(child([]() -> std::string { std::abort(); }).problem, "crashed (SIGABRT)");
  EXPECT_EQ(child([]() -> std::string { _exit(7); }).problem, "ended its process with code 7");
  EXPECT_EQ(child([]() -> std::string { throw std::runtime_error("odd"); }).problem, "fails: odd");
}

TEST(Child, EndlessWorkEnds) {
  volatile bool forever = true;
  EXPECT_EQ(child([&]() -> std::string {
              while (forever) {
              }
              return "";
            }).problem,
            "took more than 1 s of processor time");
}

TEST(Child, HungerAndFloodsEnd) {
  EXPECT_THAT(child([] { return std::string(2u << 20, 'x'); }).problem, ::testing::HasSubstr("makes more than"));
  if (GRAZE_SANITIZED) GTEST_SKIP() << "a sanitizer has its own malloc";
  const ChildRun run = child([]() -> std::string { return {std::vector<char>(1u << 30).data(), 1}; });
  EXPECT_THAT(run.problem, ::testing::HasSubstr("of memory"));
}

}  // namespace
}  // namespace graze
