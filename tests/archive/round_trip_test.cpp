// What is read is what was written: facts, tables, events, telemetry and values, from a directory and from one file,
// however the traces were spread over shards.
#include <gmock/gmock.h>

#include <thread>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/shard.h"
#include "archive/hdf5/hdf5.h"
#include "tests/archive/compare.h"
#include "tests/archive/tables.h"
#include "tests/trace_bits.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::ElementsAre;

/// Writes the campaign in shards of our choosing: shard s holds the blocks b with b % shards == s, from the last to the
/// first.
void write_in_shards(const std::filesystem::path& path, const CampaignInfo& info, int shards) {
  CampaignDirectory directory(path, info, false);
  const int policies = static_cast<int>(info.policies.size());
  const int blocks = static_cast<int>((info.particles + 7) / 8) * policies;
  for (int s = 0; s < shards; ++s) {
    ShardBuffer buffer(info.policies.size());
    for (int b = blocks - 1; b >= 0; --b) {
      if (b % shards != s) continue;
      const auto first = static_cast<std::uint32_t>(8 * (b / policies));
      Block one = block(info, b % policies,
                        range(first, std::min<std::uint32_t>(first + 8, static_cast<std::uint32_t>(info.particles))));
      std::reverse(one.traces.begin(), one.traces.end());
      std::vector<double> drawn;
      for (const TraceRecord& record : one.traces) {
        const auto v = values(info, record.particle);
        drawn.insert(drawn.end(), v.begin(), v.end());
      }
      buffer.add(b % policies, std::move(one.traces), drawn, info.parameters.size());
    }
    directory.add_shard(std::move(buffer));
  }
  directory.complete();
}

// Claim: a campaign directory gives back every field of every record, bit for bit (NaN, empty strings, UTF-8 and a
// scenario larger than 64 kB included).
TEST(RoundTrip, Directory) {
  const Folder folder;
  write(folder / "a.graze", info());
  const Archive archive(folder / "a.graze");
  EXPECT_TRUE(archive.complete());
  expect_campaign(archive);
}

// Claim: the facts of the campaign come back, too.
TEST(RoundTrip, Facts) {
  const Folder folder;
  const CampaignInfo want = info();
  write(folder / "a.graze", want, false);
  const Archive archive(folder / "a.graze");
  const CampaignInfo& got = archive.info();
  EXPECT_FALSE(archive.complete());
  EXPECT_EQ(got.scenario_name, want.scenario_name);
  EXPECT_EQ(got.scenario_text, want.scenario_text);
  EXPECT_EQ(got.scenario_sha256, want.scenario_sha256);
  EXPECT_EQ(got.command_line, want.command_line);
  EXPECT_EQ(got.start_time, want.start_time);
  EXPECT_EQ(got.program_version, want.program_version);
  EXPECT_EQ(got.program_revision, want.program_revision);
  EXPECT_EQ(build_differences(want.build, got.build), std::vector<std::string>());
  EXPECT_EQ(got.physics, want.physics);
  EXPECT_EQ(got.design, want.design);
  EXPECT_EQ(got.objective, want.objective);
  EXPECT_EQ(got.seed, want.seed);
  EXPECT_EQ(got.particles, want.particles);
  EXPECT_EQ(got.step, want.step);
  EXPECT_EQ(got.control, want.control);
  EXPECT_EQ(got.end, want.end);
  EXPECT_EQ(got.policies, want.policies);
  EXPECT_EQ(got.colliders, want.colliders);
  EXPECT_EQ(got.bodies, want.bodies);
  EXPECT_EQ(got.q_names, want.q_names);
  EXPECT_EQ(got.v_names, want.v_names);
  EXPECT_EQ(got.actuator_names, want.actuator_names);
  ASSERT_EQ(got.parameters.size(), 3u);
  EXPECT_EQ(got.parameters[0].name, "robot.link.LF_SHIN.length");
  EXPECT_EQ(got.parameters[0].unit, "m");
  EXPECT_EQ(got.parameters[0].distribution, "normal(mean=0.1, std=0.0025)");
  EXPECT_EQ(got.parameters[0].nominal, 0.1);
  EXPECT_THAT(got.parameters[1].labels, ElementsAre("complementarity", "complementarity_free"));
  EXPECT_THAT(got.parameters[2].labels, ElementsAre());
  EXPECT_EQ(got.parameters[2].jitter, "normal(mean=0, std=0.0003)");
  ASSERT_EQ(got.requirements.size(), 2u);
  EXPECT_EQ(got.requirements[1].name, "clears-curb");
  EXPECT_EQ(got.requirements[0].description, "tilt of BODY0 below 90 deg");
  EXPECT_EQ(got.requirements[0].unit, "rad");
}

