// Claim: a replay's export holds every fact of the trace, its numbers with all their bits, as h5py reads it and as
// text.
#include "archive/replay_file.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "sampling/constants.h"
#include "simulation/results_epoch.h"
#include "tests/archive/compare.h"
#include "tests/archive/replayed.h"
#include "tests/jobs/program.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;
namespace fs = std::filesystem;

/// What h5py says of a file; nothing if there is no h5py.
Json read_by_h5py(const Folder& folder, const fs::path& file) {
  if (std::system("/usr/bin/python3 -c 'import h5py' 2>/dev/null") != 0) return {};
  const testing::Result read = testing::shell(
      folder.path(), "/usr/bin/python3 '" GRAZE_SOURCE_DIR "/tests/archive/dump_hdf5.py' '" + file.string() + "'");
  EXPECT_EQ(read.code, 0) << read.err;
  return Json::parse(read.out);
}

/// All numbers of a dataset, row by row.
std::vector<double> numbers(const Json& data) {
  std::vector<double> out;
  for (const Json& one : data) {
    if (one.is_array()) {
      const std::vector<double> row = numbers(one);
      out.insert(out.end(), row.begin(), row.end());
    } else {
      out.push_back(one.is_string() ? std::strtod(one.get<std::string>().c_str(), nullptr) : one.get<double>());
    }
  }
  return out;
}

class ReplayHdf5 : public ::testing::Test {
 protected:
  void SetUp() override {
    write_replay(replay_, folder_ / "r.h5", false);
    const Json all = read_by_h5py(folder_, folder_ / "r.h5");
    if (all.is_null()) GTEST_SKIP() << "no h5py";
    attributes_ = all["attributes"];
    datasets_ = all["datasets"];
  }
  void expect_numbers(const std::string& path, const std::vector<double>& want, const std::string& unit = "") const {
    SCOPED_TRACE(path);
    ASSERT_TRUE(datasets_.contains(path));
    expect_same(numbers(datasets_[path]["data"]), want);
    EXPECT_EQ(datasets_[path]["unit"], unit);
  }
  void expect_texts(const std::string& path, const std::vector<std::string>& want) const {
    EXPECT_EQ(datasets_.value(path, Json())["data"], Json(want)) << path;
  }

  Folder folder_;
  ReplayFile replay_ = replayed();
  Json attributes_, datasets_;
};

TEST_F(ReplayHdf5, HasTheFactsOfTheTrace) {
  const Json want = {{"format", "graze-replay"},
                     {"format_version", 1},
                     {"archive", "runs/a, b.graze"},
                     {"scenario_name", replay_.info.scenario_name},
                     {"scenario", "graze: 1"},
                     {"scenario_sha256", replay_.info.scenario_sha256},
                     {"results_version", results_version()},
                     {"physics", "bullet"},
                     {"seed", 0xFFFFFFFFFFFFFFF0},
                     {"particle", 7},
                     {"policy", "step/1cm"},
                     {"outcome", "known failure"},
                     {"violated", "clears-curb"},
                     {"invalid_reason", ""},
                     {"objective", "crossed"},
                     {"objective_culprit", "place of the feet: LF_FOOT"},
                     {"contact_sequence", "LF_FOOT-curb"},
                     {"verification", "different"},
                     {"digest", 0xFEDCBA9876543210},
                     {"archived_digest", 0x123}};
  for (const auto& [name, value] : want.items()) EXPECT_EQ(attributes_.value(name, Json()), value) << name;
  expect_same(numbers({attributes_["step"], attributes_["control"], attributes_["end_time"]}), {0.001, 0.002, 0.2});
  expect_same(numbers({attributes_["objective_margin"]}), {-0.125});
  EXPECT_TRUE(attributes_.contains("compiler"));
}

TEST_F(ReplayHdf5, HasAllFramesAndWhatTheirColumnsAre) {
  expect_numbers("telemetry/time", {0, 0.1, 0.2}, "s");
  expect_numbers("telemetry/q", {1, 2, 3, 4, 5, 1.0 / 3});
  EXPECT_EQ(datasets_["telemetry/q"]["data"].size(), 3u) << "a row for each frame";
  expect_numbers("telemetry/command/kp", {10, 20, kNaN});
  EXPECT_EQ(datasets_["telemetry/none"]["data"], Json::parse("[[], [], []]"));
  expect_texts("names/q", {"base.x", "base.qw"});
  expect_texts("units/q", {"m", "1"});
  expect_texts("names/command/kp", {"LF_X_1"});
  expect_texts("units/command/kp", {"N m/rad"});
}

