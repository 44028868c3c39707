// Where campaigns are written: nothing that was there is lost, a failing disk is one clear error, a killed program
// leaves a readable campaign.
#include <gmock/gmock.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/set_aside.h"
#include "archive/files/files.h"
#include "archive/files/new_folder.h"
#include "tests/archive/compare.h"
#include "tests/archive/tables.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

/// A campaign that may have as many particles as there is space for.
CampaignInfo endless() {
  CampaignInfo facts = info();
  facts.particles = std::uint64_t{1} << 32;
  return facts;
}

void add(CampaignWriter& writer, std::uint32_t first, std::uint32_t last) {
  Block one = block(info(), 0, range(first, last));
  writer.append(0, std::move(one.traces), std::move(one.values));
}

std::size_t entries(const fs::path& path) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(path), fs::directory_iterator()));
}

// Claim: an existing output is refused and stays as it is.
TEST(Output, ExistingIsRefused) {
  const Folder folder;
  write(folder / "a.graze", info());
  EXPECT_THAT(message_of<InputError>([&] { CampaignWriter(folder / "a.graze", info(), false); }),
              AllOf(HasSubstr("a.graze"), HasSubstr("--force")));
  expect_campaign(Archive(folder / "a.graze"));
  put(folder / "file", "x");
  EXPECT_THAT(message_of<InputError>([&] { CampaignWriter(folder / "file", info(), true); }), HasSubstr("is a file"));
  pack(folder / "a.graze", folder / "a.h5", false);
  const std::string before = content(folder / "a.h5");
  EXPECT_THAT(message_of<InputError>([&] { pack(folder / "a.graze", folder / "a.h5", false); }), HasSubstr("--force"));
  EXPECT_TRUE(content(folder / "a.h5") == before);
  pack(folder / "a.graze", folder / "a.h5", true);
  EXPECT_TRUE(content(folder / "a.h5") == before);
}

// Claim: an empty directory may be used.
TEST(Output, EmptyDirectoryIsUsed) {
  const Folder folder;
  fs::create_directory(folder / "a.graze");
  write(folder / "a.graze", info());
  expect_campaign(Archive(folder / "a.graze"));
}

// Claim: with force the old campaign lies aside until the new one has a shard, and is gone after that.
TEST(Output, ForceKeepsTheOldUntilTheFirstShard) {
  const Folder folder;
  write(folder / "a.graze", info());
  CampaignInfo fresh = info();
  fresh.scenario_name = "fresh";
  CampaignWriter writer(folder / "a.graze", fresh, true);
  expect_campaign(Archive(folder / "a.graze" / "replaced"));
  add(writer, 0, 8);
  writer.finish();
  EXPECT_EQ(Archive(folder / "a.graze").info().scenario_name, "fresh");
  EXPECT_EQ(entries(folder.path()), 1u);
}

// Claim: when the new campaign never gets a trace, the old one is back in its place.
TEST(Output, ForceRestoresTheOldWhenTheStartFails) {
  const Folder folder;
  write(folder / "a.graze", info());
  { const CampaignWriter writer(folder / "a.graze", info(), true); }
  expect_campaign(Archive(folder / "a.graze"));
  EXPECT_EQ(entries(folder.path()), 1u);
}

/// What is left when a writer is killed: no destructor runs, the locks end.
void begin_and_kill(const fs::path& campaign, const CampaignInfo& fresh, int traces) {
  const pid_t child = fork();
  if (child == 0) {
    CampaignWriter writer(campaign, fresh, true);
    if (traces > 0) {
      add(writer, 0, traces);
      writer.flush();
    }
    kill(getpid(), SIGKILL);
  }
  waitpid(child, nullptr, 0);
}

// Claim: killed before its first shard, the new campaign leaves the old one to whoever may write there next, and who is
// refused changes nothing; killed later, it is the one that counts.
TEST(Output, ForceLosesNothingWhenItIsKilled) {
  CampaignInfo fresh = info();
  fresh.scenario_name = "fresh";
  for (const int traces : {0, 8}) {
    const Folder folder;
    write(folder / "a.graze", info());
    begin_and_kill(folder / "a.graze", fresh, traces);
    EXPECT_EQ(Archive(folder / "a.graze").info().scenario_name, "fresh");
    EXPECT_EQ(fs::exists(folder / "a.graze" / kReplacedFolder), traces == 0);
    EXPECT_THAT(message_of<InputError>([&] { CampaignWriter(folder / "a.graze", info(), false); }),
                HasSubstr("--force"));
    EXPECT_EQ(fs::exists(folder / "a.graze" / kReplacedFolder), traces == 0);  // who is refused changes nothing
    { const CampaignWriter writer(folder / "a.graze", info(), true); }         // gets no trace, either
    const Archive archive(folder / "a.graze");
    EXPECT_EQ(archive.info().scenario_name, traces == 0 ? info().scenario_name : "fresh");
    if (traces == 0) expect_campaign(archive);
    EXPECT_FALSE(fs::exists(folder / "a.graze" / kReplacedFolder));
  }
}

