// Parts of one campaign (graze run --part): packed as if they were one, told from parts of another, never lost.
#include <gmock/gmock.h>

#include "archive/directory/campaign_files.h"
#include "archive/verify.h"
#include "tests/archive/compare.h"
#include "tests/archive/tables.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

CampaignInfo to_divide() {
  CampaignInfo facts = info();
  facts.scenario_text = "graze: 1";
  facts.results_version = "7";
  facts.particles = 16;
  return facts;
}

/// Particles begin … end - 1 of all policies.
fs::path write_part(const Folder& folder, const char* name, std::uint32_t begin, std::uint32_t end,
                    CampaignInfo facts = to_divide()) {
  facts.part = {begin, end};
  CampaignWriter writer(folder / name, facts, false);
  for (int policy = 0; policy < static_cast<int>(facts.policies.size()); ++policy) {
    Block one = block(facts, policy, range(begin, end));
    writer.append(policy, std::move(one.traces), std::move(one.values));
  }
  writer.finish();
  return folder / name;
}

// Claim: two parts pack to the bytes of the whole; one alone gives a file of the whole that is not complete.
TEST(PartsOfOne, PackToTheWhole) {
  const Folder folder;
  const fs::path a = write_part(folder, "a.graze", 0, 6), b = write_part(folder, "b.graze", 6, 16);
  write(folder / "all.graze", to_divide());
  pack(folder / "all.graze", folder / "all.h5", false);
  pack(std::vector<fs::path>{b, a}, folder / "both.h5", false);
  EXPECT_TRUE(content(folder / "both.h5") == content(folder / "all.h5"));
  for (const bool alone : {true, false}) {
    const fs::path file = folder / (alone ? "alone.h5" : "list.h5");
    alone ? pack(a, file, false) : pack(std::vector<fs::path>{a}, file, false);
    const Archive archive(file);
    EXPECT_FALSE(archive.complete());
    EXPECT_EQ(archive.info().part.end, 0u);
    EXPECT_EQ(archive.info().particles, 16u);
    EXPECT_EQ(table_of(archive, "hold").size(), 6u);
    const Verification found = verify(file);
    EXPECT_EQ(found.soundness, Soundness::incomplete);
    EXPECT_EQ(found.left(), 30u);
  }
  const Verification found = verify(a);
  EXPECT_EQ(found.soundness, Soundness::whole) << "it is all there is of the part";
  EXPECT_EQ(found.total, 18u);
}

// Claim: directories that are not of one campaign are refused, with both names and what differs.
TEST(PartsOfOne, AreToldFromOthers) {
  const Folder folder;
  const fs::path a = write_part(folder, "a.graze", 0, 6);
  const std::vector<std::pair<std::string, std::function<void(CampaignInfo&)>>> cases = {
      {"scenarios", [](CampaignInfo& facts) { facts.scenario_sha256 = std::string(64, 'b'); }},
      {"seeds (18446744073709551600 and 1)", [](CampaignInfo& facts) { facts.seed = 1; }},
      {"numbers of particles (16 and 17)", [](CampaignInfo& facts) { facts.particles = 17; }},
      {"policies",
       [](CampaignInfo& facts) {
         facts.policies = {"step/1cm", "hold", "step/4cm"};
       }},
      {"results versions (7 and 8)", [](CampaignInfo& facts) { facts.results_version = "8"; }}};
  for (const auto& [differ, change] : cases) {
    CampaignInfo facts = to_divide();
    change(facts);
    EXPECT_EQ(campaign_difference(to_divide(), facts), differ);
    const fs::path b = write_part(folder, "b.graze", 6, 16, facts);
    EXPECT_EQ(message_of<InputError>([&] {
                pack(std::vector<fs::path>{a, b}, folder / "o.h5", false);
              }),
              a.string() + " and " + b.string() + ": are not parts of one campaign: their " + differ + " differ");
    fs::remove_all(b);
  }
  EXPECT_EQ(campaign_difference(to_divide(), to_divide()), "");
  pack(a, folder / "a.h5", false);
  EXPECT_THAT(message_of<InputError>([&] {
                pack(std::vector<fs::path>{a, folder / "a.h5"}, folder / "o.h5", false);
              }),
              HasSubstr("a.h5: is one file already; give campaign directories"));
}

// Claim: a part finds its own place taken by itself or by another part, and says what to do.
TEST(PartsOfOne, FindTheirPlacesTaken) {
  const Folder folder;
  const fs::path a = write_part(folder, "a.graze", 4, 12);
  const auto begin = [&](std::uint64_t from, std::uint64_t to, CampaignInfo facts = to_divide()) {
    facts.part = {from, to};
    return message_of<InputError>([&] { CampaignWriter(a, facts, false); });
  };
  EXPECT_THAT(begin(4, 12), AllOf(HasSubstr("a.graze: holds this part already"), HasSubstr("'graze resume ")));
  EXPECT_THAT(begin(4, 13), HasSubstr("holds another part of the same campaign, particles 4 to 11; choose another "
                                      "--output for particles 4 to 12"));
  EXPECT_THAT(begin(0, 12), HasSubstr("particles 4 to 11; choose another --output for particles 0 to 11"));
  CampaignInfo other = to_divide();
  other.seed = 1;
  EXPECT_THAT(begin(4, 12, other), HasSubstr("exists and is not empty"));
  EXPECT_THAT(begin(0, 0), HasSubstr("exists and is not empty"));
}

// Claim: of many shards that are gone the first three are told, and how many more.
TEST(PartsOfOne, TellTheFirstShardsThatAreGone) {
  const Folder folder;
  {
    CampaignWriter writer(folder / "a.graze", to_divide(), false);
    for (std::uint32_t first = 0; first < 10; first += 2) {
      for (int policy = 0; policy < 2; ++policy) {
        Block one = block(to_divide(), policy, range(first, first + 2));
        writer.append(policy, std::move(one.traces), std::move(one.values));
      }
      writer.flush();
    }
  }
  for (int i = 1; i <= 5; ++i) fs::remove(folder / "a.graze/shards" / ("00000" + std::to_string(i) + ".h5"));
  EXPECT_THAT(
      message_of<InputError>([&] { Archive(folder / "a.graze"); }),
      AllOf(HasSubstr("shards/000001.h5 is gone; it held 2 traces of 'step/1cm' (particles 0 to 1), 2 traces of "
                      "'step/4cm' (particles 0 to 1); shards/000002.h5"),
            HasSubstr("shards/000003.h5"), HasSubstr("; 2 more are gone; 'graze resume ")));
}

}  // namespace
}  // namespace graze
