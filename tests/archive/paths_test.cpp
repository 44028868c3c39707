// Where outputs go: what their names mean, what stands in their way, and which folders are made and removed again.
#include <gmock/gmock.h>

#include <map>

#include "archive/files/files.h"
#include "archive/files/parent_folders.h"
#include "tests/archive/compare.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

TEST(Endings, AreThoseOfNames) {
  for (const auto& [name, ending] : std::map<std::string, std::string>{{"out/A.H5", ".h5"},
                                                                       {".h5", ".h5"},
                                                                       {"a.h5/", ".h5"},
                                                                       {"a.tar.gz", ".gz"},
                                                                       {"a", ""},
                                                                       {"a.d/b", ""},
                                                                       {".", ""},
                                                                       {"..", ""},
                                                                       {"/", ""}}) {
    EXPECT_EQ(ending_of(name), ending) << name;
  }
}

std::string ending_refusal(const std::string& name, const std::vector<std::string>& right, Endings endings) {
  return message_of<InputError>([&] { check_ending(name, "WHAT", right, endings); });
}

// Claim: a name that means another kind of file is refused with the nearest one that does not; others are the user's.
TEST(Endings, OfOtherKindsAreRefused) {
  const std::vector<std::string> hdf5 = {".h5", ".hdf5"}, campaign = {".graze"};
  for (const char* good : {"a.h5", "a.HDF5", "b/a.h5", "a", "p.1", "a.b.h5"}) {
    EXPECT_NO_THROW(check_ending(good, "WHAT", hdf5)) << good;
  }
  for (const char* good : {"a.graze", "a.graze/", "a", "a/", "..", "p.1/"}) {
    EXPECT_NO_THROW(check_ending(good, "WHAT", campaign)) << good;
  }
  using Case = std::pair<std::string, std::string>;
  for (const auto& [name, right] : std::vector<Case>{
           {"b/a.csv", "ends in .csv, but WHAT; nearest right answer: b/a.h5 or b/a.hdf5"},
           {"a.graze", "ends in .graze, but WHAT; nearest right answer: a.h5 or a.hdf5"},
           {"b/.h5", "is an ending without a name; nearest right answer: b/campaign.h5 or b/campaign.hdf5"},
           {"a.h5/", "ends in a slash, but .h5 is a file's ending; nearest right answer: a.h5"},
           {"a/", "ends in a slash, but WHAT; nearest right answer: a.h5 or a.hdf5"},
           {"../", "ends in a slash, but WHAT; nearest right answer: ../campaign.h5 or ../campaign.hdf5"}}) {
    EXPECT_EQ(ending_refusal(name, hdf5, Endings::free), "--output " + name + ": " + right);
  }
  EXPECT_THAT(ending_refusal("a.h5", campaign, Endings::free), EndsWith("nearest right answer: a.graze"));
  EXPECT_EQ(ending_refusal("a", hdf5, Endings::needed),
            "--output a: has no ending, but WHAT; nearest right answer: a.h5 or a.hdf5");
  EXPECT_NO_THROW(check_ending("p.1", "WHAT", hdf5, Endings::needed));
  EXPECT_EQ(ending_refusal("p.1", {".h5"}, Endings::only),
            "--output p.1: ends in .1, but WHAT; nearest right answer: p.1.h5");
}

// Claim: what stands in a new file's place stays unless it may go, and nothing is made of itself.
TEST(NewFiles, TakeOnlyFreePlaces) {
  const Folder folder;
  const auto refused = [&](const char* name, bool force) {
    return message_of<InputError>([&] { check_new_file(folder / name, force, {folder / "a.graze"}); });
  };
  EXPECT_NO_THROW(check_new_file(folder / "new.h5", false, {folder / "a.graze"}));
  EXPECT_NO_THROW(check_new_file(folder / "a.graze.h5", false, {folder / "a.graze"}));
  put(folder / "old.h5", "");
  EXPECT_THAT(refused("old.h5", false), HasSubstr("old.h5: exists already; choose another --output or give --force"));
  EXPECT_NO_THROW(check_new_file(folder / "old.h5", true, {folder / "a.graze"}));
  fs::create_symlink(folder / "nowhere", folder / "link.h5");
  EXPECT_THAT(refused("link.h5", false), HasSubstr("is a symbolic link that leads nowhere"));
  EXPECT_NO_THROW(check_new_file(folder / "link.h5", true, {folder / "a.graze"}));
  fs::create_directory(folder / "a.graze");
  EXPECT_THAT(refused("a.graze/x.h5", true), HasSubstr("x.h5: lies within "));
  EXPECT_THAT(refused("a.graze", true), HasSubstr("a.graze: is "));
  fs::create_directory(folder / "d");
  EXPECT_THAT(refused("d", true), HasSubstr("is a directory or a device"));
}

// Claim: a temporary name is one with the random digits, and nothing else; names at the system's limit have one, too.
TEST(NewFiles, HaveTemporaryNames) {
  EXPECT_EQ(final_name("a.h5.0123456789abcdef.tmp"), "a.h5");
  EXPECT_EQ(final_name("a.h5.0123456789abcde.tmp"), "a.h5.0123456789abcde");
  EXPECT_EQ(final_name("a.h5.0123456789abcdef0.tmp"), "a.h5.0123456789abcdef0");
  EXPECT_EQ(final_name("a.h5.0123456789abcdeF.tmp"), "a.h5.0123456789abcdeF");
  EXPECT_EQ(final_name("a.tmp.h5"), std::nullopt);
  const Folder folder;
  for (const std::size_t size : {200u, 233u, 234u, 255u}) {
    const std::string name(size, 'n');
    NewFile(folder / name, false).publish();
    EXPECT_TRUE(fs::exists(folder / name)) << size;
  }
}

// Claim: missing folders are made; those in which nothing was kept are removed again, the others stay.
TEST(ParentFolders, GoWhenNothingIsKept) {
  const Folder folder;
  {
    const ParentFolders made(folder / "a/b/c.h5");
    EXPECT_TRUE(fs::is_directory(folder / "a/b"));
    EXPECT_FALSE(fs::exists(folder / "a/b/c.h5"));
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
  {
    const ParentFolders made(folder / "a/b/c.graze/");
    EXPECT_FALSE(fs::exists(folder / "a/b/c.graze")) << "that is the output";
    put(folder / "a/kept", "");
  }
  EXPECT_TRUE(fs::exists(folder / "a/kept"));
  EXPECT_FALSE(fs::exists(folder / "a/b"));
  fs::create_directory(folder / "before");
  { const ParentFolders made(folder / "before/c.h5"); }
  EXPECT_TRUE(fs::is_directory(folder / "before"));
}

TEST(ParentFolders, AreNotMadeWhereTheyCannotBe) {
  const Folder folder;
  put(folder / "file", "mine");
  EXPECT_EQ(cannot_make(folder / "x/y.h5"), "");
  EXPECT_EQ(cannot_make("y.h5"), cannot_make("./y.h5"));
  EXPECT_EQ(cannot_make(folder / "file/x/y.h5"), (folder / "file").string() + " is no folder");
  EXPECT_THROW(ParentFolders(folder / "file/x/y.h5"), MachineError);
  EXPECT_EQ(content(folder / "file"), "mine");
}

}  // namespace
}  // namespace graze