// Claim: a kill in the middle of setting aside, or of bringing back, is made good.
TEST(Output, WhatIsHalfSetAsideComesBack) {
  for (const char* entry : {"campaign.h5", "shards"}) {
    const Folder folder;
    const fs::path campaign = folder / "a.graze";
    write(campaign, info());
    fs::create_directory(campaign / kReplacingFolder);
    fs::rename(campaign / entry, campaign / kReplacingFolder / entry);
    EXPECT_TRUE(recover_set_aside(campaign));
    expect_campaign(Archive(campaign));
    EXPECT_FALSE(recover_set_aside(campaign));
  }
}

// Claim: what was put into replaced/ and never was a campaign is not removed.
TEST(Output, WhatIsNoCampaignIsNotRemovedAsReplaced) {
  const Folder folder;
  const fs::path campaign = folder / "a.graze";
  write(campaign, info());
  fs::create_directory(campaign / kReplacedFolder);
  put(campaign / kReplacedFolder / "thesis.txt", "years");
  EXPECT_THAT(message_of<InputError>([&] { recover_set_aside(campaign); }), HasSubstr("move it out"));
  EXPECT_EQ(content(campaign / kReplacedFolder / "thesis.txt"), "years");
  fs::rename(campaign / kReplacedFolder / "thesis.txt", campaign / kReplacedFolder / "campaign.h5");
  EXPECT_FALSE(recover_set_aside(campaign));
  EXPECT_FALSE(fs::exists(campaign / kReplacedFolder));
}

// Claim: without force a new file takes nobody's place, not even that of one which appears while it is being written.
TEST(Output, NewFilesTakeNobodysPlaceUnlessForced) {
  for (const bool force : {false, true}) {
    const Folder folder;
    NewFile file(folder / "a.h5", force);
    put(folder / "a.h5", "precious");
    if (force) {
      file.publish();
    } else {
      EXPECT_THAT(message_of<InputError>([&] { file.publish(); }),
                  AllOf(HasSubstr("a.h5: has appeared while"), HasSubstr("--force")));
    }
    EXPECT_EQ(content(folder / "a.h5"), force ? "" : "precious");
  }
  const Folder folder;
  {
    NewFile file(folder / "b.h5", false);
    file.publish();
  }
  EXPECT_TRUE(fs::exists(folder / "b.h5"));
  EXPECT_EQ(entries(folder.path()), 1u);
}

// Claim: a new folder is there whole or not at all, what a process that was killed has left of it goes with the next
// one of its name, and what another one fills still stays, as do other names.
TEST(Output, NewFoldersAreWholeOrNotThere) {
  const Folder folder;
  const fs::path abandoned = folder / "a.sweep.0123456789abcdef.tmp", other = folder / "b.sweep.0123456789abcdef.tmp";
  for (const fs::path& path : {abandoned, other, folder / "a.sweep.old.tmp"}) {
    fs::create_directories(path / "000.graze");
    put(path / "000.graze/x", "left");
  }
  {
    const NewFolder never(folder / "a.sweep");
    EXPECT_FALSE(fs::exists(abandoned));
    put(never.path() / "x", "half");
    const NewFolder beside(folder / "a.sweep");
    EXPECT_TRUE(fs::exists(never.path() / "x")) << "it is being filled";
  }
  EXPECT_EQ(entries(folder.path()), 2u) << "others' alone";
  {
    NewFolder made(folder / "a.sweep"), late(folder / "a.sweep");
    put(made.path() / "x", "whole");
    put(late.path() / "x", "late");
    EXPECT_FALSE(made.publish());
    EXPECT_TRUE(late.publish());
  }
  EXPECT_EQ(content(folder / "a.sweep/x"), "whole");
  EXPECT_EQ(entries(folder.path()), 3u);
}

// Claim: what a campaign leaves that is killed before it is described does not stand in the way of the next.
TEST(Output, WhatHadOnlyBegunIsNoCampaign) {
  const Folder folder;
  fs::create_directories(folder / "a.graze" / "shards");
  put(folder / "a.graze" / "lock", "process 1 on nowhere");
  put(folder / "a.graze" / "campaign.h5.tmp", "half");
  write(folder / "a.graze", info());
  expect_campaign(Archive(folder / "a.graze"));
}

