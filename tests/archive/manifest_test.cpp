// The manifest: one line per shard, never ahead of the shards, and nothing is lost when it is torn or gone.
#include "archive/directory/manifest.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/finished.h"
#include "archive/files/seal.h"
#include "archive/verify.h"
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

std::string manifest_refusal(const std::filesystem::path& path) {
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
  EXPECT_THAT(manifest_refusal(folder / "a b.graze"),
              AllOf(HasSubstr("shards/000002.h5 is gone"), HasSubstr("8 traces of 'step/1cm' (particles 8 to 15)"),
                    HasSubstr("graze resume '" + (folder / "a b.graze").string() + "'")));
  const FinishedTraces finished = repair_and_list(folder / "a b.graze", info);
  EXPECT_EQ(finished.count, 16u);
  ASSERT_EQ(finished.notes.size(), 1u);
  EXPECT_THAT(finished.notes[0], HasSubstr("shards/000002.h5 is gone"));
  EXPECT_FALSE(finished.has("step/1cm", 8));
  EXPECT_EQ(manifest_refusal(folder / "a b.graze"), "");
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
  EXPECT_EQ(manifest_refusal(folder / "a.graze"), "");
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
  EXPECT_EQ(manifest_refusal(folder / "a.graze"), "");
  EXPECT_EQ(repair_and_list(folder / "a.graze", info).count, 24u);
  same();
}

/// A line with these traces of 'hold'.
std::string line_with(const std::string& traces, const std::string& shard = "000009.h5") {
  return R"({"shard":")" + shard + R"(","bytes":1,"xxh64":"0000000000000001","traces":{"hold":{)" + traces + "}}}";
}

// Claim: a line that no campaign writes is no entry, and is told with its value and the rule; a torn one is not told.
TEST(Manifest, ImpossibleLinesAreNoEntries) {
  const std::string good = R"("count":2,"lowest":7,"highest":9)";
  ASSERT_TRUE(parse_manifest_line(line_with(good)));
  const auto fault = [](const std::string& line) {
    std::string why;
    EXPECT_FALSE(parse_manifest_line(line, &why)) << line;
    return why;
  };
  EXPECT_EQ(fault(line_with(R"("count":18446744073709551615,"lowest":7,"highest":9)")),
            "count: 18446744073709551615: must be a whole number from 1 to 3");
  EXPECT_EQ(fault(line_with(R"("count":1,"lowest":9,"highest":7)")),
            "highest: 7: must be a whole number from 9 to 4294967295");
  for (const char* count : {"0", "4", "-1", "2.0", "1e3", "null", R"("2")", "99999999999999999999999"}) {
    EXPECT_THAT(fault(line_with(std::string(R"("count":)") + count + R"(,"lowest":7,"highest":9)")),
                HasSubstr("must be a whole number from 1 to 3"));
  }
  EXPECT_THAT(fault(line_with(R"("count":1,"lowest":7,"highest":4294967296)")), HasSubstr("highest: 4294967296: must"));
  EXPECT_EQ(fault(line_with(R"("lowest":7,"highest":9)")), "count: is not there");
  EXPECT_THAT(fault(line_with(good, R"(\u001b[31m.h5)")), HasSubstr(R"(shard: '\u001b[31m.h5': must be a name)"));
  EXPECT_THAT(fault(line_with(good, "../000001.h5")), HasSubstr("must be the name of a shard"));
  EXPECT_THAT(fault(R"({"shard":"1.h5","bytes":1,"xxh64":"-1","traces":{}})"), HasSubstr("16 hexadecimal digits"));
  EXPECT_EQ(fault("[7]"), "shard: is not there");
  EXPECT_EQ(fault(line_with(good).substr(0, 40)), "");
  std::string escaped = line_with(good);
  escaped.replace(escaped.find("hold"), 4, R"(\u001b[2J)");
  EXPECT_THAT(fault(escaped), HasSubstr(R"(traces: '\u001b[2J': must be a name without control characters)"));
}

// Claim: such lines cost nothing but a warning, which names file and line; the repair writes the manifest anew.
TEST(Manifest, ImpossibleLinesAreToldAndPassedOver) {
  const synthetic::Folder folder;
  const CampaignInfo info = write_three_shards(folder / "a.graze");
  const auto file = folder / "a.graze" / kManifestFolder / "shards.jsonl";
  for (int i = 0; i < 2; ++i)
    std::ofstream(file, std::ios::app) << line_with(R"("count":9,"lowest":9,"highest":7)") << "\n";
  EXPECT_THAT(Archive(folder / "a.graze").warnings(),
              ::testing::ElementsAre(AllOf(HasSubstr("a.graze/manifest/shards.jsonl:4: highest: 7: must be"),
                                           HasSubstr("2 such lines count as lost, and 'graze resume "),
                                           HasSubstr("writes the manifest anew"))));
  const Verification found = verify(folder / "a.graze");
  EXPECT_EQ(found.soundness, Soundness::incomplete);
  EXPECT_EQ(found.lost, 0u);
  EXPECT_THAT(repair_and_list(folder / "a.graze", info).notes,
              ::testing::ElementsAre(AllOf(HasSubstr("shards.jsonl:4:"), HasSubstr("is written anew"))));
  EXPECT_TRUE(Archive(folder / "a.graze").warnings().empty());
}

// Claim: what has the name of a manifest and is no file costs no more than a manifest that is not there; the repair
// puts it aside, and so does a writer that comes to its end.
TEST(Manifest, WhatIsNoFileCountsAsMissing) {
  const synthetic::Folder folder;
  const CampaignInfo info = write_three_shards(folder / "a.graze");
  const auto place = folder / "a.graze" / kManifestFolder;
  const auto damaged = folder / "a.graze/damaged";
  const auto put = [&](const std::string& kind) {
    std::filesystem::remove_all(place);
    std::filesystem::create_directory(place);
    if (kind == "a named pipe") mkfifo((place / "all.jsonl").c_str(), 0600);
    if (kind == "a directory") std::filesystem::create_directory(place / "all.jsonl");
    if (kind == "a symbolic link") std::filesystem::create_symlink("/dev/zero", place / "all.jsonl");
  };
  for (const std::string kind : {"a named pipe", "a directory", "a symbolic link"}) {
    SCOPED_TRACE(kind);
    put(kind);
    EXPECT_THAT(Archive(folder / "a.graze").warnings(),
                ::testing::ElementsAre(AllOf(HasSubstr("manifest/all.jsonl: is " + kind + "; it counts as missing"),
                                             HasSubstr("puts it into damaged/"))));
    const FinishedTraces finished = repair_and_list(folder / "a.graze", info);
    EXPECT_EQ(finished.count, 24u);
    EXPECT_THAT(finished.notes,
                ::testing::ElementsAre(AllOf(HasSubstr("all.jsonl: is " + kind), HasSubstr("lies in damaged/"))));
    EXPECT_EQ(read_manifest(folder / "a.graze").size(), 3u);
    EXPECT_TRUE(std::filesystem::exists(std::filesystem::symlink_status(damaged / "all.jsonl")));
    std::filesystem::remove_all(damaged);
    put(kind);
    CampaignWriter(folder / "a.graze", info, ExistingCampaign{}).finish(true);
    EXPECT_TRUE(std::filesystem::is_regular_file(place / "all.jsonl"));
    EXPECT_TRUE(std::filesystem::exists(std::filesystem::symlink_status(damaged / "all.jsonl")));
    std::filesystem::remove_all(damaged);
  }
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
