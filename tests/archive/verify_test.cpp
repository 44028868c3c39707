// Claim: verify() says of every file of an archive whether it is whole, and of the archive what resume would mend; it
// changes nothing.
#include "archive/verify.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <limits>
#include <map>

#include "archive/directory/campaign_directory.h"
#include "archive/schema/schema.h"
#include "tests/archive/forge.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;
using FileState = VerifiedFile::State;

/// A campaign of three policies and 16 particles in two shards of 24 traces each.
class Verify : public ::testing::Test {
 protected:
  Verify() {
    CampaignInfo facts = info();
    facts.particles = 16;
    facts.scenario_text = "graze: 1";
    CampaignWriter writer(campaign_, facts, false);
    for (std::uint32_t first = 0; first < 16; first += 8) {
      for (int policy = 0; policy < 3; ++policy) {
        Block one = block(facts, policy, range(first, first + 8));
        writer.append(policy, std::move(one.traces), std::move(one.values));
      }
      writer.flush();
    }
    writer.finish(true);
  }

  VerifiedFile file(const std::string& name) const { return file(verify(campaign_), name); }
  static VerifiedFile file(const Verification& found, const std::string& name) {
    for (const VerifiedFile& one : found.files) {
      if (one.name == name) return one;
    }
    ADD_FAILURE() << name << " is not listed";
    return {};
  }
  static void flip(const fs::path& path) {
    std::string bytes = content(path);
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
    put(path, bytes);
  }
  std::map<std::string, std::string> everything() const {
    std::map<std::string, std::string> out;
    for (const auto& entry : fs::recursive_directory_iterator(campaign_)) {
      if (entry.is_regular_file()) out[entry.path().string()] = content(entry.path());
    }
    return out;
  }

  Folder folder_;
  fs::path campaign_ = folder_ / "a.graze";
  fs::path shard_ = campaign_ / "shards" / "000001.h5";
};

TEST_F(Verify, AWholeCampaign) {
  const auto before = everything();
  const Verification found = verify(campaign_);
  EXPECT_EQ(found.soundness, Soundness::whole);
  EXPECT_EQ(found.shards, 2u);
  EXPECT_EQ(found.traces, 48u);
  EXPECT_EQ(found.total, 48u);
  EXPECT_EQ(found.left(), 0u);
  for (const VerifiedFile& one : found.files) EXPECT_EQ(one.state, FileState::whole) << one.name << one.what;
  EXPECT_EQ(everything(), before);
  pack(campaign_, folder_ / "a.h5", false);
  EXPECT_EQ(verify(folder_ / "a.h5").soundness, Soundness::whole);
  EXPECT_EQ(verify(folder_ / "a.h5").traces, 48u);
}

TEST_F(Verify, DamagedAndMissingShardsAreMendable) {
  flip(shard_);
  const Verification found = verify(campaign_);
  EXPECT_EQ(found.soundness, Soundness::incomplete);
  EXPECT_EQ(found.lost, 24u);
  EXPECT_EQ(found.left(), 24u);
  EXPECT_EQ(file("shards/000001.h5").state, FileState::damaged);
  EXPECT_THAT(file("shards/000001.h5").what, AllOf(HasSubstr("does not fit its checksum"), HasSubstr("damaged/")));
  EXPECT_EQ(file("shards/000002.h5").state, FileState::whole);
  fs::remove(shard_);
  EXPECT_EQ(file("shards/000001.h5").state, FileState::missing);
  EXPECT_EQ(verify(campaign_).left(), 24u);
}

TEST_F(Verify, LeftoversHarmNothing) {
  put(campaign_ / "shards" / "000003.h5.tmp", "half");
  EXPECT_EQ(file("shards/000003.h5.tmp").state, FileState::leftover);
  EXPECT_EQ(verify(campaign_).soundness, Soundness::whole);
}

TEST_F(Verify, OneDescriptionIsEnough) {
  fs::rename(campaign_ / kDescriptionCopy, folder_ / "copy");
  EXPECT_EQ(file(kDescriptionCopy).state, FileState::missing);
  EXPECT_EQ(verify(campaign_).soundness, Soundness::whole) << "as older archives are";
  fs::rename(folder_ / "copy", campaign_ / kDescriptionCopy);
  flip(campaign_ / kDescriptionFile);
  EXPECT_EQ(verify(campaign_).soundness, Soundness::incomplete);
  EXPECT_THAT(file(kDescriptionFile).what, HasSubstr("writes it anew"));
  EXPECT_EQ(verify(campaign_).traces, 48u);
  flip(campaign_ / kDescriptionCopy);
  EXPECT_EQ(verify(campaign_).soundness, Soundness::damaged);
}

