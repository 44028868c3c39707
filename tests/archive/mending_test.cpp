// Claim: what verify() says of a campaign directory that somebody has damaged, is what `graze resume` finds there: what
// comes back, what goes, and where it stops because some would be lost.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/campaign_files.h"
#include "archive/directory/finished.h"
#include "archive/directory/newer_format.h"
#include "archive/directory/set_aside.h"
#include "archive/hdf5/reading_child.h"
#include "archive/verify.h"
#include "tests/archive/forge.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
namespace fs = std::filesystem;
class Mending : public ::testing::Test {
 protected:
  Mending() { write(campaign_, facts()); }
  static CampaignInfo facts() {
    CampaignInfo out = info();
    out.particles = 8;
    out.scenario_text = "graze: 1";
    return out;
  }
  Verification found() const { return verify(campaign_); }
  std::string what(const std::string& name) const {
    for (const VerifiedFile& one : found().files) {
      if (one.name == name) return std::string(state_name(one.state)) + ": " + one.what;
    }
    return "";
  }
  /// Moves all but the lock there, as --force does; `fresh`: another campaign begins in its place.
  void set_aside_in(const char* folder, bool fresh) const {
    fs::rename(campaign_, folder_ / "old");
    fresh ? write(campaign_, facts()) : void(fs::create_directory(campaign_));
    fs::rename(folder_ / "old", campaign_ / folder);
  }
  std::string stuck() const {
    const Verification out = found();
    EXPECT_EQ(out.soundness, Soundness::damaged);
    EXPECT_EQ(interrupted_replacing(campaign_).what, Replacing::stuck);
    const std::string why = message_of<InputError>([&] { recover_set_aside(campaign_); });
    EXPECT_THAT(out.faults, ElementsAre(why));
    EXPECT_EQ(replacing_text(campaign_), why + "; 'graze resume " + campaign_.string() + "' refuses until then");
    return why;
  }

  Folder folder_;
  fs::path campaign_ = folder_ / "a.graze";
};

TEST_F(Mending, ALockWithAnotherNameStopsIt) {
  put(folder_ / "elsewhere", "");
  fs::create_hard_link(folder_ / "elsewhere", campaign_ / kLockFile);
  EXPECT_EQ(found().soundness, Soundness::damaged);
  EXPECT_THAT(found().faults, ElementsAre(HasSubstr("lock: has another name elsewhere (a hard link)")));
  fs::remove(folder_ / "elsewhere");
  EXPECT_EQ(found().soundness, Soundness::whole);
}

TEST_F(Mending, UnfinishedTracesAreCounted) {
  add_unfinished(campaign_, {"hold", 1, "timeout"});
  EXPECT_EQ(found().unfinished, 1u);
  fs::remove(campaign_ / kUnfinishedFile);
  ASSERT_EQ(mkfifo((campaign_ / kUnfinishedFile).c_str(), 0600), 0);
  EXPECT_THAT(what(kUnfinishedFile), AllOf(HasSubstr("damaged: is a named pipe"), HasSubstr("puts it into damaged/")));
  EXPECT_EQ(found().soundness, Soundness::incomplete);
  put(campaign_ / kDamagedFolder, "");
  EXPECT_EQ(found().soundness, Soundness::damaged);
  EXPECT_THAT(found().faults, ElementsAre(HasSubstr("'graze resume' needs the place: move it away")));
}

TEST_F(Mending, PlacesAreClearedAndTold) {
  put(campaign_ / kDescriptionFile, "?");
  fs::remove(campaign_ / kDescriptionCopy);
  fs::create_directory(campaign_ / kUnfinishedFile);
  EXPECT_THAT(message_of<InputError>([&] { described_by(campaign_, description_files(campaign_)); }),
              AllOf(HasSubstr("campaign.h5: is not an HDF5 file"), HasSubstr("nor is its copy of use: is not there"),
                    HasSubstr("1 shard can be kept")));
  EXPECT_THAT(clear_places(campaign_, description_files(campaign_)),
              ElementsAre(AllOf(HasSubstr("campaign.h5: is not an HDF5 file"),
                                HasSubstr("it is written anew, and what was there lies in damaged/")),
                          AllOf(HasSubstr("unfinished.jsonl: is a directory"), HasSubstr("it lies in damaged/ now"))));
  EXPECT_EQ(content(campaign_ / "damaged/campaign.h5"), "?");
  EXPECT_TRUE(fs::is_directory(campaign_ / "damaged/unfinished.jsonl"));
  EXPECT_FALSE(fs::exists(campaign_ / kDescriptionFile));
  EXPECT_THAT(clear_places(campaign_, description_files(campaign_)),
              ElementsAre(HasSubstr("campaign.h5: is not there; it is written anew")));
  EXPECT_EQ(foreign_entry(campaign_), std::nullopt) << "damaged/ may hold anything with a campaign's names";
}