TEST_F(ReplayHdf5, HasContactsAndEvents) {
  expect_numbers("contacts/frame", {1, 1, 2});
  expect_numbers("contacts/time", {0.1, 0.1, 0.2}, "s");
  expect_numbers("contacts/a", {0, 0, 0});
  expect_numbers("contacts/b", {1, 2, 2});
  expect_numbers("contacts/feature_a", {6, 6, 6});
  expect_numbers("contacts/feature_b", {4, 1, 1});
  expect_numbers("contacts/mode", {0, 1, 2});
  EXPECT_EQ(datasets_["contacts/mode"]["labels"], Json({"stick", "slip", "roll"}));
  EXPECT_EQ(datasets_["contacts/feature_b"]["labels"][4], "edge");
  expect_numbers("contacts/gap", {-0.002, -0.003, -0.004}, "m");
  std::vector<double> normal_impulses;
  for (const Contact& contact : replay_.log.contacts) normal_impulses.push_back(contact.normal_impulse());
  expect_numbers("contacts/normal_impulse", normal_impulses, "N s");
  expect_numbers("contacts/position", {2, 0.25, -1, 3, 0.25, -1, 4, 0.25, -1}, "m");
  expect_numbers("contacts/normal", {0, 0.6, 0.8, 0, 0.6, 0.8, 0, 0.6, 0.8});
  expect_numbers("contacts/impulse", {0.5, 1, 2, 0.5, 1, 3, 0.5, 1, 4}, "N s");
  expect_texts("names/colliders", {"LF_FOOT", "curb", "ground"});
  expect_texts("names/bodies", {"BODY0", "LF_SHIN"});
  expect_numbers("events/time", {0.1, 0.2}, "s");
  expect_numbers("events/kind", {0, 5});
  EXPECT_EQ(datasets_["events/kind"]["labels"][5], "limit_end");
  expect_numbers("events/a", {0, 1});
  expect_numbers("events/b", {1, 1});
  expect_numbers("events/feature_a", {6, 0});
  expect_numbers("events/feature_b", {7, 0});
  expect_numbers("events/impulse", {0.5, 0}, "N s");
  expect_numbers("events/position", {1, 2, 3, 0, 0, 0}, "m");
}

TEST_F(ReplayHdf5, HasRequirementsParametersAndDerivedNumbers) {
  expect_texts("requirements/name", {"upright", "clears-curb", "fast"});
  expect_texts("requirements/description", {"tilt of BODY0 below 90 deg", "no contact", "speed of the joint"});
  expect_texts("requirements/unit", {"rad", "m", "rad/s"});
  expect_numbers("requirements/measure", {0, 0, 1});
  expect_texts("requirements/kept", {"", "", "undecided"});
  expect_numbers("requirements/margin", {0.5, -0.25, 0.75});
  expect_numbers("requirements/first_violation", {kNaN, 0.2, kNaN}, "s");
  expect_texts("requirements/margin_culprit", {"", "LF_FOOT and curb", "LF_X_1"});
  expect_texts("requirements/violation_culprit", {"", "LF_FOOT and ground", ""});
  expect_numbers("requirements/from", {0, 0, 0.1}, "s");
  expect_numbers("requirements/to", {1.5, 1.5, 0.3}, "s");
  expect_texts("parameters/name", {"mass", "contact.model"});
  expect_texts("parameters/unit", {"kg", "1"});
  expect_texts("parameters/distribution", {"normal(mean=1, std=0.5)", "choice(2)"});
  expect_texts("parameters/nominal_label", {"", "say \"a\""});
  expect_texts("parameters/value_label", {"", "two\r\nlines"});
  expect_numbers("parameters/nominal", {1, 0});
  expect_numbers("parameters/value", {2, 1});
  expect_numbers("parameters/deviations", {2, kNaN});
  expect_texts("derived/name", {"inertia"});
  expect_texts("derived/unit", {"kg m^2"});
  expect_numbers("derived/nominal", {0.25});
  expect_numbers("derived/value", {0.125});
}

