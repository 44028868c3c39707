// Campaign directories that somebody has prepared: whatever lies in the place of a file or a folder, nothing outside of
// the directory is read, changed or moved, and nothing is waited for.
#include <gmock/gmock.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <functional>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/campaign_files.h"
#include "archive/directory/finished.h"
#include "archive/directory/set_aside.h"
#include "archive/files/files.h"
#include "tests/archive/compare.h"
#include "tests/archive/tables.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

CampaignInfo small() {
  CampaignInfo facts = info();
  facts.particles = 8;
  facts.scenario_text = "graze: 1";
  return facts;
}

void add(CampaignWriter& writer) {
  Block one = block(small(), 0, range(0, 8));
  writer.append(0, std::move(one.traces), std::move(one.values));
}

/// What `resume` does.
void take_up(const fs::path& path) {
  const auto lock = std::make_shared<const DirectoryLock>(path);
  recover_set_aside(lock->directory());
  const CampaignInfo facts = read_description(lock->directory());
  CampaignWriter writer(path, facts, {lock});
  repair_and_list(lock->directory(), facts);
  writer.add_unfinished({"hold", 1, "a reason"});
  add(writer);
  writer.finish();
}

/// What `run --force` does.
void write_over(const fs::path& path) {
  CampaignWriter writer(path, small(), true);
  add(writer);
  writer.finish();
}

/// All that is below a folder, and its content.
std::map<std::string, std::string> snapshot(const fs::path& folder) {
  std::map<std::string, std::string> out;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    out[entry.path().string()] = entry.is_regular_file() ? content(entry.path()) : "";
  }
  return out;
}

/// Two campaigns of the same scenario: one in an enemy's hands, one that nobody may touch.
struct Prepared {
  Prepared() {
    write(folder / "master.graze", small());
    fs::create_directory(folder / "outside");
    fs::copy(folder / "master.graze", theirs, fs::copy_options::recursive);
    put(theirs / kUnfinishedFile, "a line\n");
    before = snapshot(folder / "outside");
  }
  /// The campaign as it was, with nothing in this place.
  fs::path without(const std::string& place) const {
    fs::remove_all(folder / "a.graze");
    fs::copy(folder / "master.graze", folder / "a.graze", fs::copy_options::recursive);
    fs::remove_all(folder / "a.graze" / place);
    return folder / "a.graze" / place;
  }
  /// What lies outside that could stand in a place.
  fs::path outside(const std::string& place) const {
    if (fs::exists(theirs / place)) return theirs / place;
    return fs::path(place).has_extension() || place == kLockFile ? theirs / "campaign.h5" : theirs;
  }
  /// Every verb at once, in a campaign directory that is no good.
  void use() const {
    const fs::path path = folder / "a.graze";
    const std::vector<std::function<void()>> verbs = {
        [&] { read_unfinished(path); },
        [&] { table_of(Archive(path), "step/1cm"); },
        [&] { pack(path, folder / "o.h5", true); },
        [&] { take_up(path); },
        [&] { write_over(path); },
    };
    for (const auto& verb : verbs) {
      try {
        verb();
      } catch (const InputError&) {
      } catch (const MachineError&) {
      }
      ASSERT_EQ(snapshot(folder / "outside"), before);
    }
  }

  Folder folder;
  fs::path theirs = folder / "outside" / "theirs.graze";
  std::map<std::string, std::string> before;
};

const std::vector<std::string> kPlaces = {
    "lock",   "campaign.h5", "campaign.copy.h5", "unfinished.jsonl", "replacing",          "replaced",
    "shards", "manifest",    "damaged",          "shards/000001.h5", "manifest/all.jsonl", "campaign.h5.tmp"};

bool is_read(const std::string& place) {
  return place != "damaged" && place != "campaign.h5.tmp" && place != kDescriptionCopy && place != kUnfinishedFile &&
         place != "manifest/all.jsonl";
}

// Claim: a symbolic link in any place leads nowhere: readers refuse it and name it, writers change nothing behind it.
TEST(Hostile, LinksLeadNowhere) {
  const Prepared prepared;
  for (const std::string& place : kPlaces) {
    SCOPED_TRACE(place);
    const fs::path link = prepared.without(place);
    fs::create_symlink(prepared.outside(place), link);
    if (is_read(place)) {
      EXPECT_THAT(message_of<InputError>([&] { Archive(prepared.folder / "a.graze"); }),
                  AllOf(HasSubstr(link.string() + ": is a symbolic link"), HasSubstr("nothing outside")));
    }
    prepared.use();
  }
}

// Claim: the same of a link to a file that is not there: none is made.
TEST(Hostile, DanglingLinksMakeNoFiles) {
  const Prepared prepared;
  for (const std::string& place : kPlaces) {
    SCOPED_TRACE(place);
    const fs::path link = prepared.without(place);
    fs::create_symlink(prepared.folder / "outside" / "new", link);
    prepared.use();
  }
}

