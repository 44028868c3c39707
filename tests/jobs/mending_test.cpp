// Claim: whatever somebody has put into a campaign's directory, or taken from it, `verify` and `status` say what
// `resume` does about it, and nothing is lost by that.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <map>
#include <set>

#include "tests/archive/forge.h"
#include "tests/jobs/ball_campaign.h"
#include "tests/jobs/process.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Result;
namespace fs = std::filesystem;

/// A campaign of 20 traces, and another of 10.
class Mending : public ::testing::Test, public testing::BallCampaign {
 protected:
  static constexpr fs::copy_options kAll = fs::copy_options::recursive;

  Mending() {
    EXPECT_EQ(graze("run ball.yaml -n 20 --quiet -o whole.graze").code, 0);
    EXPECT_EQ(graze("run ball.yaml -n 10 --seed 9 --quiet -o b.graze").code, 0);
    EXPECT_EQ(graze("pack b.graze -o b.h5").code, 0);
    wanted = testing::digests(folder / "whole.graze");
    renew();
  }
  fs::path at(const std::string& name) const { return folder / "a.graze" / name; }
  void renew() const {
    fs::remove_all(folder / "a.graze");
    fs::copy(folder / "whole.graze", folder / "a.graze", kAll);
  }
  /// The content of all files below the campaign's directory.
  std::multiset<std::string> contents() const {
    std::multiset<std::string> out;
    for (const auto& entry : fs::recursive_directory_iterator(folder / "a.graze")) {
      if (entry.is_regular_file()) out.insert(testing::read_file(entry.path()));
    }
    return out;
  }

  testing::Digests wanted;
};

struct Place {
  const char* name;
  const char* kind;
  int verify;  // exit code
};

// Claim: the exit code of verify foretells that of resume for each kind of thing in each place; what resume cannot mend
// it leaves as it is, and what it can is whole afterwards.
TEST_F(Mending, VerifyForetellsWhatResumeDoes) {
  const Place places[] = {
      {"campaign.h5", "pipe", 3},
      {"campaign.h5", "folder", 3},
      {"campaign.h5", "link", 3},
      {"campaign.h5", "packed", 3},
      {"campaign.copy.h5", "pipe", 3},
      {"campaign.copy.h5", "folder", 3},
      {"campaign.copy.h5", "text", 3},
      {"unfinished.jsonl", "pipe", 3},
      {"unfinished.jsonl", "folder", 3},
      {"damaged", "pipe", 0},
      {"manifest", "pipe", 2},
      {"manifest/all.jsonl", "pipe", 3},
      {"manifest/all.jsonl", "folder", 3},
      {"manifest/all.jsonl", "link", 3},
      {"manifest/x.jsonl", "pipe", 3},
      {"shards", "link", 2},
      {"shards/000001.h5", "folder", 3},
      {"lock", "pipe", 2},
      {"lock", "hard link", 2},
      {"replaced", "pipe", 2},
      {"replacing", "campaign", 2},
      {"replacing", "folder", 3},
      {"replaced", "campaign", 0},
      {"thesis.txt", "text", 0},
  };
  for (const Place& place : places) {
    SCOPED_TRACE(std::string(place.kind) + " at " + place.name);
    const std::string kind = place.kind;
    renew();
    fs::remove_all(at(place.name));
    if (kind == "pipe") mkfifo(at(place.name).c_str(), 0600);
    if (kind == "folder") fs::create_directory(at(place.name));
    if (kind == "link") fs::create_symlink(folder / "b.graze" / place.name, at(place.name));
    if (kind == "hard link") fs::create_hard_link(folder / "ball.urdf", at(place.name));
    if (kind == "packed") fs::copy_file(folder / "b.h5", at(place.name));
    if (kind == "text") testing::write_file(at(place.name), "mine");
    if (kind == "campaign") fs::copy(folder / "b.graze", at(place.name), kAll);
    const auto before = contents();
    const Result verified = graze("verify a.graze");
    EXPECT_EQ(verified.code, place.verify) << verified.out << verified.err;
    const Result resumed = graze("resume a.graze --quiet");
    EXPECT_EQ(resumed.code, place.verify == 2 ? 2 : 0) << resumed.err;
    EXPECT_THAT(resumed.err, AllOf(Not(HasSubstr("is writing here")), Not(HasSubstr("graze resume"))));
    if (place.verify == 2) {
      EXPECT_EQ(contents(), before);
      continue;
    }
    EXPECT_EQ(graze("verify a.graze").code, 0);
    EXPECT_EQ(testing::digests(folder / "a.graze"), wanted);
    if (kind == "text" || kind == "packed") {
      EXPECT_EQ(contents().count(kind == "text" ? "mine" : testing::read_file(folder / "b.h5")), 1u);
    }
  }
}