// Claim: a rank that its leader has left behind keeps everybody else out, and nothing is touched.
TEST(Output, ARankLeftBehindStillHoldsTheDirectory) {
  const Folder folder;
  write(folder / "a.graze", info());
  put(folder / "a.graze" / "lock", "process 1 on nowhere");
  {
    const MemberLock left(folder / "a.graze");
    const MemberLock another(folder / "a.graze");
    EXPECT_THAT(message_of<MachineError>([&] { CampaignWriter(folder / "a.graze", info(), true); }),
                HasSubstr("process 1 on nowhere is writing here"));
    EXPECT_THAT(message_of<MachineError>([&] { CampaignWriter(folder / "a.graze", info(), ExistingCampaign{}); }),
                HasSubstr("process 1 on nowhere is writing here"));
    expect_campaign(Archive(folder / "a.graze"));
  }
  EXPECT_NO_THROW(CampaignWriter(folder / "a.graze", info(), ExistingCampaign{}));
}

// Claim: nothing is made of a file by writing over it, nor of a device.
TEST(Output, NeverOverItsSource) {
  const Folder folder;
  write(folder / "a.graze", info());
  for (const char* file : {"a.graze/campaign.h5", "a.graze/shards/000001.h5", "a.graze/new.h5", "b/../a.graze/x.h5"}) {
    EXPECT_THAT(message_of<InputError>([&] { pack(folder / "a.graze", folder / file, true); }), HasSubstr("only read"));
  }
  EXPECT_THAT(message_of<InputError>([&] { pack(folder / "a.graze", "/dev/null", true); }), HasSubstr("a device"));
  EXPECT_NO_THROW(pack(folder / "a.graze", folder / "a.graze.h5", true));
  expect_campaign(Archive(folder / "a.graze"));
}

// Claim: force removes nothing but campaigns.
TEST(Output, ForceSparesOtherFiles) {
  const Folder folder;
  fs::create_directory(folder / "home");
  put(folder / "home" / "thesis.tex", "years");
  EXPECT_THAT(message_of<InputError>([&] { CampaignWriter(folder / "home", info(), true); }), HasSubstr("thesis.tex"));
  EXPECT_EQ(content(folder / "home" / "thesis.tex"), "years");
  write(folder / "a.graze", info());
  put(folder / "a.graze" / "shards" / "notes.txt", "mine");
  EXPECT_THAT(message_of<InputError>([&] { CampaignWriter(folder / "a.graze", info(), true); }),
              HasSubstr("notes.txt"));
}

// Claim: what was appended before an error elsewhere is kept, and the campaign stays incomplete.
TEST(Output, UnfinishedWriterKeepsItsTraces) {
  const Folder folder;
  {
    CampaignWriter writer(folder / "a.graze", info(), false);
    add(writer, 0, 8);
  }
  const Archive archive(folder / "a.graze");
  EXPECT_FALSE(archive.complete());
  expect_policy(archive, 0, 8);
}

// Claim: a place that cannot be written is a MachineError with path and the system's reason.
TEST(Output, PlaceThatCannotBeWritten) {
  const Folder folder;
  EXPECT_THAT(message_of<MachineError>([&] { CampaignWriter(folder / "no" / "a.graze", info(), false); }),
              AllOf(HasSubstr("a.graze"), HasSubstr("No such file or directory")));
  write(folder / "a.graze", info());
  EXPECT_THAT(message_of<MachineError>([&] { pack(folder / "a.graze", folder / "no" / "a.h5", false); }),
              AllOf(HasSubstr("a.h5"), HasSubstr("No such file or directory")));
}

