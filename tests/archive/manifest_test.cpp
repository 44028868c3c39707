// The manifest: one line per shard, never ahead of the shards, and nothing is lost when it is torn or gone.
#include "archive/directory/manifest.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/finished.h"
#include "archive/files/seal.h"
#include "tests/archive/synthetic.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Three shards of 8 particles of the first policy, each by a writer of its own.
CampaignInfo write_three_shards(const std::filesystem::path& path) {
  const CampaignInfo info = synthetic::info();
  for (std::uint32_t first = 0; first < 24; first += 8) {
    std::optional<CampaignWriter> writer;
    first == 0 ? writer.emplace(path, info, false) : writer.emplace(path, info, ExistingCampaign{});
    synthetic::Block block = synthetic::block(info, 0, synthetic::range(first, first + 8));
    writer->append(0, std::move(block.traces), std::move(block.values));
    writer->finish(false);
  }
  return info;
}

std::string refusal(const std::filesystem::path& path) {
  try {
    const Archive archive(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

// Claim: the manifest says of each shard its name, size, checksum, and which traces it holds.
TEST(Manifest, SaysWhatEachShardHolds) {
  const synthetic::Folder folder;
  write_three_shards(folder / "a.graze");
  const Manifest manifest = read_manifest(folder / "a.graze");
  ASSERT_EQ(manifest.size(), 3u);
  for (const auto& [name, entry] : manifest) {
    const Seal seal = check_seal(open_archive_file(folder / "a.graze" / "shards" / name).number(), name);
    EXPECT_EQ(seal, (Seal{entry.bytes, entry.digest}));
  }
  const ShardEntry& second = manifest.at("000002.h5");
  ASSERT_EQ(second.traces.size(), 1u);
  EXPECT_EQ(second.traces[0].policy, "step/1cm");
  EXPECT_EQ(second.traces[0].count, 8u);
  EXPECT_EQ(second.traces[0].lowest, 8u);
  EXPECT_EQ(second.traces[0].highest, 15u);
}

// Claim: what is read from a line is what was written into it; a line cut anywhere is no entry.
TEST(Manifest, LinesGoThereAndBack) {
  const ShardEntry entry{"r00003-000001.h5", 123456789012, 0xFEDCBA9876543210, {{"step/1 cm \"µ\"", 7, 3, 4000000000}}};
  const std::string line = manifest_line(entry);
  const auto back = parse_manifest_line(line);
  ASSERT_TRUE(back);
  EXPECT_EQ(manifest_line(*back), line);
  for (std::size_t size = 0; size < line.size(); ++size) EXPECT_FALSE(parse_manifest_line(line.substr(0, size)));
  EXPECT_FALSE(parse_manifest_line(manifest_line({"../../etc.h5", 1, 1, {}})));
}

// Claim: a shard that is gone is told with what it held, by every reader; the repair drops it and says so.
TEST(Manifest, ALostShardIsMissed) {
  const synthetic::Folder folder;
  const CampaignInfo info = write_three_shards(folder / "a b.graze");
  std::filesystem::remove(folder / "a b.graze" / "shards" / "000002.h5");
  EXPECT_THAT(refusal(folder / "a b.graze"),
              AllOf(HasSubstr("shards/000002.h5 is gone"), HasSubstr("8 traces of 'step/1cm' (particles 8 to 15)"),
                    HasSubstr("graze resume '" + (folder / "a b.graze").string() + "'")));
  const FinishedTraces finished = repair_and_list(folder / "a b.graze", info);
  EXPECT_EQ(finished.count, 16u);
  ASSERT_EQ(finished.notes.size(), 1u);
  EXPECT_THAT(finished.notes[0], HasSubstr("shards/000002.h5 is gone"));
  EXPECT_FALSE(finished.has("step/1cm", 8));
  EXPECT_EQ(refusal(folder / "a b.graze"), "");
  EXPECT_EQ(read_manifest(folder / "a b.graze").size(), 2u);
}

// Claim: a torn last line, a file of garbage or no manifest at all cost nothing; the repair makes it whole again.
TEST(Manifest, IsRebuiltFromTheShards) {
  const synthetic::Folder folder;
  const CampaignInfo info = write_three_shards(folder / "a.graze");
  const auto place = folder / "a.graze" / kManifestFolder;
  const Manifest whole = read_manifest(folder / "a.graze");
  const auto file = place / "shards.jsonl";
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 20);
  EXPECT_EQ(read_manifest(folder / "a.graze").size(), 2u);
  EXPECT_EQ(refusal(folder / "a.graze"), "");
  EXPECT_EQ(repair_and_list(folder / "a.graze", info).count, 24u);
  const auto same = [&] {
    const Manifest now = read_manifest(folder / "a.graze");
    ASSERT_EQ(now.size(), whole.size());
    for (const auto& [name, entry] : whole) EXPECT_EQ(manifest_line(now.at(name)), manifest_line(entry));
  };
  same();
  std::ofstream(place / "all.jsonl") << std::string("\0\xff{]\n", 5);
  EXPECT_EQ(repair_and_list(folder / "a.graze", info).notes.size(), 0u);
  same();
  std::filesystem::remove_all(place);
  EXPECT_EQ(refusal(folder / "a.graze"), "");
  EXPECT_EQ(repair_and_list(folder / "a.graze", info).count, 24u);
  same();
}

// Claim: after a torn line, the next one is whole; several writers write side by side.
TEST(Manifest, WritersAppendLines) {
  const synthetic::Folder folder;
  for (int round = 0; round < 2; ++round) {
    ManifestWriter one(folder.path(), "r00000"), two(folder.path(), "r00001");
    one.append({"r00000-" + std::to_string(round) + ".h5", 1, 2, {}});
    two.append({"r00001-" + std::to_string(round) + ".h5", 3, 4, {}});
    std::ofstream(folder / kManifestFolder / "r00000.jsonl", std::ios::app) << "{\"shard\": \"torn";
  }
  EXPECT_EQ(read_manifest(folder.path()).size(), 4u);
}

// Claim: when a campaign is complete, its manifest is one file; --force takes it for a part of a campaign.
TEST(Manifest, IsOneFileInTheEnd) {
  const synthetic::Folder folder;
  const CampaignInfo info = synthetic::info();
  synthetic::write(folder / "a.graze", info);
  const auto place = folder / "a.graze" / kManifestFolder;
  EXPECT_TRUE(std::filesystem::exists(place / "all.jsonl"));
  EXPECT_FALSE(std::filesystem::exists(place / "shards.jsonl"));
  EXPECT_EQ(read_manifest(folder / "a.graze").size(), 1u);
  EXPECT_NO_THROW(CampaignWriter(folder / "a.graze", info, true).finish(true));
  std::ofstream(place / "mine.txt") << "somebody's";
  EXPECT_THROW(CampaignWriter(folder / "a.graze", info, true), InputError);
}

}  // namespace
}  // namespace graze