TEST_F(Mending, FoldersWithTemporaryNamesStay) {
  fs::create_directory(campaign_ / "shards/000009.h5.tmp");
  put(campaign_ / "manifest/all.jsonl.tmp", "");
  EXPECT_EQ(what("shards/000009.h5.tmp"), "leftover: is a directory, which no write has left; it stays");
  EXPECT_EQ(what("manifest/all.jsonl.tmp"), "leftover: of a write that was cut off; 'graze resume' removes it");
  const DirectoryLock lock(campaign_);
  EXPECT_EQ(what("manifest/all.jsonl.tmp"), "") << "the writer is at work on it";
  EXPECT_TRUE(found().writer);
}

TEST_F(Mending, ShardsOfAnotherCampaignAreTold) {
  CampaignInfo other = facts();
  other.seed = 1;
  write(folder_ / "b.graze", other);
  fs::copy(folder_ / "b.graze/shards/000001.h5", campaign_ / "shards/000002.h5");
  EXPECT_THAT(what("shards/000002.h5"), AllOf(HasSubstr("damaged: belongs to another campaign"),
                                              HasSubstr("'graze resume' puts it into damaged/")));
  EXPECT_EQ(found().soundness, Soundness::incomplete);
  EXPECT_EQ(found().traces, 24u);
}

/// Changes a file through HDF5 and seals it anew.
void change(const fs::path& path, const std::function<void(hid_t)>& act) {
  constexpr int kSealBytes = 24;
  fs::resize_file(path, fs::file_size(path) - kSealBytes);
  {
    const hdf5::Lock lock;
    const hdf5::Handle file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose, path.string());
    act(file.id());
  }
  reseal(path, false);
}

TEST_F(Mending, AShardWithoutDigestsIsDamaged) {
  change(campaign_ / "shards/000001.h5", [](hid_t f) { drop(f, "traces/hold/digest"); });
  fs::remove_all(campaign_ / "manifest");
  EXPECT_THAT(what("shards/000001.h5"), AllOf(HasSubstr("'traces/hold/digest'"), HasSubstr("'graze resume' puts it")));
  EXPECT_THROW(Archive(campaign_).scan("hold", 0, [](const TraceRows&) {}), InputError);
  EXPECT_THAT(repair_and_list(campaign_, facts()).notes, ElementsAre(HasSubstr("it lies in damaged/ now")));
}

void make_newer(hid_t file) {
  hdf5::check(H5Adelete(file, "format_version"), "format_version");
  hdf5::write_attribute(file, "format_version", std::uint64_t{kArchiveFormatVersion + 6});
}

// Claim: what a newer program has written is not damaged: verify says that resume refuses it, and a repair is stopped
// before it changes anything. Only a file whose seal fits is believed.
TEST_F(Mending, NewerFilesAreNotTakenForDamaged) {
  EXPECT_NO_THROW(refuse_newer_files(campaign_));
  for (const std::string name : {"shards/000001.h5", kDescriptionFile, kDescriptionCopy}) {
    SCOPED_TRACE(name);
    const std::string whole = content(campaign_ / name);
    change(campaign_ / name, make_newer);
    EXPECT_THAT(message_of<InputError>([&] { refuse_newer_files(campaign_); }),
                AllOf(HasSubstr("a.graze/" + name + ": has format version 7, newer than version 1"),
                      HasSubstr("use a newer Graze; nothing was changed")));
    EXPECT_THAT(what(name), AllOf(HasSubstr("newer: has format version 7"), HasSubstr("'graze resume' refuses it")));
    EXPECT_EQ(found().soundness, Soundness::damaged);
    EXPECT_TRUE(found().faults.empty());
    const std::string newer = content(campaign_ / name);
    put(campaign_ / name, newer.substr(0, newer.size() - 1) + static_cast<char>(newer.back() ^ 1));
    EXPECT_NO_THROW(refuse_newer_files(campaign_));
    EXPECT_THAT(what(name), HasSubstr("damaged: "));
    put(campaign_ / name, whole);
  }
  for (const char* name : {kDescriptionFile, kDescriptionCopy}) change(campaign_ / name, make_newer);
  EXPECT_THAT(message_of<InputError>([&] { refuse_newer_files(campaign_); }), HasSubstr("as have 1 more files here"));
  EXPECT_TRUE(found().faults.empty()) << "somebody can read what describes it";
  set_aside_in(kReplacingFolder, false);
  EXPECT_THAT(message_of<InputError>([&] { refuse_newer_files(campaign_); }), HasSubstr("replacing/campaign.h5: has"));
}

