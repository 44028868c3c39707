// Claim: a shell reads a word back as it was; plain words need no quotes.
#include "archive/files/shell_word.h"

#include <gtest/gtest.h>

#include "archive/files/utf8.h"
#include "tests/jobs/program.h"

namespace graze {
namespace {

TEST(ShellWord, IsReadBackByTheShell) {
  const testing::TemporaryFolder folder;
  for (const std::string word : {"plain", "a b", "it's", "$HOME `x` \\ \"", "p >= 0.9", "*", "~", "#", ""}) {
    EXPECT_EQ(testing::shell(folder.path(), "printf %s " + shell_word(word)).out, word);
  }
}

// Claim: what a terminal does not show as it is comes escaped, so that what is printed can be pasted.
TEST(ShellWord, IsPrintableAndReadBackByBash) {
  const testing::TemporaryFolder folder;
  for (const std::string word :
       {"a\nb", "a\x1b[31mb", "\t", "it's\r\\n", "\x7f", "\xff\x31", "\u009b", "a\u202eb", "\n9"}) {
    EXPECT_EQ(printable(shell_word(word)), shell_word(word));
    testing::write_file(folder / "s", "printf %s " + shell_word(word));
    EXPECT_EQ(testing::shell(folder.path(), "bash s").out, word);
  }
}

// Claim: what begins with - is taken for no option.
TEST(ShellWord, IsNoOption) {
  EXPECT_EQ(shell_path("-a.graze"), "./-a.graze");
  EXPECT_EQ(shell_path("-a b"), "'./-a b'");
  EXPECT_EQ(shell_path("a-b"), "a-b");
  EXPECT_EQ(shell_option("--policy", "-x y"), "--policy='-x y'");
  EXPECT_EQ(shell_option("--policy", "x y"), "--policy 'x y'");
}

TEST(ShellWord, IsLeftAloneWhereItIsPlain) {
  EXPECT_EQ(shell_word("runs/a-1_b.graze"), "runs/a-1_b.graze");
  EXPECT_EQ(shell_word("my runs/it's"), "'my runs/it'\\''s'");
  EXPECT_EQ(shell_word(""), "''");
}

}  // namespace
}  // namespace graze
