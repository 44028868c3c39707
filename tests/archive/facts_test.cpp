// The facts of a campaign: all of them come back, older archives do without some, and forged ones are refused by name.
#include <gmock/gmock.h>

#include "archive/schema/schema.h"
#include "archive/verify.h"
#include "tests/archive/forge.h"
#include "tests/archive/replayed.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

/// Everything that a campaign may have.
CampaignInfo rich() {
  CampaignInfo facts = info();
  facts.particles = 16;
  facts.scenario_text = "graze: 1";
  facts.results_version = "7.1";
  facts.requirements.push_back({"smooth", "", "m/s", true, "links"});
  facts.requirements.push_back({"slow", "", "m", true, "", {0.5, 0.75}});
  facts.part = {4, 12};
  facts.unconverged = 0.25;
  facts.source.file = "../a.yaml";
  facts.source.folder = "/home/somebody";
  facts.source.options.ignore_missing_meshes = true;
  facts.source.options.overrides = {{"robot.mass", "2"}, {"seed", "3"}};
  facts.source.inputs = {{"a.yaml", std::string("graze: 1\0\xff", 10)}, {"b.urdf", ""}, {"c.urdf", "<robot/>"}};
  return facts;
}

/// In one shard; the part's particles of the first policy.
fs::path write_rich(const Folder& folder, const CampaignInfo& facts) {
  CampaignWriter writer(folder / "rich.graze", facts, false);
  Block one = block(facts, 0, range(4, 12));
  writer.append(0, std::move(one.traces), std::move(one.values));
  writer.finish();
  return folder / "rich.graze";
}

// Claim: measures with their windows, leaves, links, the part and the source's files come back as they were.
TEST(Facts, ComeBackInFull) {
  const Folder folder;
  const CampaignInfo want = rich();
  const Archive archive(write_rich(folder, want));
  const CampaignInfo& got = archive.info();
  EXPECT_EQ(got.results_version, "7.1");
  EXPECT_EQ(got.unconverged, 0.25);
  EXPECT_TRUE(got.store_values);
  EXPECT_EQ(got.links, want.links);
  ASSERT_EQ(got.parameters.size(), want.parameters.size());
  for (std::size_t i = 0; i < want.parameters.size(); ++i) EXPECT_EQ(got.parameters[i].unit, want.parameters[i].unit);
  const auto expect_rows = [](const auto& some, const auto& wanted) {
    ASSERT_EQ(some.size(), wanted.size());
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      EXPECT_EQ(some[i].name, wanted[i].name);
      EXPECT_EQ(some[i].description, wanted[i].description);
      EXPECT_EQ(some[i].unit, wanted[i].unit);
      EXPECT_EQ(some[i].parts, wanted[i].parts);
      EXPECT_EQ(some[i].measure, wanted[i].measure);
      EXPECT_EQ(some[i].window.from, wanted[i].window.from);
      EXPECT_EQ(some[i].window.to, wanted[i].window.to);
    }
  };
  expect_rows(got.requirements, want.requirements);
  expect_rows(got.leaves, want.leaves);
  EXPECT_EQ(got.deciding(), 2u);
  EXPECT_EQ(got.part.begin, 4u);
  EXPECT_EQ(got.part.end, 12u);
  EXPECT_EQ(got.source.file, want.source.file);
  EXPECT_EQ(got.source.folder, want.source.folder);
  EXPECT_TRUE(got.source.options.ignore_missing_meshes);
  ASSERT_EQ(got.source.options.overrides.size(), 2u);
  EXPECT_EQ(got.source.options.overrides[1].path, "seed");
  EXPECT_EQ(got.source.options.overrides[1].value, "3");
  EXPECT_EQ(got.source.inputs, want.source.inputs);
}