TEST_F(Mending, CountsDecideWhetherItIsWhole) {
  EXPECT_EQ(found().soundness, Soundness::whole);
  write(folder_ / "open.graze", facts(), false);
  EXPECT_EQ(verify(folder_ / "open.graze").soundness, Soundness::incomplete) << "nobody has said that it is complete";
  pack(folder_ / "open.graze", folder_ / "open.h5", false);
  EXPECT_EQ(verify(folder_ / "open.h5").soundness, Soundness::incomplete);
  CampaignInfo more = facts();
  more.particles = 9;
  {
    CampaignWriter writer(folder_ / "few.graze", more, false);
    Block one = block(more, 0, range(0, 8));
    writer.append(0, std::move(one.traces), std::move(one.values));
    writer.finish();
  }
  EXPECT_EQ(verify(folder_ / "few.graze").soundness, Soundness::incomplete);
  EXPECT_EQ(verify(folder_ / "few.graze").left(), 19u);
  pack(folder_ / "few.graze", folder_ / "few.h5", false);
  EXPECT_EQ(verify(folder_ / "few.h5").soundness, Soundness::incomplete) << "pack has counted";
  pack(folder_ / "few.graze", folder_ / "few.h5", true, PackedContent::trusted);
  EXPECT_EQ(verify(folder_ / "few.h5").soundness, Soundness::damaged);
  EXPECT_THAT(verify(folder_ / "few.h5").faults, ElementsAre(HasSubstr("few.h5: says that it is complete")));
}

TEST_F(Mending, TheOldCampaignComesBackIfTheNewHasNoShard) {
  set_aside_in(kReplacedFolder, true);
  fs::remove_all(campaign_ / "shards");
  fs::remove_all(campaign_ / "manifest");
  EXPECT_EQ(interrupted_replacing(campaign_).what, Replacing::comes_back);
  EXPECT_EQ(found().soundness, Soundness::incomplete);
  EXPECT_THAT(what(kReplacedFolder), HasSubstr("set aside: a 'graze run --force' here ended before its campaign had a "
                                               "shard; 'graze resume "));
  put(campaign_ / kReplacedFolder / kLockFile, "a copy's");
  put(campaign_ / kLockFile, "");
  EXPECT_TRUE(recover_set_aside(campaign_));
  EXPECT_EQ(found().soundness, Soundness::whole);
}

// What only has the name of a shard is none, and what nothing describes is of no use.
TEST_F(Mending, WhatComesBackHasToBeDescribed) {
  set_aside_in(kReplacedFolder, true);
  fs::remove_all(campaign_ / "manifest");
  put(campaign_ / "shards/000001.h5", "?");
  for (const char* name : {kDescriptionFile, kDescriptionCopy}) put(campaign_ / kReplacedFolder / name, "?");
  EXPECT_THAT(stuck(), HasSubstr("campaign.copy.h5: is there, and in replaced/, too; move one of them out"));
  fs::remove(campaign_ / "shards/000001.h5");
  EXPECT_EQ(interrupted_replacing(campaign_).what, Replacing::comes_back);
  EXPECT_EQ(found().soundness, Soundness::damaged);
  EXPECT_THAT(found().faults, ElementsAre(HasSubstr("nothing is left that describes the campaign")));
}