// Claim: a file that has another name elsewhere is never written to.
TEST(Hostile, HardLinksAreNotWrittenThrough) {
  const Prepared prepared;
  for (const std::string place :
       {"lock", "unfinished.jsonl", "manifest/shards.jsonl", "campaign.h5", "campaign.h5.tmp", "shards/000001.h5"}) {
    SCOPED_TRACE(place);
    const fs::path link = prepared.without(place);
    fs::create_hard_link(prepared.outside(place), link);
    prepared.use();
  }
  const fs::path lock = prepared.without("lock");
  fs::create_hard_link(prepared.theirs / "campaign.h5", lock);
  EXPECT_THAT(message_of<InputError>([&] { take_up(prepared.folder / "a.graze"); }),
              AllOf(HasSubstr(lock.string()), HasSubstr("hard link")));
}

// Claim: no pipe is waited for.
TEST(Hostile, PipesAreNotWaitedFor) {
  const Prepared prepared;
  for (const std::string& place : kPlaces) {
    SCOPED_TRACE(place);
    const fs::path pipe = prepared.without(place);
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    if (is_read(place)) {
      EXPECT_THAT(message_of<InputError>([&] { Archive(prepared.folder / "a.graze"); }),
                  HasSubstr(pipe.string() + ": is a named pipe"));
    }
    prepared.use();
  }
  ASSERT_EQ(mkfifo((prepared.folder / "pipe.h5").c_str(), 0600), 0);
  EXPECT_THAT(message_of<InputError>([&] { Archive(prepared.folder / "pipe.h5"); }), HasSubstr("is a named pipe"));
}

// Claim: what is no file is put aside by whoever repairs, and what it should have held is missed and named.
TEST(Hostile, ALinkAmongTheShardsIsPutAside) {
  const Prepared prepared;
  const fs::path link = prepared.without("shards/000001.h5");
  fs::create_symlink(prepared.theirs / "shards/000001.h5", link);
  const FinishedTraces finished = repair_and_list(prepared.folder / "a.graze", small());
  EXPECT_EQ(finished.count, 0u);
  ASSERT_EQ(finished.notes.size(), 1u);
  EXPECT_THAT(finished.notes[0], AllOf(HasSubstr("000001.h5: is a symbolic link"), HasSubstr("damaged/")));
  EXPECT_TRUE(fs::is_symlink(prepared.folder / "a.graze/damaged/000001.h5"));
}

// Claim: nobody can foresee under which name a file is written: what waits under the obvious ones is left alone.
TEST(Hostile, TemporaryNamesCannotBeForeseen) {
  const Prepared prepared;
  put(prepared.folder / "precious", "years");
  for (const char* name : {"o.h5.tmp", "o.h5.texts.tmp", "o.h5.texts"}) {
    fs::create_symlink(prepared.folder / "precious", prepared.folder / name);
  }
  pack(prepared.folder / "master.graze", prepared.folder / "o.h5", false);
  EXPECT_EQ(content(prepared.folder / "precious"), "years");
  std::string first, second;
  const Directory folder(prepared.folder.path());
  folder.create_temporary("o.h5", first);
  folder.create_temporary("o.h5", second);
  EXPECT_NE(first, second);
  EXPECT_EQ(final_name(first), "o.h5");
  EXPECT_EQ(final_name("o.h5.tmp"), "o.h5");
  EXPECT_EQ(final_name("o.h5"), std::nullopt);
}

// Claim: lines that no campaign writes cost neither memory nor time: a terabyte of nothing is a manifest without
// entries.
TEST(Hostile, EndlessLinesAreNotRead) {
  const Prepared prepared;
  prepared.without("manifest/all.jsonl");
  for (const char* name : {"manifest/all.jsonl", "unfinished.jsonl"}) {
    const fs::path file = prepared.folder / "a.graze" / name;
    put(file, "");
    fs::resize_file(file, std::uintmax_t{1} << 40);
  }
  EXPECT_TRUE(read_manifest(prepared.folder / "a.graze").empty());
  EXPECT_TRUE(read_unfinished(prepared.folder / "a.graze").empty());
}

/// A file system of its own in the place of a folder; needs the right to mount.
class Mounted {
 public:
  explicit Mounted(fs::path path) : path_(std::move(path)) {
    mounted_ = mount("none", path_.c_str(), "tmpfs", 0, "size=1m") == 0;
  }
  ~Mounted() {
    if (mounted_) umount(path_.c_str());
  }
  explicit operator bool() const { return mounted_; }

 private:
  fs::path path_;
  bool mounted_ = false;
};