// Claim: where replaced/ and replacing/ hold what no --force leaves, all verbs say so and what to do, and nothing is
// moved or removed until it is done.
TEST_F(Mending, WhatNoForceLeavesIsLeftAlone) {
  const auto refuses = [&](const std::string& what) {
    SCOPED_TRACE(what);
    const auto before = contents();
    const Result verified = graze("verify a.graze");
    EXPECT_EQ(verified.code, 2);
    EXPECT_THAT(verified.out, AllOf(HasSubstr(what), HasSubstr("out of the campaign's directory")));
    const Result status = graze("status a.graze");
    EXPECT_THAT(status.err, HasSubstr(what));
    EXPECT_THAT(status.out, AllOf(Not(HasSubstr("does the rest")), Not(HasSubstr("brings back"))));
    const Result resumed = graze("resume a.graze --quiet");
    EXPECT_EQ(resumed.code, 2);
    EXPECT_THAT(resumed.err, AllOf(HasSubstr(what), HasSubstr("out of the campaign's directory")));
    EXPECT_EQ(contents(), before);
  };
  const auto copy = [&](const char* name) { fs::copy(folder / "b.graze", at(name), kAll); };
  copy("replaced");
  copy("replacing");
  refuses("a.graze: has both replaced/ and replacing/");
  fs::remove_all(at("replacing"));
  fs::create_directory(at("replacing"));
  testing::write_file(at("replacing/odd"), "mine");
  refuses("a.graze: has both replaced/ and replacing/");
  fs::remove_all(at("replaced"));
  refuses("replacing/odd: is not part of a campaign");
  fs::remove_all(at("replacing"));
  copy("replaced");
  testing::write_file(at("replaced/thesis.txt"), "mine");
  refuses("replaced/thesis.txt: is not part of a campaign");
  fs::remove(at("replaced/thesis.txt"));
  for (const char* name : {"campaign.h5", "campaign.copy.h5"}) fs::remove(at(name));
  refuses("replaced: what this campaign has replaced would be removed");
  for (const char* name : {"shards", "manifest"}) fs::remove_all(at(name));
  fs::create_directory(at("shards"));
  testing::write_file(at("shards/000001.h5"), "no shard, so that nothing goes for its sake");
  refuses("a.graze/shards: is there, and in replaced/, too");
}

// Claim: a campaign that comes back without a description was no campaign before, and verify does not say that it is
// mended.
TEST_F(Mending, WhatComesBackMustBeDescribed) {
  fs::create_directory(at("replacing"));
  for (const char* name : {"shards", "manifest"}) fs::rename(at(name), at("replacing") / name);
  EXPECT_EQ(graze("verify a.graze").code, 3);
  for (const char* name : {"campaign.h5", "campaign.copy.h5"}) fs::remove(at(name));
  EXPECT_EQ(graze("verify a.graze").code, 2);
  EXPECT_EQ(graze("resume a.graze").code, 2);

  renew();  // and nothing is promised of one that is refused for another reason
  fs::create_directory(at("replacing"));
  fs::remove_all(at("manifest"));
  testing::write_file(at("manifest"), "mine");
  for (const std::string verb : {"verify", "status", "resume"}) {
    const Result run = graze(verb + " a.graze");
    EXPECT_EQ(run.code, 2) << verb;
    EXPECT_THAT(run.err, AllOf(HasSubstr("manifest: is a file"), Not(HasSubstr("back")))) << verb;
  }
}