TEST(Facts, QuestionsComeBackInFull) {
  const Folder folder;
  CampaignInfo facts = rich();
  facts.part = {};
  facts.store_values = false;
  facts.source.options.ignore_missing_meshes = false;
  facts.until = {{"p >= 0.3", "hold: ci < 0.5"}, 0.9, 4'000'000'000, 8, 0};
  const Archive archive(write_rich(folder, facts));
  const UntilInfo& got = archive.info().until;
  EXPECT_EQ(got.questions, facts.until.questions);
  EXPECT_EQ(got.confidence, 0.9);
  EXPECT_EQ(got.most, 4'000'000'000u);
  EXPECT_EQ(got.least, 8u);
  EXPECT_EQ(got.answered_at, 0u);
  EXPECT_FALSE(archive.info().store_values);
  EXPECT_FALSE(archive.info().source.options.ignore_missing_meshes);
  EXPECT_EQ(archive.info().part.end, 0u);
}

class ForgedFacts : public ::testing::Test {
 protected:
  std::string after(const std::function<void(hid_t)>& change) const {
    return refusal(forged(folder_, source_, change));
  }
  static void set(hid_t file, const char* name, std::uint64_t value) {
    if (hdf5::has_attribute(file, name)) hdf5::check(H5Adelete(file, name), name);
    hdf5::write_attribute(file, name, value);
  }
  static void set_texts(hid_t file, const char* path, const std::vector<std::string>& texts) {
    drop(file, path);
    hdf5::write_strings(file, path, texts);
  }
  static void add_source(hid_t file) {
    hdf5::write_attribute(file, "source_file", std::string("a.yaml"));
    hdf5::write_attribute(file, "source_folder", std::string("/"));
    hdf5::write_attribute(file, "source_ignores_missing_meshes", std::uint64_t{0});
  }
  static void add_until(hid_t file, double confidence) {
    hdf5::write_attribute(file, "until", std::string("p > 0"));
    hdf5::write_attribute(file, "until_confidence", confidence);
    for (const char* name : {"until_most", "until_least", "until_answered_at"}) {
      hdf5::write_attribute(file, name, std::uint64_t{1});
    }
  }
  static fs::path make_source(const Folder& folder) {
    CampaignInfo facts = rich();
    facts.part = {};
    write_rich(folder, facts);
    pack(folder / "rich.graze", folder / "rich.h5", false);
    return folder / "rich.h5";
  }

  Folder folder_;
  fs::path source_ = make_source(folder_);
};

TEST_F(ForgedFacts, TablesAreAsLongAsTheirNeighbours) {
  EXPECT_EQ(Archive(forged(folder_, source_, add_source)).info().source.inputs.size(), 3u);
  for (const char* path : {"requirements/description", "requirements/unit", "requirements/parts", "objective/unit",
                           "objective/description", "parameters/name", "parameters/unit", "parameters/jitter",
                           "parameters/distribution"}) {
    for (const std::size_t length : {1u, 7u}) {
      EXPECT_THAT(after([&](hid_t f) { set_texts(f, path, std::vector<std::string>(length)); }),
                  HasSubstr(std::string("dataset '") + path + "' is not as long as its neighbours"));
    }
  }
  EXPECT_THAT(after([](hid_t f) { add_source(f), set_texts(f, "inputs/set_value", {"2"}); }),
              HasSubstr("'inputs/set_value' is not as long"));
  EXPECT_THAT(after([](hid_t f) {
                add_source(f), set_texts(f, "inputs/path", {"a.yaml", "b.urdf"});
              }),
              HasSubstr("'inputs/offset' does not divide the bytes"));
}

TEST_F(ForgedFacts, MeasuresComeLastAndHaveTheirWindows) {
  const hdf5::Spec measure{"measure", hdf5::Type::u8};
  for (const std::vector<std::uint8_t>& flags : std::vector<std::vector<std::uint8_t>>{{0, 1, 0, 1}, {0, 0, 1}}) {
    EXPECT_THAT(after([&](hid_t f) { replace(f, "requirements", measure, flags); }),
                HasSubstr("'requirements/measure' does not fit"));
  }
  for (const char* name : {"from", "to"}) {
    const hdf5::Spec spec{name, hdf5::Type::f64, false, 1, "s"};
    EXPECT_THAT(after([&](hid_t f) {
                  replace(f, "requirements", spec, std::vector<double>{0, 0, 0});
                }),
                HasSubstr("'requirements/from' and 'to' do not fit"));
    EXPECT_THAT(after([&](hid_t f) { replace(f, "requirements", spec, std::vector<double>(5)); }),
                HasSubstr("'requirements/from' and 'to' do not fit"));
  }
}

TEST_F(ForgedFacts, OffsetsDivideTheirBytes) {
  const hdf5::Spec offset{"offset", hdf5::Type::u64};
  for (const std::vector<std::uint64_t>& wrong :
       std::vector<std::vector<std::uint64_t>>{{1, 10, 10, 18}, {0, 10, 10, 17}, {0, 10, 10, 19}, {0, 10, 9, 18}}) {
    EXPECT_THAT(after([&](hid_t f) { add_source(f), replace(f, "inputs", offset, wrong); }),
                HasSubstr("'inputs/offset' does not divide the bytes"));
  }
  const hdf5::Spec labels{"label_offset", hdf5::Type::u64};
  for (const std::vector<std::uint64_t>& wrong :
       std::vector<std::vector<std::uint64_t>>{{1, 1, 2, 2}, {0, 0, 2, 3}, {0, 0, 1, 1}, {0, 0, 2}}) {
    EXPECT_THAT(after([&](hid_t f) { replace(f, "parameters", labels, wrong); }),
                HasSubstr("'parameters/label_offset' does not divide the labels"));
  }
}

TEST_F(ForgedFacts, NumbersArePossible) {
  for (const double confidence : {0.0, 1.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THAT(after([&](hid_t f) { add_until(f, confidence); }), HasSubstr("until_confidence is not within (0, 1)"));
  }
  EXPECT_EQ(Archive(forged(folder_, source_, [](hid_t f) { add_until(f, 0.5); })).info().until.least, 1u);
  using Range = std::pair<std::uint64_t, std::uint64_t>;
  for (const auto& [begin, end] : std::vector<Range>{{5, 5}, {6, 5}, {0, 41}}) {
    EXPECT_THAT(after([&, from = begin, to = end](hid_t f) { set(f, "part_begin", from), set(f, "part_end", to); }),
                HasSubstr("part_end does not fit its campaign"));
  }
  const auto whole = [](hid_t f) { set(f, "part_begin", 39), set(f, "part_end", 40); };
  EXPECT_EQ(Archive(forged(folder_, source_, whole)).info().part.begin, 39u);
  constexpr std::uint64_t kMost = std::uint64_t{1} << 32;
  EXPECT_EQ(Archive(forged(folder_, source_, [](hid_t f) { set(f, "particles", kMost); })).info().particles, kMost);
  EXPECT_THAT(after([](hid_t f) { set(f, "particles", kMost + 1); }),
              HasSubstr("'particles' is 4294967297; a campaign has 1 to 4294967296"));
}

// Claim: of an archive that lacks how its contacts converged, but not how many steps did not, the rest is told as far
// as it can be known; a limit that is none is refused.
TEST_F(ForgedFacts, OlderArchivesKnowLessOfTheSolver) {
  const Archive archive(forged(folder_, source_, [](hid_t f) {
    drop(f, "traces/step/1cm/convergence");
    H5Adelete(f, "unconverged_limit");
  }));
  std::size_t seen = 0;
  archive.scan("step/1cm", kEndTime | kSolver, [&](const TraceRows& rows) {
    for (std::size_t i = 0; i < rows.size(); ++i, ++seen) {
      const SolverLog want = trace(archive.info(), 0, rows.particle(i)).solver, log = rows.solver(i);
      EXPECT_EQ(log.unconverged_steps, want.unconverged_steps);
      EXPECT_EQ(log.largest_residual, want.largest_residual);
      EXPECT_EQ(log.steps, std::round(rows.end_time(i) / archive.info().step));
      for (const double unknown : {log.median_residual, log.braked_steps, log.most_braked}) {
        EXPECT_TRUE(std::isnan(unknown));
      }
    }
  });
  EXPECT_EQ(seen, 8u);
  for (const double wrong : {-0.01, 1.01, std::numeric_limits<double>::quiet_NaN()}) {
    const auto change = [=](hid_t f) {
      H5Adelete(f, "unconverged_limit");
      hdf5::write_attribute(f, "unconverged_limit", wrong);
    };
    EXPECT_THAT(after(change), HasSubstr("it must be a share of steps, 0 to 1"));
  }
}

// Claim: an archive that lacks what later programs added is read, and says nothing of it.
TEST_F(ForgedFacts, OlderArchivesDoWithout) {
  const Archive archive(forged(folder_, source_, [](hid_t f) {
    for (const char* path : {"names/links", "objective", "requirements/parts", "requirements/from", "inputs"}) {
      drop(f, path);
    }
    for (const char* name : {"margin_parts", "violation_parts", "objective_culprit", "solver", "convergence"}) {
      drop(f, (std::string("traces/step/1cm/") + name).c_str());
    }
    for (const char* name : {"results_version", "compiler", "instruction_set", "unconverged_limit"}) H5Adelete(f, name);
  }));
  const CampaignInfo& got = archive.info();
  EXPECT_TRUE(got.links.empty());
  EXPECT_TRUE(got.leaves.empty());
  EXPECT_EQ(got.requirements[1].parts, "");
  EXPECT_TRUE(got.requirements[3].measure);
  EXPECT_EQ(got.requirements[3].window.from, 0);
  EXPECT_EQ(got.requirements[3].window.to, std::numeric_limits<double>::infinity());
  EXPECT_EQ(got.results_version, "");
  EXPECT_EQ(got.build.compiler, "");
  EXPECT_EQ(got.build.c_library, "glibc 4.5");
  EXPECT_TRUE(got.source.inputs.empty());
  EXPECT_EQ(got.unconverged, kUnconvergedShare);
  const std::optional<TraceRecord> trace = archive.trace("step/1cm", 5);
  ASSERT_TRUE(trace);
  EXPECT_TRUE(trace->margin_parts.empty());
  EXPECT_EQ(trace->objective_culprit.leaf, -1);
  archive.scan("step/1cm", kAllColumns, [](const TraceRows& rows) {
    EXPECT_FALSE(rows.has_solver());
    EXPECT_EQ(rows.culprit(0).part, kNoPart);
  });
}

// Claim: a shard of another scenario with the same seed is another campaign's; a replay's export is told from an
// archive.
TEST(Facts, FilesOfOtherKindsAreTold) {
  const Folder folder;
  CampaignInfo facts = info();
  facts.particles = 8;
  write(folder / "a.graze", facts);
  facts.scenario_sha256 = std::string(64, 'b');
  write(folder / "b.graze", facts);
  fs::copy(folder / "b.graze/shards/000001.h5", folder / "a.graze/shards/000002.h5");
  EXPECT_THAT(refusal(folder / "a.graze"), AllOf(HasSubstr("000002.h5"), HasSubstr("belongs to another campaign")));
  fs::copy_file(folder / "b.graze/campaign.h5", folder / "a.graze/shards/000002.h5",
                fs::copy_options::overwrite_existing);
  EXPECT_THAT(refusal(folder / "a.graze"), HasSubstr("is a whole campaign where one of its shards is expected"));
  write_replay(replayed(), folder / "r.h5", false);
  EXPECT_THAT(refusal(folder / "r.h5"), HasSubstr("is what graze replay has exported, one trace and no archive"));
  EXPECT_THAT(message_of<ForeignFile>([&] { verify(folder / "r.h5"); }),
              HasSubstr("r.h5: has an intact seal, and is what graze replay has exported"));
  EXPECT_THAT(message_of<ForeignFile>([&] { verify(folder / "b.graze/shards/000001.h5"); }),
              HasSubstr("is one shard of a campaign"));
  EXPECT_THAT(message_of<ForeignFile>([&] { verify(folder / "b.graze/campaign.h5"); }),
              HasSubstr("only describes a campaign"));
}

}  // namespace
}  // namespace graze
