// Claim: when somebody removes the lock of a campaign that is being written, and a second writer comes, the first one
// notices and stops; neither takes anything from the other.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "archive/directory/campaign_directory.h"
#include "tests/archive/compare.h"
#include "tests/archive/tables.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

/// One shard of these particles.
void write_shard(CampaignWriter& writer, std::uint32_t first, std::uint32_t last) {
  Block one = block(info(), 0, range(first, last));
  writer.append(0, std::move(one.traces), std::move(one.values));
  writer.flush();
}

TEST(SecondWriter, TheFirstStopsWhenItsLockIsStolen) {
  const Folder folder;
  const fs::path path = folder / "a.graze";
  {
    CampaignWriter first(path, info(), false);
    write_shard(first, 0, 8);
    fs::remove(path / "lock");
    CampaignWriter second(path, info(), ExistingCampaign{});
    write_shard(second, 8, 16);
    EXPECT_THAT(message_of<MachineError>([&] { write_shard(first, 16, 24); }),
                AllOf(HasSubstr("a.graze/lock: was removed while this program held it"), HasSubstr("process "),
                      HasSubstr("is writing here by now"), HasSubstr("graze resume")));
    write_shard(second, 16, 24);
  }
  EXPECT_THAT(shard_names(path), ElementsAre("000001.h5", "000002.h5", "000003.h5"));
  EXPECT_EQ(table_of(Archive(path), info().policies[0]).size(), 24u);
}

// Claim: a rank notices as the leader does, and writes nothing beside a second writer.
TEST(SecondWriter, ARankStopsWhenItsLeadersLockIsStolen) {
  const Folder folder;
  const fs::path path = folder / "a.graze";
  CampaignWriter leader(path, info(), false);
  CampaignWriter rank(path, info(), CampaignMember{1, 0, 2});
  write_shard(rank, 0, 8);
  fs::remove(path / "lock");
  EXPECT_THAT(message_of<MachineError>([&] { write_shard(rank, 8, 16); }),
              AllOf(HasSubstr("a.graze/lock: was removed"), HasSubstr("'graze resume")));
  EXPECT_THAT(shard_names(path), ElementsAre("r00001-000001.h5"));
}

// Claim: descriptions that somebody removes under a writer are there again with its next shard, or when it ends.
TEST(SecondWriter, RemovedDescriptionsAreWrittenAnew) {
  const Folder folder;
  const fs::path path = folder / "a.graze";
  CampaignWriter writer(path, info(), false);
  const std::string description = content(path / kDescriptionFile);
  for (const bool shard : {true, false}) {
    for (const char* name : {kDescriptionFile, kDescriptionCopy}) fs::remove(path / name);
    shard ? write_shard(writer, 0, 8) : writer.flush();
    for (const char* name : {kDescriptionFile, kDescriptionCopy}) EXPECT_TRUE(content(path / name) == description);
  }
}

// A lock that is gone, and nobody else yet: the first does not wait for the second.
TEST(SecondWriter, AMissingLockStopsTheWriter) {
  const Folder folder;
  CampaignWriter first(folder / "a.graze", info(), false);
  write_shard(first, 0, 8);
  fs::remove(folder / "a.graze" / "lock");
  EXPECT_THAT(message_of<MachineError>([&] { first.check_in_place(); }), HasSubstr("another may begin to write"));
  EXPECT_THAT(message_of<MachineError>([&] { first.finish(); }), HasSubstr("was removed"));
}

// What has the lock's name by now need not be a file.
TEST(SecondWriter, AnythingElseInTheLocksPlaceStopsTheWriter) {
  for (const char* what : {"pipe", "folder", "link"}) {
    SCOPED_TRACE(what);
    const Folder folder;
    const fs::path lock = folder / "a.graze" / "lock";
    CampaignWriter first(folder / "a.graze", info(), false);
    write_shard(first, 0, 8);
    fs::remove(lock);
    if (what == std::string("pipe")) {
      ASSERT_EQ(mkfifo(lock.c_str(), 0600), 0);
    } else if (what == std::string("folder")) {
      fs::create_directory(lock);
    } else {
      fs::create_symlink("/etc/hostname", lock);
    }
    EXPECT_THAT(message_of<MachineError>([&] { first.check_in_place(); }), HasSubstr("'graze resume"));
  }
}

// A first writer without a shard leaves as if it had never been; not so when all that is there is another's.
TEST(SecondWriter, WhatTheSecondBeganIsNotTidiedAway) {
  const Folder folder;
  const fs::path path = folder / "a.graze";
  auto first = std::make_unique<CampaignWriter>(path, info(), false);
  fs::remove(path / "lock");
  CampaignWriter second(path, info(), ExistingCampaign{});
  first.reset();
  EXPECT_TRUE(fs::exists(path / "campaign.h5"));
  EXPECT_TRUE(fs::exists(path / "lock"));
  write_shard(second, 0, 8);
  EXPECT_THAT(shard_names(path), ElementsAre("000001.h5"));
}

// Claim: no shard ever takes a name that is there, whoever has put it there, or the name of one that is gone.
TEST(SecondWriter, NamesOfShardsAreNeverUsedAgain) {
  const Folder folder;
  const fs::path path = folder / "a.graze";
  {
    CampaignWriter writer(path, info(), false);
    write_shard(writer, 0, 8);
    put(path / "shards" / "000002.h5", "another writer's");
    write_shard(writer, 8, 16);
    EXPECT_THAT(shard_names(path), ElementsAre("000001.h5", "000002.h5", "000003.h5"));
  }
  EXPECT_EQ(content(path / "shards" / "000002.h5"), "another writer's");
  fs::remove(path / "shards" / "000002.h5");
  fs::remove(path / "shards" / "000003.h5");
  CampaignWriter writer(path, info(), ExistingCampaign{});
  write_shard(writer, 16, 24);
  EXPECT_THAT(shard_names(path), ElementsAre("000001.h5", "000004.h5"));
}

// Claim: what a pack that was killed has left beside its file goes with the next one; what another writes still, and
// files of other names, stay.
TEST(SecondWriter, LeftoversOfAKilledPackGo) {
  const Folder folder;
  write(folder / "a.graze", info());
  const fs::path left = folder / "a.h5.0123456789abcdef.tmp", at_work = folder / "a.h5.fedcba9876543210.tmp";
  for (const fs::path& file : {left, at_work, folder / "a.h5.tmp", folder / "b.h5.0123456789abcdef.tmp"})
    put(file, "x");
  const int held = open(at_work.c_str(), O_RDWR | O_CLOEXEC);
  ASSERT_EQ(flock(held, LOCK_EX), 0);
  pack(folder / "a.graze", folder / "a.h5", false);
  EXPECT_FALSE(fs::exists(left));
  EXPECT_TRUE(fs::exists(at_work));
  EXPECT_TRUE(fs::exists(folder / "a.h5.tmp"));
  EXPECT_TRUE(fs::exists(folder / "b.h5.0123456789abcdef.tmp"));
  close(held);
  pack(folder / "a.graze", folder / "a.h5", true);
  EXPECT_FALSE(fs::exists(at_work));
}

}  // namespace
}  // namespace graze
