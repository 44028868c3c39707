// Claim: what the description of a campaign says is no proof of what there is. Traces of other parts, that were lost,
// that lack their values, or that two shards tell differently, and facts that no campaign has, are seen by whoever
// reads the archive; a shard that has another name now is not lost.
#include <gmock/gmock.h>

#include <limits>

#include "archive/directory/campaign_files.h"
#include "archive/directory/finished.h"
#include "archive/directory/unfinished.h"
#include "archive/files/lock.h"
#include "archive/outcomes.h"
#include "archive/schema/schema.h"
#include "archive/verify.h"
#include "tests/archive/forge.h"

namespace graze {
namespace {

using namespace synthetic;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
namespace fs = std::filesystem;

CampaignInfo of_one_policy() {
  CampaignInfo facts = info();
  facts.particles = 16;
  facts.scenario_text = "graze: 1";
  facts.policies = {"hold"};
  return facts;
}

/// A campaign of one policy in shards of 8 traces.
fs::path write_campaign(
    const fs::path& path, const CampaignInfo& facts, std::uint32_t begin, std::uint32_t end,
    const std::function<void(TraceRecord&)>& change = [](TraceRecord&) {}) {
  CampaignWriter writer(path, facts, false);
  for (std::uint32_t first = begin; first < end; first += 8) {
    Block one = block(facts, 0, range(first, first + 8));
    for (TraceRecord& trace : one.traces) change(trace);
    writer.append(0, std::move(one.traces), std::move(one.values));
    writer.flush();
  }
  writer.finish(true);
  return path;
}

fs::path write_part(const fs::path& path, std::uint32_t begin, std::uint32_t end) {
  CampaignInfo facts = of_one_policy();
  facts.part = {begin, end};
  return write_campaign(path, facts, begin, end);
}

FinishedTraces repaired(const fs::path& path) {
  const DirectoryLock lock{Directory(path)};
  return repair_and_list(lock.directory(), read_description(lock.directory()));
}

std::string shard_of(const Verification& found) {
  for (const VerifiedFile& file : found.files) {
    if (file.name == "shards/000001.h5") return file.what;
  }
  return "";
}

// The shard of another part in the place of its own: nothing of it counts, and all of this part is simulated again.
TEST(LostTraces, APartCountsItsOwnParticlesOnly) {
  const Folder folder;
  const fs::path first = write_part(folder / "1.graze", 0, 8), second = write_part(folder / "2.graze", 8, 16);
  fs::copy(second / "shards/000001.h5", first / "shards/000001.h5", fs::copy_options::overwrite_existing);
  EXPECT_EQ(count_traces(Archive(first), "hold"), 0u);
  EXPECT_EQ(count_traces(Archive(second), "hold"), 8u);
  const Verification found = verify(first);
  EXPECT_EQ(found.soundness, Soundness::incomplete);
  EXPECT_EQ(found.traces, 0u);
  EXPECT_THAT(shard_of(found), AllOf(HasSubstr("particle 8 is not of this part of the campaign, 0 to 7"),
                                     HasSubstr("'graze resume' puts it into damaged/")));
  const FinishedTraces left = repaired(first);
  EXPECT_EQ(left.count, 0u);
  EXPECT_TRUE(fs::exists(first / "damaged/000001.h5"));
}

// Without its line in the manifest nobody knows of a shard that is gone, but for the number of traces.
TEST(LostTraces, ACampaignThatLostThemIsNotPackedAsComplete) {
  const Folder folder;
  const fs::path campaign = write_campaign(folder / "a.graze", of_one_policy(), 0, 16);
  fs::remove(campaign / "shards/000002.h5");
  fs::remove_all(campaign / "manifest");
  EXPECT_FALSE(Archive(campaign).complete()) << "whatever its description says";
  pack(campaign, folder / "a.h5", false);
  EXPECT_FALSE(Archive(folder / "a.h5").complete());
  EXPECT_EQ(verify(folder / "a.h5").soundness, Soundness::incomplete);
}

TEST(LostTraces, ARenamedShardIsNotLost) {
  const Folder folder;
  const fs::path campaign = write_campaign(folder / "a.graze", of_one_policy(), 0, 16);
  fs::rename(campaign / "shards/000001.h5", campaign / "shards/000007.h5");
  const Verification found = verify(campaign);
  EXPECT_EQ(found.lost, 0u);
  EXPECT_EQ(found.left(), 0u);
  EXPECT_EQ(found.soundness, Soundness::incomplete);
  EXPECT_THAT(shard_of(found), HasSubstr("is shards/000007.h5 now; nothing is lost"));
  const Archive archive(campaign);
  EXPECT_EQ(count_traces(archive, "hold"), 16u);
  EXPECT_THAT(archive.warnings(), ElementsAre(HasSubstr("shards/000001.h5 is shards/000007.h5 now; nothing is lost")));
  const FinishedTraces left = repaired(campaign);
  EXPECT_EQ(left.count, 16u);
  EXPECT_THAT(left.notes, ElementsAre(HasSubstr("the manifest says so now")));
  EXPECT_EQ(verify(campaign).soundness, Soundness::whole);
}

TEST(LostTraces, EveryTraceHasItsValues) {
  const Folder folder;
  const fs::path campaign = write_campaign(folder / "a.graze", of_one_policy(), 0, 16);
  pack(campaign, folder / "a.h5", false);
  const auto damage = [&](const std::function<void(hid_t)>& change) {
    const Verification found = verify(forged(folder, folder / "a.h5", change));
    EXPECT_EQ(found.soundness, Soundness::damaged);
    return found.files.at(0).what;
  };
  EXPECT_THAT(damage([](hid_t f) { drop(f, "particles"); }),
              HasSubstr("'traces/hold': particle 0 has no values in 'particles', which the campaign stores"));
  EXPECT_THAT(damage([](hid_t f) {
                std::vector<std::uint32_t> ids = range(1, 17);
                replace(f, "particles", schema::particle(), ids);
              }),
              HasSubstr("particle 0 has no values"));
  EXPECT_THAT(damage([](hid_t f) {
                std::vector<std::uint32_t> ids = range(0, 16);
                ids[3] = 4;
                replace(f, "particles", schema::particle(), ids);
              }),
              HasSubstr("'particles' is not in order of particle id: 4 follows 4"));
}

// One digest, and two outcomes, requirements or margins.
TEST(LostTraces, TwoShardsTellTheSameOfATrace) {
  const std::vector<std::function<void(TraceRecord&)>> changes = {
      [](TraceRecord& trace) { trace.outcome = Outcome::unknown_failure, trace.objective_margin = -0.5; },
      [](TraceRecord& trace) {
        trace.outcome = Outcome::known_failure, trace.violated = 0;
        trace.first_violations[0] = trace.end_time;
      },
      [](TraceRecord& trace) { trace.margins[1] += 1; }};
  for (const auto& change : changes) {
    const Folder folder;
    const auto success = [](TraceRecord& trace) {
      trace.outcome = Outcome::success, trace.violated = -1, trace.objective_margin = 0.5;
      trace.first_violations.assign(trace.first_violations.size(), std::nan(""));
    };
    const fs::path one = write_campaign(folder / "a.graze", of_one_policy(), 0, 16, success);
    const fs::path other = write_campaign(folder / "b.graze", of_one_policy(), 0, 8, [&](TraceRecord& trace) {
      success(trace);
      if (trace.particle == 3) change(trace);
    });
    fs::copy(other / "shards/000001.h5", one / "shards/000009.h5");
    const Verification found = verify(one);
    EXPECT_EQ(found.soundness, Soundness::damaged);
    ASSERT_EQ(found.faults.size(), 1u);
    EXPECT_THAT(found.faults[0], HasSubstr("particle 3 of policy 'hold' went another way"));
    EXPECT_THAT(message_of<InputError>([&] { pack(one, folder / "a.h5", false); }), HasSubstr("went another way"));
  }
}

TEST(LostTraces, FactsAreThoseOfACampaign) {
  const Folder folder;
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  const std::vector<std::pair<std::string, std::function<void(CampaignInfo&)>>> cases = {
      {"'step' is nan s; it must be a time above 0", [&](CampaignInfo& facts) { facts.step = nan; }},
      {"'control' is 0 s; it must be a time above 0", [&](CampaignInfo& facts) { facts.control = 0; }},
      {"'end' is -1 s; it must be a time above 0", [&](CampaignInfo& facts) { facts.end = -1; }},
      {"'end' is inf s; it must be a time above 0", [&](CampaignInfo& facts) { facts.end = infinity; }},
      {"'particles' is 0; a campaign has 1 to 4294967296", [&](CampaignInfo& facts) { facts.particles = 0; }},
      {"'design' is 'sobel'; nearest: sobol", [&](CampaignInfo& facts) { facts.design = "sobel"; }},
      {"'physics' is ''; it must name the back end", [&](CampaignInfo& facts) { facts.physics = ""; }},
      {"'../free' cannot name a group", [&](CampaignInfo& facts) { facts.policies = {"../free"}; }},
      {"'hold' lies inside policy 'hold'", [&](CampaignInfo& facts) {
         facts.policies = {"hold", "hold"};
       }}};
  for (const auto& [what, change] : cases) {
    CampaignInfo facts = of_one_policy();
    change(facts);
    const fs::path file = folder / "facts.h5";
    publish_hdf5(file, true, [&](const hdf5::Handle& out) { write_info(out, facts, Layout::packed, true); });
    EXPECT_THAT(message_of<InputError>([&] { Archive archive(file); }),
                AllOf(HasSubstr("facts.h5: "), HasSubstr(what)));
    const Verification found = verify(file);
    EXPECT_EQ(found.soundness, Soundness::damaged);
    EXPECT_THAT(found.files.at(0).what, HasSubstr(what));
  }
}

// What a repair finds fault with readers tell, and read on.
TEST(LostTraces, DoubtfulPlacesAreTold) {
  const Folder folder;
  const fs::path campaign = write_campaign(folder / "a.graze", of_one_policy(), 0, 16);
  fs::create_directory(campaign / kUnfinishedFile);
  put(campaign / kLockFile, "");
  fs::create_hard_link(campaign / kLockFile, folder / "lock");
  EXPECT_THAT(Archive(campaign).warnings(),
              ElementsAre(HasSubstr("unfinished.jsonl: is a directory; 'graze resume "), HasSubstr("(a hard link)")));
  EXPECT_EQ(count_traces(Archive(campaign), "hold"), 16u);
}

}  // namespace
}  // namespace graze