// Claim: the same where permission is missing.
TEST(Output, PlaceWithoutPermission) {
  if (geteuid() == 0) GTEST_SKIP() << "the superuser may write everywhere";
  const Folder folder;
  fs::permissions(folder.path(), fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_THAT(message_of<MachineError>([&] { CampaignWriter(folder / "b.graze", info(), false); }),
              HasSubstr("Permission denied"));
  fs::permissions(folder.path(), fs::perms::owner_all);
}

/// No file may grow beyond so many bytes while this lives; more is an error of write(2), as a full disk is.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(std::size_t bytes) {
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

// Claim: whichever write fails, the first one, one in the middle or the last, there is one MachineError, what was
// written before is readable, and no temporary file stays. (Sizes: the description takes some 110 kB, a shard of 400
// particles some 100 kB.)
TEST(Output, EveryFailingWriteIsOneError) {
  const Folder folder;
  for (std::size_t limit = 1000; limit < 400'000; limit += 12007) {
    SCOPED_TRACE(limit);
    const fs::path path = folder / "a.graze";
    bool begun = false, failed = false;
    {
      const FileSizeLimit limited(limit);
      try {
        CampaignWriter writer(path, endless(), false);
        begun = true;
        add(writer, 0, 400);
        writer.finish();
      } catch (const MachineError& error) {
        failed = true;
        EXPECT_THAT(error.what(), AllOf(HasSubstr("a.graze"), HasSubstr("File too large")));
      }
    }
    EXPECT_EQ(fs::exists(path), begun && !failed);
    if (!failed) expect_policy(Archive(path), 0, 400);
    fs::remove_all(path);
    if (!failed) return;
  }
  ADD_FAILURE() << "the limit was never large enough";
}

// Claim: the same for packing: the campaign stays, the packed file is whole or not there.
TEST(Output, EveryFailingWriteOfPackIsOneError) {
  const Folder folder;
  write(folder / "a.graze", info());
  const auto whole = [&] {
    pack(folder / "a.graze", folder / "whole.h5", true);
    return fs::file_size(folder / "whole.h5");
  }();
  for (std::size_t limit = 1; limit < whole; limit += 1 + whole / 41) {
    SCOPED_TRACE(limit);
    const FileSizeLimit limited(limit);
    EXPECT_THAT(message_of<MachineError>([&] { pack(folder / "a.graze", folder / "a.h5", false); }),
                AllOf(HasSubstr("a.h5"), HasSubstr("File too large")));
    EXPECT_FALSE(fs::exists(folder / "a.h5"));
    EXPECT_FALSE(fs::exists(folder / "a.h5.tmp"));
  }
  expect_campaign(Archive(folder / "a.graze"));
}

/// A file system of a few hundred kilobytes; needs the right to mount.
class SmallDisk {
 public:
  SmallDisk(fs::path path, const char* size) : path_(std::move(path)) {
    fs::create_directory(path_);
    mounted_ = mount("tmpfs", path_.c_str(), "tmpfs", 0, size) == 0;
  }
  ~SmallDisk() {
    if (mounted_) umount(path_.c_str());
  }
  bool mounted() const { return mounted_; }

 private:
  fs::path path_;
  bool mounted_ = false;
};

// Claim: on a full disk appending ends in one MachineError that names the reason; the shards before it are readable;
// after the error the writer adds nothing and can be destroyed.
TEST(Output, FullDisk) {
  const Folder folder;
  const SmallDisk disk(folder / "disk", "size=1m");
  if (!disk.mounted()) GTEST_SKIP() << "mounting is not permitted";
  const fs::path path = folder / "disk" / "a.graze";
  CampaignDirectory directory(path, endless(), false);
  std::uint32_t written = 0;
  const std::string message = message_of<MachineError>([&] {
    for (;; written += 400) {
      ShardBuffer buffer(3);
      Block one = block(info(), 0, range(written, written + 400));
      buffer.add(0, std::move(one.traces), one.values, info().parameters.size());
      directory.add_shard(std::move(buffer));
    }
  });
  EXPECT_THAT(message, AllOf(HasSubstr("a.graze"), HasSubstr("No space left on device")));
  EXPECT_GT(written, 0u);
  expect_policy(Archive(path), 0, written);
}

// Claim: a program that is killed at any instant leaves a campaign that can be read, with a part of its traces, each of
// them whole.
TEST(Output, KilledWriterLeavesAReadableCampaign) {
  const Folder folder;
  for (int trial = 0; trial < 12; ++trial) {
    const fs::path path = folder / std::to_string(trial);
    const pid_t child = fork();
    if (child == 0) {
      CampaignDirectory directory(path, endless(), false);
      for (std::uint32_t first = 0;; first += 8) {
        ShardBuffer buffer(3);
        Block one = block(info(), 0, range(first, first + 8));
        buffer.add(0, std::move(one.traces), one.values, info().parameters.size());
        directory.add_shard(std::move(buffer));
      }
    }
    while (!fs::exists(path / "campaign.h5")) usleep(100);
    usleep(static_cast<useconds_t>(3700 * trial));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    const Archive archive(path);
    EXPECT_FALSE(archive.complete());
    expect_policy(archive, 0, static_cast<std::uint32_t>(table_of(archive, "step/1cm").size()));
  }
}

}  // namespace
}  // namespace graze
