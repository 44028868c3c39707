// What is not a whole, sound archive is refused with one message that names the file, and never crashes the reader.
#include <gmock/gmock.h>

#include "archive/directory/campaign_directory.h"
#include "archive/schema/schema.h"
#include "tests/archive/forge.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

// Claim: each way of not being an archive has its message, naming the path.
TEST(Refusal, WhatIsNoArchive) {
  const Folder folder;
  EXPECT_THAT(refusal(folder / "nothing"), AllOf(HasSubstr("nothing"), HasSubstr("is not there")));
  EXPECT_THAT(refusal(folder.path()), EndsWith("is no campaign directory: it has no campaign.h5"));
  fs::create_directories(folder / "all.sweep/000.graze");
  put(folder / "all.sweep/000.graze/campaign.h5", "");
  EXPECT_THAT(refusal(folder / "all.sweep"), EndsWith("all.sweep/000.graze'?"));
  put(folder / "text.h5", "name: not an archive\n");
  EXPECT_THAT(refusal(folder / "text.h5"), AllOf(HasSubstr("text.h5"), HasSubstr("is not an HDF5 file")));
  put(folder / "empty.h5", "");
  EXPECT_THAT(refusal(folder / "empty.h5"), HasSubstr("is not an HDF5 file"));
  {
    const hdf5::Lock lock;
    hdf5::create_file(folder / "foreign.h5", hdf5::file_access());
  }
  EXPECT_THAT(refusal(folder / "foreign.h5"), HasSubstr("is no Graze archive"));
  publish_hdf5(folder / "sealed.h5", true, [](const hdf5::Handle&) {});
  EXPECT_THAT(refusal(folder / "sealed.h5"), HasSubstr("is not a Graze archive"));
}

// Claim: parts of a campaign are told from the whole.
TEST(Refusal, PartsOfACampaign) {
  const Folder folder;
  const fs::path file = packed(folder);
  const fs::path campaign = folder / "good.graze";
  EXPECT_THAT(refusal(campaign / "campaign.h5"), HasSubstr("give the directory"));
  EXPECT_THAT(refusal(campaign / "shards" / "000001.h5"), HasSubstr("one shard of a campaign"));
  EXPECT_THAT(message_of<InputError>([&] { pack(file, folder / "again.h5", false); }), HasSubstr("one file already"));
  CampaignInfo other = info();
  other.seed = 1;
  write(folder / "other.graze", other);
  fs::copy(folder / "other.graze" / "shards" / "000001.h5", campaign / "shards" / "000002.h5");
  EXPECT_THAT(refusal(campaign), AllOf(HasSubstr("000002.h5"), HasSubstr("belongs to another campaign")));
}

// Claim: a file that is cut short anywhere is refused.
TEST(Refusal, CutShort) {
  const Folder folder;
  const std::string whole = content(packed(folder));
  for (std::size_t length = 0; length < whole.size(); length += 1 + length / 16) {
    put(folder / "cut.h5", whole.substr(0, length));
    EXPECT_THAT(refusal(folder / "cut.h5"), HasSubstr("cut.h5")) << length;
  }
}

// Claim: any flipped bit is noticed.
TEST(Refusal, FlippedBits) {
  const Folder folder;
  const std::string whole = content(packed(folder));
  for (std::size_t i = 0; i < 2000; ++i) {
    std::string flipped = whole;
    const std::size_t at = (i * 7919) % whole.size();
    flipped[at] = static_cast<char>(flipped[at] ^ (1 << (i % 8)));
    put(folder / "flipped.h5", flipped);
    EXPECT_FALSE(refusal(folder / "flipped.h5").empty()) << at;
  }
}

// Claim: a damaged shard is named, and so is a truncated description, if its copy is no better.
TEST(Refusal, DamagedDirectory) {
  const Folder folder;
  packed(folder);
  const fs::path shard = folder / "good.graze" / "shards" / "000001.h5";
  const std::string whole = content(shard);
  put(shard, whole.substr(0, whole.size() - 1));
  EXPECT_THAT(refusal(folder / "good.graze"), AllOf(HasSubstr("000001.h5"), HasSubstr("cut short")));
  put(shard, whole);
  for (const char* name : {kDescriptionFile, kDescriptionCopy}) {
    const fs::path description = folder / "good.graze" / name;
    put(description, content(description).substr(0, 100));
  }
  EXPECT_THAT(refusal(folder / "good.graze"), AllOf(HasSubstr("campaign.h5"), HasSubstr("cut short")));
}

// Claim: an unfinished shard (a temporary name) is no part of the campaign.
TEST(Refusal, TemporaryFilesAreIgnored) {
  const Folder folder;
  packed(folder);
  put(folder / "good.graze" / "shards" / "000002.h5.tmp", "half");
  read_all(folder / "good.graze");
}