// Claim: a packed file holds the same, and packing is deterministic down to the last byte of the file: one shard in
// order and seven shards in another order give the same file.
TEST(RoundTrip, PackedFilesOfEqualTracesAreEqual) {
  const Folder folder;
  const CampaignInfo facts = info();
  write(folder / "a.graze", facts);
  write_in_shards(folder / "b.graze", facts, 7);
  ASSERT_EQ(shard_files(folder / "a.graze").size(), 1u);
  ASSERT_EQ(shard_files(folder / "b.graze").size(), 7u);
  expect_campaign(Archive(folder / "b.graze"));
  pack(folder / "a.graze", folder / "a.h5", false);
  pack(folder / "b.graze", folder / "b.h5", false);
  expect_campaign(Archive(folder / "a.h5"));
  EXPECT_TRUE(Archive(folder / "a.h5").complete());
  EXPECT_TRUE(content(folder / "a.h5") == content(folder / "b.h5"));
}

// Claim: many threads may append at once; what they write is what one thread writes.
TEST(RoundTrip, ThreadsWriteWhatOneThreadWrites) {
  const Folder folder;
  CampaignInfo facts = info();
  facts.particles = 160;
  write(folder / "one.graze", facts);
  {
    CampaignWriter writer(folder / "many.graze", facts, false);
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) {
      threads.emplace_back([&, t] {
        for (int b = t; b < 60; b += 4) {
          const auto first = static_cast<std::uint32_t>(8 * (b / 3));
          Block one = block(facts, b % 3, range(first, first + 8));
          writer.append(b % 3, std::move(one.traces), std::move(one.values));
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    writer.finish();
  }
  pack(folder / "one.graze", folder / "one.h5", false);
  pack(folder / "many.graze", folder / "many.h5", false);
  EXPECT_TRUE(content(folder / "one.h5") == content(folder / "many.h5"));
}

// Claim: a particle that stands in two shards counts once if both agree, and is an error naming it if they do not.
TEST(RoundTrip, DuplicatesMustAgree) {
  const Folder folder;
  const CampaignInfo facts = info();
  for (const bool agree : {true, false}) {
    const auto path = folder / (agree ? "same.graze" : "other.graze");
    CampaignDirectory directory(path, facts, false);
    for (int copy = 0; copy < 2; ++copy) {
      ShardBuffer buffer(facts.policies.size());
      Block one = block(facts, 0, range(0, 8));
      if (!agree && copy == 1) one.traces[5].digest ^= 1;
      buffer.add(0, std::move(one.traces), one.values, facts.parameters.size());
      directory.add_shard(std::move(buffer));
    }
    const Archive archive(path);
    if (agree) {
      expect_policy(archive, 0, 8);
    } else {
      EXPECT_THAT(message_of<InputError>([&] { table_of(archive, "step/1cm"); }), ::testing::HasSubstr("particle 5 "));
    }
  }
}

// Claim: a campaign without requirements, uncertain parameters, events or telemetry is a campaign.
TEST(RoundTrip, BareCampaign) {
  const Folder folder;
  CampaignInfo facts = info();
  facts.parameters.clear();
  facts.requirements.clear();
  facts.q_names.clear();
  TraceRecord record;
  record.particle = 3;
  record.outcome = Outcome::success;
  record.v = {1, 2};
  {
    CampaignWriter writer(folder / "a.graze", facts, false);
    writer.append(2, {record}, {});
    writer.finish();
  }
  pack(folder / "a.graze", folder / "a.h5", false);
  for (const char* name : {"a.graze", "a.h5"}) {
    const Archive archive(folder / name);
    EXPECT_EQ(table_of(archive, "step/1cm").size(), 0u);
    EXPECT_EQ(table_of(archive, "no such policy").size(), 0u);
    const TraceTable table = table_of(archive, "hold");
    ASSERT_EQ(table.size(), 1u);
    EXPECT_EQ(table.particle[0], 3u);
    EXPECT_EQ(table.outcome[0], Outcome::success);
    EXPECT_TRUE(events_of(archive, "hold")[0].empty());
    EXPECT_TRUE(archive.telemetry("hold", 3).empty());
    EXPECT_TRUE(archive.telemetry("hold", 4).empty());
    EXPECT_TRUE(archive.particle_values(3).empty());
  }
}

// Claim: an archive of a program that knew six kinds of events and logged no solver's residual is still read in full.
TEST(RoundTrip, ArchivesOfOlderProgramsAreRead) {
  const Archive archive(GRAZE_SOURCE_DIR "/tests/archive/six_event_kinds.h5");
  const std::string policy = archive.info().policies.at(0);
  ASSERT_EQ(table_of(archive, policy).size(), 3u);
  EXPECT_EQ(table_of(archive, policy).digest[2], 1002u);
  EXPECT_TRUE(table_of(archive, policy).solver.empty());
  EXPECT_EQ(events_of(archive, policy).at(2).size(), 2u);
  EXPECT_EQ(archive.telemetry(policy, 2).size(), 2u);
  EXPECT_FALSE(archive.particle_values(2).empty());
}

// Claim: an enumeration may have grown at its end since a file was written; labels that moved or changed are refused.
TEST(RoundTrip, EnumerationsGrowAtTheirEnd) {
  const Folder folder;
  const hdf5::Lock lock;
  const hdf5::Handle file = hdf5::create_file(folder / "kinds.h5", hdf5::file_access());
  const auto kinds = [](std::vector<std::string> labels) {
    return hdf5::Spec{"kind", hdf5::Type::enumeration, false, 1, {}, std::move(labels)};
  };
  hdf5::write_column<std::uint8_t>(file.id(), "events", kinds({"begin", "end"}), {1, 0, 1}, 0);
  constexpr std::uint64_t kBytes = 1 << 20;
  const auto read = [&](std::vector<std::string> labels) {
    return hdf5::read_column<std::uint8_t>(file.id(), "events", kinds(std::move(labels)), kBytes);
  };
  EXPECT_THAT(read({"begin", "end"}), ElementsAre(1, 0, 1));
  EXPECT_THAT(read({"begin", "end", "slip"}), ElementsAre(1, 0, 1));
  EXPECT_THROW(read({"begin"}), hdf5::Error);
  EXPECT_THROW(read({"end", "begin", "slip"}), hdf5::Error);
  EXPECT_THROW(read({"begin", "stop"}), hdf5::Error);
}

// Claim: without store_values the values are left out and all else stays.
TEST(RoundTrip, ValuesMayBeLeftOut) {
  const Folder folder;
  CampaignInfo facts = info();
  facts.store_values = false;
  write(folder / "a.graze", facts);
  const Archive archive(folder / "a.graze");
  EXPECT_TRUE(archive.particle_values(0).empty());
  write(folder / "b.graze", info());
  const Archive with(folder / "b.graze");
  EXPECT_FALSE(with.particle_values(0).empty());
  for (const std::string& policy : with.info().policies) {
    const TraceTable a = table_of(archive, policy), b = table_of(with, policy);
    EXPECT_EQ(a.particle, b.particle);
    EXPECT_EQ(a.outcome, b.outcome);
    EXPECT_EQ(a.violated, b.violated);
    EXPECT_EQ(a.end_time, b.end_time);
    EXPECT_EQ(a.digest, b.digest);
    EXPECT_EQ(a.sequence, b.sequence);
    EXPECT_EQ(a.invalid_reason, b.invalid_reason);
    EXPECT_EQ(events_of(archive, policy).size(), b.size());
    for (const std::uint32_t particle : b.particle) {
      std::string bits, wanted;
      graze::testing::add_frame_bits(archive.telemetry(policy, particle), bits);
      graze::testing::add_frame_bits(with.telemetry(policy, particle), wanted);
      EXPECT_EQ(bits, wanted) << policy << ", particle " << particle;
    }
  }
  EXPECT_EQ(table_of(archive, "hold").size(), 40u);
}

// Claim: text that is not UTF-8 (a command line may be anything) is stored as valid UTF-8.
TEST(RoundTrip, TextBecomesUtf8) {
  const Folder folder;
  CampaignInfo facts = info();
  facts.command_line = "graze run \xFF\xC3\xA4.yaml";
  write(folder / "a.graze", facts);
  EXPECT_EQ(Archive(folder / "a.graze").info().command_line, "graze run \xEF\xBF\xBD\xC3\xA4.yaml");
}

// Claim: a policy whose name cannot be a path of groups is refused before anything is written.
TEST(RoundTrip, PolicyNamesMustBePaths) {
  const Folder folder;
  for (const std::vector<std::string>& names : std::vector<std::vector<std::string>>{
           {"a//b"}, {""}, {"/a"}, {"a/"}, {"a/../b"}, {"."}, {"a", "a/b"}, {"a", "a"}}) {
    CampaignInfo facts = info();
    facts.policies = names;
    EXPECT_THROW(CampaignWriter(folder / "a.graze", facts, false), InputError) << names.front();
    EXPECT_FALSE(std::filesystem::exists(folder / "a.graze"));
  }
}

}  // namespace
}  // namespace graze