TEST_F(Verify, ContentIsReadBehindTheSeal) {
  pack(campaign_, folder_ / "a.h5", false);
  const auto forged_ends = [&](const std::function<void(hid_t)>& change) {
    const Verification found = verify(forged(folder_, folder_ / "a.h5", change));
    EXPECT_EQ(found.soundness, Soundness::damaged);
    return found.files.at(0).what;
  };
  EXPECT_THAT(forged_ends([](hid_t f) { hdf5::make_group(f, "a/b"), H5Lcreate_hard(f, "/", f, "a/b/c", 0, 0); }),
              HasSubstr("'a/b/c' is an object that has another name"));
  EXPECT_THAT(forged_ends([](hid_t f) { H5Lcreate_soft("/nowhere", f, "soft", 0, 0); }),
              HasSubstr("'soft' is no hard"));
  EXPECT_THAT(forged_ends([](hid_t f) { drop(f, "traces/hold/final_v"); }), HasSubstr("final_v"));
  EXPECT_THAT(forged_ends([](hid_t f) { drop(f, "telemetry/hold/tau"); }), HasSubstr("tau"));
}

TEST_F(Verify, TimesLieInTheirTraces) {
  pack(campaign_, folder_ / "a.h5", false);
  for (const double time : {-1.0, std::numeric_limits<double>::infinity(), 1e9}) {
    const fs::path file = forged(folder_, folder_ / "a.h5", [&](hid_t f) {
      replace(f, "traces/hold", schema::end_time(), std::vector<double>(16, time));
    });
    const Verification found = verify(file);
    EXPECT_EQ(found.soundness, Soundness::damaged);
    EXPECT_THAT(found.files.at(0).what, HasSubstr("'traces/hold/end_time'"));
    EXPECT_THAT(found.files.at(0).what, HasSubstr("does not lie in a trace"));
  }
}