// Claim: where the old campaign cannot be set aside, --force fails and leaves it as it was.
TEST(Replacing, WhatCannotBeSetAsideIsLeft) {
  for (const char* fixed : {"manifest", "shards"}) {
    SCOPED_TRACE(fixed);
    const Folder folder;
    write(folder / "a.graze", small());
    const Archive held(folder / "a.graze");  // the shard under the mount
    const auto wanted = table_of(held, "step/1cm").digest;
    const std::string description = content(folder / "a.graze/campaign.h5");
    {
      const Mounted mounted(folder / "a.graze" / fixed);
      if (!mounted) GTEST_SKIP() << "mounting is not permitted";
      EXPECT_THAT(message_of<MachineError>([&] { CampaignWriter(folder / "a.graze", small(), true); }),
                  AllOf(HasSubstr(fixed), HasSubstr("busy")));
    }
    EXPECT_TRUE(content(folder / "a.graze/campaign.h5") == description);
    EXPECT_FALSE(fs::exists(folder / "a.graze" / kReplacingFolder));
    EXPECT_FALSE(fs::exists(folder / "a.graze" / kReplacedFolder));
    EXPECT_EQ(table_of(Archive(folder / "a.graze"), "step/1cm").digest, wanted);
    EXPECT_NO_THROW(write_over(folder / "a.graze"));
  }
}

// Claim: a directory that was moved, or removed and made anew, is noticed at the next shard; nothing is written into
// the new one, and the message says where the old one is.
TEST(Replacing, ADirectoryThatIsNotOursAnyMoreIsLeftAlone) {
  const Folder folder;
  for (const bool moved : {true, false}) {
    SCOPED_TRACE(moved);
    fs::remove_all(folder / "a.graze");
    const std::string message = message_of<MachineError>([&] {
      CampaignWriter writer(folder / "a.graze", small(), false);
      if (moved) fs::rename(folder / "a.graze", folder / "b.graze");
      fs::remove_all(folder / "a.graze");
      fs::create_directories(folder / "a.graze/shards");
      EXPECT_THROW(writer.add_unfinished({"hold", 1, "a reason"}), MachineError);
      add(writer);
      writer.finish();
    });
    EXPECT_THAT(message, AllOf(HasSubstr("a.graze: is no longer the directory that this program writes into"),
                               HasSubstr(moved ? (folder / "b.graze").string() + " now" : "it was removed")));
    EXPECT_EQ(Directory(folder / "a.graze").names(), std::vector<std::string>{"shards"});
    EXPECT_TRUE(Directory(folder / "a.graze/shards").names().empty());
  }
}

// Claim: a description that is damaged or gone is read from its copy, with a warning, and taking the campaign up mends
// both; a copy that is damaged alone is mended, too.
TEST(Copy, StandsInForTheDescription) {
  const Folder folder;
  const fs::path path = folder / "a.graze";
  write(path, small());
  const std::string whole = content(path / kDescriptionFile);
  EXPECT_TRUE(content(path / kDescriptionCopy) == whole);
  for (const char* name : {kDescriptionFile, kDescriptionCopy}) {
    for (const std::size_t length : {std::size_t{0}, whole.size() / 2, whole.size() - 1}) {
      SCOPED_TRACE(length);
      put(path / name, whole.substr(0, length));
      const Archive archive(path);
      EXPECT_TRUE(archive.complete());
      EXPECT_EQ(table_of(archive, "step/1cm").size(), 8u);
      EXPECT_EQ(archive.warnings().size(), name == kDescriptionFile ? 1u : 0u);
      take_up(path);
      EXPECT_TRUE(content(path / kDescriptionFile) == whole);
      EXPECT_TRUE(content(path / kDescriptionCopy) == whole);
    }
  }
  fs::remove(path / kDescriptionFile);
  EXPECT_THAT(Archive(path).warnings().at(0),
              AllOf(HasSubstr("campaign.h5: is not there"), HasSubstr("copy.h5"), HasSubstr("graze resume")));
  EXPECT_NO_THROW(pack(path, folder / "a.h5", false));
}

// Claim: where both are gone, the message says of which campaign the shards are and how they are kept.
TEST(Copy, WithoutEitherTheShardsTellWhatTheyAre) {
  const Folder folder;
  write(folder / "a.graze", small());
  fs::remove(folder / "a.graze/campaign.h5");
  put(folder / "a.graze/campaign.copy.h5", "?");
  EXPECT_THAT(message_of<InputError>([&] { Archive(folder / "a.graze"); }),
              AllOf(HasSubstr("campaign.h5: is not there"), HasSubstr("campaign.copy.h5: is not an HDF5 file"),
                    HasSubstr("1 shard can be kept (seed 18446744073709551600"), HasSubstr("-n 1")));
}

}  // namespace
}  // namespace graze