// Claim: what a trace lacks is left out or empty, and nothing is told of an invalid trace's measures.
TEST(Replay, SaysNothingOfWhatIsNotKnown) {
  const Folder folder;
  ReplayFile replay = replayed();
  replay.trace.outcome = Outcome::invalid;
  replay.trace.violated = -1;
  replay.trace.margin_parts.clear();
  replay.trace.violation_parts.clear();
  replay.archived_digest.reset();
  EXPECT_EQ(replay.kept(2), "");
  write_replay(replay, folder / "r.csv", false);
  const std::string text = content(folder / "r.trace.csv");
  EXPECT_THAT(text,
              AllOf(HasSubstr("\nkept.fast,,\n"), HasSubstr("\nviolated,,\n"), Not(HasSubstr("archived_digest"))));
  EXPECT_THAT(text, HasSubstr("\nmargin_culprit.clears-curb,,\n"));
  write_replay(replay, folder / "r.h5", false);
  const Json all = read_by_h5py(folder, folder / "r.h5");
  if (all.is_null()) GTEST_SKIP() << "no h5py";
  EXPECT_EQ(all["attributes"]["violated"], "");
  EXPECT_FALSE(all["attributes"].contains("archived_digest"));
  EXPECT_EQ(all["datasets"]["requirements/kept"]["data"], Json({"", "", ""}));
  EXPECT_EQ(all["datasets"]["requirements/margin_culprit"]["data"], Json({"", "", ""}));
}

TEST(ReplayCsv, IsThisText) {
  const Folder folder;
  write_replay(replayed(), folder / "r.csv", false);
  const auto text = [&](const char* name) { return content(folder / name); };
  EXPECT_EQ(text("r.csv"),
            "time [s],q.base.x [m],q.base.qw,command.kp.LF_X_1 [N m/rad]\n"
            "0,1,2,10\n0.1,3,4,20\n0.2,5,0.3333333333333333,\n");
  EXPECT_EQ(text("r.contacts.csv"),
            "frame,time [s],a,b,feature_a,feature_b,mode,gap [m],normal_impulse [N s],x [m],y [m],z [m],normal_x,"
            "normal_y,normal_z,impulse_x [N s],impulse_y [N s],impulse_z [N s]\n"
            "1,0.1,LF_FOOT,curb,cap,edge,stick,-0.002,2.2,2,0.25,-1,0,0.6,0.8,0.5,1,2\n"
            "1,0.1,LF_FOOT,ground,cap,top,slip,-0.003,3.0000000000000004,3,0.25,-1,0,0.6,0.8,0.5,1,3\n"
            "2,0.2,LF_FOOT,ground,cap,top,roll,-0.004,3.8000000000000003,4,0.25,-1,0,0.6,0.8,0.5,1,4\n");
  EXPECT_EQ(text("r.events.csv"),
            "time [s],kind,a,b,feature_a,feature_b,impulse [N s],x [m],y [m],z [m]\n"
            "0.1,contact_begin,LF_FOOT,curb,cap,rim,0.5,1,2,3\n"
            "0.2,limit_end,LF_SHIN,upper,surface,surface,0,0,0,0\n");
  EXPECT_EQ(text("r.phases.csv"),
            "begin [s],end [s],a,b,feature_a,feature_b,peak [N s],impulse [N s],slip,roll\n"
            "0.1,0.2,LF_FOOT,curb,cap,side,0.5,1.25,0.75,0.125\n");
  EXPECT_EQ(text("r.parameters.csv"),
            "name,unit,nominal,value,deviations,nominal_label,value_label,distribution\n"
            "mass,kg,1,2,2,,,\"normal(mean=1, std=0.5)\"\n"
            "contact.model,1,0,1,,\"say \"\"a\"\"\",\"two\r\nlines\",choice(2)\n");
  EXPECT_EQ(text("r.derived.csv"), "name,unit,nominal,value\ninertia,kg m^2,0.25,0.125\n");
}

TEST(ReplayCsv, TellsTheFactsOfTheTrace) {
  const Folder folder;
  write_replay(replayed(), folder / "r.csv", false);
  const std::string text = content(folder / "r.trace.csv");
  EXPECT_THAT(text, HasSubstr("archive,\"runs/a, b.graze\",\n"));
  EXPECT_THAT(text, HasSubstr("seed,18446744073709551600,\nparticle,7,\npolicy,step/1cm,\nstep,0.001,s\n"
                              "outcome,known failure,\nviolated,clears-curb,\ninvalid_reason,,\nend_time,0.2,s\n"));
  EXPECT_THAT(text,
              HasSubstr("is_measure.upright,no,\nmargin.upright,0.5,rad\nfirst_violation.upright,,s\n"
                        "margin_culprit.upright,,\nviolation_culprit.upright,,\nfrom.upright,0,s\nto.upright,1.5,s\n"
                        "is_measure.clears-curb,no,\nmargin.clears-curb,-0.25,m\nfirst_violation.clears-curb,0.2,s\n"
                        "margin_culprit.clears-curb,LF_FOOT and curb,\n"
                        "violation_culprit.clears-curb,LF_FOOT and ground,\n"));
  EXPECT_THAT(text, HasSubstr("from.fast,0.1,s\nto.fast,0.3,s\nkept.fast,undecided,\nobjective,crossed,\n"));
  EXPECT_THAT(text, EndsWith("objective_margin,-0.125,\nobjective_culprit,place of the feet: LF_FOOT,\n"
                             "verification,different,\ndigest,0xfedcba9876543210,\n"
                             "archived_digest,0x0000000000000123,\n"));
}