// Claim: a newer format is refused naming both versions.
TEST(Refusal, NewerFormat) {
  const Folder folder;
  const fs::path file = forged(folder, packed(folder), [](hid_t root) {
    hdf5::check(H5Adelete(root, "format_version"), "format_version");
    hdf5::write_attribute(root, "format_version", std::uint64_t{kArchiveFormatVersion + 6});
  });
  EXPECT_THAT(refusal(file), AllOf(HasSubstr("format version 7"), HasSubstr("version 1")));
}

// Claim: the forging of this test itself gives a readable file when nothing is changed.
TEST(Refusal, ForgedButUnchangedIsRead) {
  const Folder folder;
  read_all(forged(folder, packed(folder), [](hid_t) {}));
}

// Claim: with an intact seal, too, everything is checked before it is used: presence, type, rank, length, order of
// offsets, range of indices.
TEST(Refusal, ForgedStructure) {
  const Folder folder;
  const fs::path source = packed(folder);
  using namespace schema;
  const Widths widths = widths_of(info());
  const std::string traces = traces_group("hold"), events = events_group("hold");
  struct Case {
    const char* name;
    std::function<void(hid_t)> change;
    const char* message;
  };
  const std::vector<Case> cases = {
      {"no margins", [&](hid_t f) { drop(f, "traces/hold/margins"); }, "margins"},
      {"no names", [&](hid_t f) { drop(f, "policies"); }, "policies/name"},
      {"no attribute", [&](hid_t f) { hdf5::check(H5Adelete(f, "seed"), "seed"); }, "seed"},
      {"attribute of another type",
       [&](hid_t f) {
         hdf5::check(H5Adelete(f, "seed"), "seed");
         hdf5::write_attribute(f, "seed", std::string("1"));
       },
       "seed"},
      {"too few outcomes",
       [&](hid_t f) {
         replace<std::uint8_t>(f, traces, outcome(), {0, 1});
       },
       "outcome"},
      {"wrong type",
       [&](hid_t f) {
         replace<double>(f, traces, {"digest", hdf5::Type::f64}, std::vector<double>(16));
       },
       "digest"},
      {"wrong rank",
       [&](hid_t f) {
         replace<double>(f, traces, {"end_time", hdf5::Type::f64, true, 1}, std::vector<double>(16));
       },
       "end_time"},
      {"wrong width",
       [&](hid_t f) {
         replace<double>(f, traces, {"margins", hdf5::Type::f64, true, 3}, std::vector<double>(48));
       },
       "margins"},
      {"impossible outcome",
       [&](hid_t f) { replace<std::uint8_t>(f, traces, outcome(), std::vector<std::uint8_t>(16, 9)); }, "outcome 9"},
      {"requirement out of range",
       [&](hid_t f) { replace<std::int32_t>(f, traces, violated(), std::vector<std::int32_t>(16, 2)); }, "2"},
      {"sequence out of range",
       [&](hid_t f) { replace<std::uint32_t>(f, traces, sequence(), std::vector<std::uint32_t>(16, 4000000000)); },
       "out of range"},
      {"offsets fall",
       [&](hid_t f) {
         auto offset = hdf5::read_column<std::uint64_t>(f, events, schema::offset(), 1 << 20);
         std::swap(offset[3], offset[9]);
         replace(f, events, schema::offset(), offset);
       },
       "does not divide"},
      {"offsets end beyond",
       [&](hid_t f) {
         auto offset = hdf5::read_column<std::uint64_t>(f, events, schema::offset(), 1 << 20);
         ++offset.back();
         replace(f, events, schema::offset(), offset);
       },
       "does not divide"},
      {"collider out of range",
       [&](hid_t f) {
         const auto a = hdf5::read_column<std::int32_t>(f, events, collider("a"), 1 << 20);
         replace(f, events, collider("a"), std::vector<std::int32_t>(a.size(), 77));
       },
       "out of range"},
      {"impossible kind",
       [&](hid_t f) {
         const auto kinds = hdf5::read_column<std::uint8_t>(f, events, kind(), 1 << 20);
         replace(f, events, kind(), std::vector<std::uint8_t>(kinds.size(), 200));
       },
       "out of range"},
      {"labels not divided",
       [&](hid_t f) {
         replace<std::uint64_t>(f, "parameters", {"label_offset", hdf5::Type::u64}, {0, 5, 2, 2});
       },
       "label_offset"},
      {"a group where data should be",
       [&](hid_t f) {
         drop(f, "traces/hold/digest");
         hdf5::make_group(f, "traces/hold/digest");
       },
       "digest"},
      {"more rows than the file can hold",
       [&](hid_t f) {
         drop(f, "particles/values");
         const hdf5::Spec huge = values(widths);
         hdf5::Column::create(f, "particles", huge, std::uint64_t{1} << 50, 0);
       },
       "more rows than"},
  };
  for (const Case& one : cases) {
    SCOPED_TRACE(one.name);
    EXPECT_THAT(refusal(forged(folder, source, one.change)), AllOf(HasSubstr("forged.h5"), HasSubstr(one.message)));
  }
}

}  // namespace
}  // namespace graze
