// Claim: a shell reads a word back as it was; plain words need no quotes.
#include "archive/shell_word.h"

#include <gtest/gtest.h>

#include "tests/jobs/program.h"

namespace graze {
namespace {

TEST(ShellWord, IsReadBackByTheShell) {
  const testing::TemporaryFolder folder;
  for (const std::string word : {"plain", "a b", "it's", "$HOME `x` \\ \"", "p >= 0.9", "*", "~", "#", "a\nb", ""}) {
    EXPECT_EQ(testing::shell(folder.path(), "printf %s " + shell_word(word)).out, word);
  }
}

TEST(ShellWord, IsLeftAloneWhereItIsPlain) {
  EXPECT_EQ(shell_word("runs/a-1_b.graze"), "runs/a-1_b.graze");
  EXPECT_EQ(shell_word("my runs/it's"), "'my runs/it'\\''s'");
  EXPECT_EQ(shell_word(""), "''");
}

}  // namespace
}  // namespace graze