// A new seal would make it look whole.
TEST_F(Verify, WhatIsDamagedIsNotPacked) {
  fs::remove_all(campaign_ / "manifest");
  const fs::path shard = campaign_ / "shards" / "000001.h5";
  fs::resize_file(shard, fs::file_size(shard) - 24);  // its seal
  {
    const hdf5::Lock lock;
    const hdf5::Handle file(H5Fopen(shard.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose, shard.string());
    replace(file.id(), "traces/hold", schema::outcome(), std::vector<std::uint8_t>(8, 1));  // without a requirement
  }
  reseal(shard, false);
  EXPECT_NE(verify(campaign_).soundness, Soundness::whole);
  EXPECT_THAT(message_of<InputError>([&] { pack(campaign_, folder_ / "b.h5", false); }),
              AllOf(HasSubstr("000001.h5"), HasSubstr("is not possible")));
  EXPECT_FALSE(fs::exists(folder_ / "b.h5"));
}

TEST_F(Verify, ManifestsSayWhatShardsAre) {
  ASSERT_EQ(verify(campaign_).soundness, Soundness::whole);
  const fs::path manifest = fs::directory_iterator(campaign_ / "manifest")->path();
  const std::string before = testing::read_file(manifest);
  const auto told = [&](const std::string& from, const std::string& to) {
    std::string text = before;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << text;
    testing::write_file(manifest, text.replace(at, from.size(), to));
    const Verification found = verify(campaign_);
    EXPECT_EQ(found.soundness, Soundness::incomplete);
    EXPECT_EQ(found.traces, found.total);  // nothing is lost
    return file(found, "manifest").what;
  };
  EXPECT_THAT(told("\"bytes\":", "\"bytes\":1"),
              AllOf(HasSubstr("says 1"), HasSubstr("'graze resume' writes it anew")));
  EXPECT_THAT(told("\"count\":8", "\"count\":7"),
              AllOf(HasSubstr("says 7 traces of 'step/1cm' (particles 0 to 7)"),
                    HasSubstr("of shards/000001.h5, which has 8 traces of 'step/1cm' (particles 0 to 7)")));
  EXPECT_THAT(told("\"highest\":7", "\"highest\":8"), HasSubstr("says 8 traces of 'step/1cm' (particles 0 to 8)"));
  testing::write_file(manifest, before);
  EXPECT_EQ(verify(campaign_).soundness, Soundness::whole);
}

// Without its line a shard that is lost would look as if it had never been: 'resume' has the manifest tell again.
TEST_F(Verify, ManifestsTellOfAllShards) {
  const fs::path manifest = fs::directory_iterator(campaign_ / "manifest")->path();
  const std::string before = testing::read_file(manifest), first = before.substr(0, before.find('\n') + 1);
  testing::write_file(manifest, first + before.substr(first.size(), 20));  // the second is torn
  EXPECT_EQ(verify(campaign_).soundness, Soundness::incomplete);
  EXPECT_EQ(file("manifest").state, FileState::damaged);
  EXPECT_THAT(file("manifest").what, AllOf(HasSubstr("1 of 2 shards"), HasSubstr("'graze resume' writes it anew")));
  fs::remove_all(campaign_ / "manifest");
  EXPECT_EQ(verify(campaign_).soundness, Soundness::incomplete);
  EXPECT_EQ(verify(campaign_).left(), 0u);
  EXPECT_EQ(file("manifest").state, FileState::missing);
  EXPECT_THAT(file("manifest").what, HasSubstr("2 of 2 shards"));
}

/// Puts a dataset of so many zeros in the place of another, in chunks of so many bytes that are written once and
/// copied: a small file that claims much.
void inflate(hid_t file, const std::string& path, hsize_t rows, hsize_t row_bytes, hsize_t chunk_bytes) {
  const hdf5::Handle old(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose, path);
  const hdf5::Handle type(H5Dget_type(old.id()), H5Tclose, path);
  const bool matrix = path.ends_with("position");
  const hsize_t extent[2] = {rows, 3}, chunk[2] = {chunk_bytes / row_bytes, 3};
  const hdf5::Handle space(H5Screate_simple(matrix ? 2 : 1, extent, nullptr), H5Sclose, path);
  const hdf5::Handle list(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, path);
  H5Pset_chunk(list.id(), matrix ? 2 : 1, chunk);
  H5Pset_deflate(list.id(), 9);
  drop(file, path.c_str());
  const hdf5::Handle dataset(H5Dcreate2(file, path.c_str(), type.id(), space.id(), H5P_DEFAULT, list.id(), H5P_DEFAULT),
                             H5Dclose, path);
  const std::vector<std::byte> zeros(rows * row_bytes);
  H5Dwrite(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, zeros.data());
}

/// Processor time of the children that have ended, s.
double seconds_of_children() {
  rusage used{};
  getrusage(RUSAGE_CHILDREN, &used);
  return static_cast<double>(used.ru_utime.tv_sec) + 1e-6 * static_cast<double>(used.ru_utime.tv_usec);
}

// Each chunk is inflated once, however many pieces of it are read: a million events in chunks of a MiB, of which a
// piece is a small part, take no longer than in chunks that are no larger than pieces.
TEST_F(Verify, ChunksAreInflatedOnce) {
  constexpr hsize_t kRows = 1'100'000;  // more than bytes in a chunk
  pack(campaign_, folder_ / "a.h5", false);
  const auto seconds = [&](hsize_t chunk_bytes) {
    const fs::path large = forged(folder_, folder_ / "a.h5", [&](hid_t f) {
      const auto zeros = [&](const char* name, hsize_t row_bytes) {
        inflate(f, std::string("events/hold/") + name, kRows, row_bytes, chunk_bytes);
      };
      for (const char* name : {"kind", "feature_a", "feature_b"}) zeros(name, 1);
      for (const char* name : {"a", "b"}) zeros(name, 4);
      for (const char* name : {"time", "impulse"}) zeros(name, 8);
      zeros("position", 24);
      const hdf5::Handle offset(H5Dopen2(f, "events/hold/offset", H5P_DEFAULT), H5Dclose, "offset");
      const hdf5::Handle space(H5Dget_space(offset.id()), H5Sclose, "offset");
      std::vector<std::uint64_t> data(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.id())), kRows);
      data[0] = 0;
      H5Dwrite(offset.id(), H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, data.data());
    });
    const double before = seconds_of_children();
    const VerifiedFile found = verify(large).files.at(0);
    EXPECT_EQ(found.state, FileState::whole) << found.what;
    return seconds_of_children() - before;
  };
  const double small = seconds(hsize_t{1} << 14), large = seconds(hsize_t{1} << 20);
  RecordProperty("small", std::to_string(small));
  RecordProperty("large", std::to_string(large));
  EXPECT_LT(large, 1.5 * small);
}

TEST_F(Verify, AParticleGoesOneWay) {
  CampaignInfo facts = info();
  facts.particles = 16;
  facts.scenario_text = "graze: 1";
  {
    CampaignWriter writer(folder_ / "b.graze", facts, false);
    Block one = block(facts, 0, range(0, 8));
    one.traces[3].digest ^= 1;
    writer.append(0, std::move(one.traces), std::move(one.values));
    writer.finish(false);
  }
  fs::copy(folder_ / "b.graze" / "shards" / "000001.h5", campaign_ / "shards" / "000009.h5");
  const Verification found = verify(campaign_);
  EXPECT_EQ(found.soundness, Soundness::damaged);
  ASSERT_EQ(found.faults.size(), 1u);
  EXPECT_THAT(found.faults[0], HasSubstr("particle 3 of policy 'step/1cm' went another way"));
}

}  // namespace
}  // namespace graze