TEST_F(Mending, TheOldCampaignGoesIfTheNewHasHadAShard) {
  set_aside_in(kReplacedFolder, true);
  EXPECT_THAT(what(kReplacedFolder), HasSubstr("set aside: what --force replaced; 'graze resume' removes it"));
  EXPECT_THAT(Archive(campaign_).warnings(), ElementsAre(HasSubstr("what this campaign has replaced is in replaced/")));
  put(campaign_ / kDescriptionFile, "?");
  EXPECT_EQ(interrupted_replacing(campaign_).what, Replacing::goes) << "its copy describes it";
  fs::remove(campaign_ / "shards/000001.h5");
  EXPECT_EQ(interrupted_replacing(campaign_).what, Replacing::goes) << "the manifest names the lost shard";
  put(campaign_ / kDescriptionCopy, "?");
  EXPECT_THAT(stuck(), HasSubstr("this campaign has no whole description; move replaced/ out"));
  fs::remove_all(campaign_ / kReplacedFolder);
  EXPECT_EQ(interrupted_replacing(campaign_).what, Replacing::none);
}

TEST_F(Mending, WhatIsHalfSetAsideMayTakeNothingsPlace) {
  set_aside_in(kReplacingFolder, false);
  EXPECT_EQ(interrupted_replacing(campaign_).what, Replacing::comes_back);
  put(campaign_ / kDescriptionFile, "somebody's");
  EXPECT_THAT(stuck(), HasSubstr("campaign.h5: is there, and in replacing/, too"));
  EXPECT_THROW(put_back(campaign_), InputError);
  EXPECT_EQ(content(campaign_ / kDescriptionFile), "somebody's");
  fs::remove(campaign_ / kDescriptionFile);
  put(campaign_ / kReplacingFolder / "thesis.txt", "years");
  EXPECT_THAT(stuck(), HasSubstr("thesis.txt: is not part of a campaign that --force set aside"));
  fs::remove(campaign_ / kReplacingFolder / "thesis.txt");
  fs::create_directory(campaign_ / kReplacedFolder);
  EXPECT_THAT(stuck(), HasSubstr("has both replaced/ and replacing/, which no --force leaves"));
  fs::remove(campaign_ / kReplacedFolder);
  EXPECT_TRUE(recover_set_aside(campaign_));
  EXPECT_EQ(found().soundness, Soundness::whole);
}

// Claim: a writer that got no trace leaves a list of particles to be resumed, and nothing else.
TEST_F(Mending, AWriterWithUnfinishedTracesStays) {
  for (const bool unfinished : {true, false}) {
    const fs::path path = folder_ / "new.graze";
    {
      CampaignWriter writer(path, facts(), false);
      if (unfinished) writer.add_unfinished({"hold", 1, "timeout"});
    }
    EXPECT_EQ(fs::exists(path / kDescriptionFile), unfinished);
    fs::remove_all(path);
  }
}

// Claim: numbers of shards that no campaign reaches are not counted on from.
TEST_F(Mending, OverlargeNumbersAreNotContinued) {
  fs::copy(campaign_ / "shards/000001.h5", campaign_ / "shards/1000000000.h5");
  fs::copy(campaign_ / "shards/000001.h5", campaign_ / "shards/r00002-000017.h5");
  const CampaignWriter writer(campaign_, facts(), ExistingCampaign{});
  EXPECT_EQ(writer.shards(), 17);
}

// Claim: a child may take what files really have on the disk, in a directory and its shards, and no link leads on.
TEST_F(Mending, LimitsFollowTheBytesOnDisk) {
  const Folder folder;
  const std::uint64_t none = reading_limits({folder.path()}).memory;
  put(folder / "f", std::string(1 << 20, 'x'));
  EXPECT_EQ(reading_limits({folder.path()}).memory, none + (std::uint64_t{2} << 20));
  EXPECT_EQ(reading_limits({folder / "f", folder / "f"}).memory, none + (std::uint64_t{4} << 20));
  EXPECT_EQ(reading_limits({folder / "f"}, 10).seconds, 40u);
  put(folder / "sparse", "");
  fs::resize_file(folder / "sparse", std::uintmax_t{1} << 40);
  EXPECT_LT(reading_limits({folder / "sparse"}).memory, none + (1 << 20));
  fs::create_directory(folder / "c");
  fs::create_directory_symlink(folder.path(), folder / "c/shards");
  EXPECT_EQ(reading_limits({folder / "c"}).memory, none);
}

}  // namespace
}  // namespace graze
