// Claim: the name in an `include` means a file beside the including one; where there is none, what the program says
// that it means, and that is kept with the inputs, so that the same tree is read again where the name means nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/settings/inputs.h"
#include "engine/settings/settings.h"
#include "tests/message_of.h"
#include "tests/temporary_folder.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

struct IncludedNames : ::testing::Test {
  IncludedNames() {
    testing::write_file(shipped, "kind: shipped\ndeep: {a: 1, b: 2}\n");
    mean_includes([this](const std::string& name) {
      ++asked;
      return name == "base" ? std::optional(shipped.string()) : std::nullopt;
    });
  }
  ~IncludedNames() override { mean_includes({}); }

  std::string text_of(const std::string& content) {
    testing::write_file(folder / "own.yaml", content);
    return Settings::load((folder / "own.yaml").string()).resolved_text();
  }

  testing::TemporaryFolder folder, elsewhere;
  std::filesystem::path shipped = elsewhere / "base.yaml";
  int asked = 0;
};

TEST_F(IncludedNames, MeanWhatTheProgramSays) {
  EXPECT_THAT(text_of("include: base\ndeep: {b: 3}\n"), AllOf(HasSubstr("kind: shipped"), HasSubstr("b: 3")));
  EXPECT_THAT(text_of("inner: {include: [base], own: 1}\n"), AllOf(HasSubstr("kind: shipped"), HasSubstr("own: 1")));
}

TEST_F(IncludedNames, AFileOfTheNameIsMeantFirst) {
  testing::write_file(folder / "base", "kind: own\n");
  EXPECT_THAT(text_of("include: base\n"), AllOf(HasSubstr("kind: own"), Not(HasSubstr("shipped"))));
  EXPECT_EQ(asked, 0);
}

TEST_F(IncludedNames, OthersAreMissingFiles) {
  EXPECT_THAT(testing::message_of([&] { text_of("a: 1\ninclude: bse\n"); }),
              AllOf(HasSubstr("own.yaml:2:10: include: "), HasSubstr("no such file")));
  mean_includes({});
  EXPECT_THAT(testing::message_of([&] { text_of("include: base\n"); }), HasSubstr("no such file"));
  mean_includes([&](const std::string&) { return std::optional((elsewhere / "gone.yaml").string()); });
  EXPECT_THAT(testing::message_of([&] { text_of("include: base\n"); }),
              AllOf(HasSubstr("own.yaml:1:10: include: "), HasSubstr("gone.yaml: there is no such file")));
}

TEST_F(IncludedNames, AreNotIncludedByThemselves) {
  testing::write_file(shipped, "include: base\n");
  EXPECT_THAT(testing::message_of([&] { text_of("include: base\n"); }), HasSubstr("includes itself"));
}

TEST_F(IncludedNames, AreReadAgainWhereTheyMeanNothing) {
  InputFiles kept;
  std::string before;
  {
    const InputRecord record;
    before = text_of("include: base\n");
    kept = record.files();
  }
  int notes = 0;
  for (const auto& [name, content] : kept) {
    if (!is_meant_include(name)) continue;
    ++notes;
    EXPECT_EQ(content, shipped.string());
  }
  EXPECT_EQ(notes, 1);
  mean_includes({});
  std::filesystem::remove(shipped);
  std::filesystem::remove(folder / "own.yaml");
  const InputReplay replay(kept, folder.path().string());
  EXPECT_EQ(Settings::load((folder / "own.yaml").string()).resolved_text(), before);
}

}  // namespace
}  // namespace graze