// Claim: resume does not advise itself; what it mends it says, and that it does.
TEST_F(Mending, ResumeSaysWhatItMends) {
  testing::write_file(at("campaign.h5"), "no archive");
  EXPECT_THAT(graze("status a.graze").err, HasSubstr("'graze resume a.graze' mends that"));
  const Result resumed = graze("resume a.graze --quiet");
  EXPECT_EQ(resumed.code, 0);
  EXPECT_THAT(resumed.err, AllOf(HasSubstr("campaign.h5: is not an HDF5 file"), HasSubstr("written anew"),
                                 HasSubstr("lies in damaged/"), Not(HasSubstr("graze resume"))));
  EXPECT_EQ(testing::read_file(at("damaged/campaign.h5")), "no archive");
}

// Claim: a shard of a newer program is no damaged one: resume refuses, names both versions, and changes nothing.
TEST_F(Mending, ResumeLeavesNewerShardsAlone) {
  const fs::path shard = at("shards/000001.h5");
  fs::resize_file(shard, fs::file_size(shard) - 24);  // its seal
  {
    const hdf5::Lock lock;
    const hdf5::Handle file(H5Fopen(shard.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose, "shard");
    hdf5::check(H5Adelete(file.id(), "format_version"), "format_version");
    hdf5::write_attribute(file.id(), "format_version", std::uint64_t{2});
  }
  synthetic::reseal(shard, false);
  fs::remove_all(at("manifest"));
  const auto before = contents();
  EXPECT_EQ(graze("verify a.graze").code, 2);
  for (const std::string verb : {"resume a.graze --quiet", "score a.graze", "status a.graze"}) {
    const Result run = graze(verb);
    EXPECT_EQ(run.code, 2) << verb;
    EXPECT_THAT(run.err, HasSubstr("shards/000001.h5: has format version 2, newer than version 1")) << verb;
  }
  EXPECT_EQ(contents(), before);
  EXPECT_FALSE(fs::exists(at("damaged")));
}

// Claim: what never was an archive is not called a damaged one.
TEST_F(Mending, WhatNeverWasAnArchiveIsNotDamaged) {
  testing::write_file(folder / "part.csv", "particle,x\n1,2\n");
  for (const std::string name : {"part.csv", "/dev/null", "ball.yaml"}) {
    const Result run = graze("verify " + name);
    EXPECT_EQ(run.code, 2);
    EXPECT_EQ(run.out, "");
    EXPECT_THAT(run.err, AllOf(HasSubstr(name + ": is "), Not(HasSubstr("damaged"))));
  }
}

// Claim: a writer whose descriptions are removed writes them anew before its next shard, so that shards are always of
// use.
TEST_F(Mending, AWriterKeepsItsCampaignDescribed) {
  testing::Process process(folder.path(), "run ball.yaml -n 100000000 --threads 1 --quiet --ignore-space -o c.graze");
  const fs::path path = folder / "c.graze";
  process.wait_until([&] { return fs::exists(path / "shards/000001.h5"); });
  for (const char* name : {"campaign.h5", "campaign.copy.h5"}) fs::remove(path / name);
  process.wait_until([&] { return fs::exists(path / "shards/000002.h5"); });
  process.send(SIGKILL);
  process.wait();
  EXPECT_TRUE(fs::exists(path / "campaign.h5"));
  EXPECT_EQ(graze("verify c.graze").code, 3) << "it was killed, and can go on";
}

}  // namespace
}  // namespace graze