// Claim: a table that is written in many pieces is whole.
TEST(ReplayCsv, HasAllOfALongTrace) {
  constexpr int kFrames = 30'000;
  const Folder folder;
  ReplayFile replay = replayed();
  replay.log = {};
  replay.log.tables = {{"v", {{"x", "m/s"}, {"y", "m/s"}, {"z", "m/s"}}}};
  std::string want = "time [s],v.x [m/s],v.y [m/s],v.z [m/s]\n";
  for (int i = 0; i < kFrames; ++i) {
    replay.log.time.push_back(i);
    for (const double x : {i + 0.123456789012345, -i - 0.5, 1e-300}) replay.log.tables[0].values.push_back(x);
  }
  write_replay(replay, folder / "r.csv", false);
  std::ifstream in(folder / "r.csv");
  std::string line;
  ASSERT_TRUE(std::getline(in, line));
  EXPECT_EQ(line + "\n", want);
  for (int i = 0; i < kFrames; ++i) {
    ASSERT_TRUE(std::getline(in, line)) << i;
    double t = 0, x = 0, y = 0, z = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &t, &x, &y, &z), 4) << line;
    ASSERT_EQ(t, i);
    ASSERT_EQ(x, i + 0.123456789012345);
    ASSERT_EQ(y, -i - 0.5);
    ASSERT_EQ(z, 1e-300);
  }
  EXPECT_FALSE(std::getline(in, line));
}

// Claim: the name decides the form; no file of a replay takes another's place without force, nor the archive's.
TEST(Replay, OutputsAreCheckedBeforeTheyAreWritten) {
  EXPECT_THAT(replay_files("out/r.h5"), ElementsAre("out/r.h5"));
  EXPECT_THAT(replay_files("out/R.HDF5"), ElementsAre("out/R.HDF5"));
  EXPECT_THAT(replay_files("out/r.CSV"),
              ElementsAre("out/r.CSV", "out/r.contacts.csv", "out/r.events.csv", "out/r.phases.csv",
                          "out/r.parameters.csv", "out/r.derived.csv", "out/r.trace.csv"));
  for (const char* wrong : {"r.txt", "r", "r.1", ".csv", "r.h5/", "r.graze"}) {
    EXPECT_THAT(message_of<InputError>([&] { replay_files(wrong); }),
                AllOf(HasSubstr(std::string("--output ") + wrong + ": "), HasSubstr("nearest right answer: ")));
  }
  const Folder folder;
  put(folder / "r.trace.csv", "mine");
  EXPECT_THAT(message_of<InputError>([&] { check_replay_output(folder / "r.csv", false, folder / "a.h5"); }),
              AllOf(HasSubstr("r.trace.csv: exists already"), HasSubstr("--force")));
  EXPECT_NO_THROW(check_replay_output(folder / "r.csv", true, folder / "a.h5"));
  EXPECT_THAT(message_of<InputError>([&] { write_replay(replayed(), folder / "r.csv", false); }),
              HasSubstr("r.trace.csv: has appeared"));
  EXPECT_EQ(content(folder / "r.trace.csv"), "mine");
  EXPECT_THAT(message_of<InputError>([&] { check_replay_output(folder / "a.h5", true, folder / "a.h5"); }),
              AllOf(HasSubstr("a.h5: is "), HasSubstr("only read")));
  fs::create_directory(folder / "a.graze");
  EXPECT_THAT(message_of<InputError>([&] { check_replay_output(folder / "a.graze/r.csv", true, folder / "a.graze"); }),
              HasSubstr("lies within"));
  EXPECT_THAT(message_of<InputError>(
                  [&] { check_replay_output(folder / "r.csv", true, folder / "a.h5", {folder / "r.trace.csv"}); }),
              AllOf(HasSubstr("r.trace.csv: is "), HasSubstr("only read")));
}

}  // namespace
}  // namespace graze
