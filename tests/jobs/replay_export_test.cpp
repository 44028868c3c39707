// Claim: what a replay exports is the trace, whole, and within the memory that there is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "archive/hdf5/hdf5.h"
#include "tests/jobs/replay_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using testing::Balls;
using ::testing::HasSubstr;
using testing::read_csv;
using testing::request;
using testing::row;
using testing::table;
using testing::TemporaryFolder;
using testing::write_campaign;
namespace fs = std::filesystem;

// The last row of a CSV export, read as text, has the bits of the archive's final state.
TEST(ReplayExport, CsvEndsInTheFinalState) {
  const Balls balls;
  ASSERT_EQ(balls.graze("replay a.graze --particle 3 -o out.csv").code, 0);
  const std::optional<TraceRecord> want = Archive(balls.folder / "a.graze").trace("still", 3);
  const auto rows = read_csv(balls.folder / "out.csv");
  ASSERT_EQ(rows.size(), 52u) << "a head, the start and 50 steps";
  std::vector<double> q, v;
  for (std::size_t i = 0; i < rows[0].size(); ++i) {
    if (rows[0][i].starts_with("q.")) q.push_back(std::stod(rows.back()[i]));
    if (rows[0][i].starts_with("v.")) v.push_back(std::stod(rows.back()[i]));
  }
  EXPECT_EQ(q, want->q);
  EXPECT_EQ(v, want->v);
  EXPECT_EQ(rows[0][0], "time [s]");
  EXPECT_EQ(std::stod(rows.back()[0]), want->end_time);
  EXPECT_THAT(testing::read_file(balls.folder / "out.trace.csv"), HasSubstr("verification,identical"));
  EXPECT_THAT(testing::read_file(balls.folder / "out.parameters.csv"), HasSubstr("initial.base.z,m,0,"));
  EXPECT_THAT(testing::read_file(balls.folder / "out.contacts.csv"), HasSubstr("frame,time [s],a,b"));
  EXPECT_THAT(testing::read_file(balls.folder / "out.events.csv"), HasSubstr("time [s],kind,a,b"));
}

TEST(ReplayExport, Hdf5EndsInTheFinalState) {
  const Balls balls;
  ASSERT_EQ(balls.graze("replay a.graze --particle 3 -o out.h5").code, 0);
  const std::optional<TraceRecord> want = Archive(balls.folder / "a.graze").trace("still", 3);
  const hdf5::Lock lock;
  const hdf5::Handle file = hdf5::open_for_reading(balls.folder / "out.h5");
  const auto read = [&](const std::string& group, const hdf5::Spec& spec) {
    return hdf5::read_column<double>(file.id(), group, spec, fs::file_size(balls.folder / "out.h5"));
  };
  const auto time = read("telemetry", {"time"});
  ASSERT_EQ(time.size(), 51u);
  EXPECT_EQ(time.back(), want->end_time);
  const auto q = read("telemetry", {"q", hdf5::Type::f64, true, 7});
  const auto v = read("telemetry", {"v", hdf5::Type::f64, true, 6});
  EXPECT_EQ(std::vector<double>(q.end() - 7, q.end()), want->q);
  EXPECT_EQ(std::vector<double>(v.end() - 6, v.end()), want->v);
  EXPECT_EQ(hdf5::read_strings(file.id(), "names/q").at(6), "base.z");
  EXPECT_EQ(hdf5::read_strings(file.id(), "units/q").at(6), "m");
  EXPECT_EQ(read("requirements", {"margin"}), want->margins);
  EXPECT_EQ(hdf5::read_count(file.id(), "digest"), want->digest);
  EXPECT_EQ(hdf5::read_text(file.id(), "verification"), "identical");
}

TEST(ReplayExport, OverwritesOnlyWhenForced) {
  const Balls balls;
  testing::write_file(balls.folder / "out.events.csv", "mine");
  const testing::Result refused = balls.graze("replay a.graze --particle 3 -o out.csv");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("out.events.csv: exists already"), HasSubstr("--force")));
  EXPECT_FALSE(fs::exists(balls.folder / "out.csv"));
  EXPECT_EQ(testing::read_file(balls.folder / "out.events.csv"), "mine");
  EXPECT_EQ(balls.graze("replay a.graze --particle 3 -o out.csv --force").code, 0);
  EXPECT_EQ(balls.graze("replay a.graze --particle 3 -o out.txt").code, 2);
  EXPECT_EQ(balls.graze("replay a.graze --particle 3 -o out.csv/out.h5").code, 3);
}

// An export that memory would not hold is refused with the --every that fits; that keeps every K-th frame as it is.
TEST(ReplayExport, ExportsAreBounded) {
  const TemporaryFolder folder;
  testing::write_file(folder / "ball.urdf", testing::kBallUrdf);
  testing::write_file(folder / "ball.yaml", testing::ball_scenario());
  write_campaign(folder / "a.graze", load_scenario((folder / "ball.yaml").string()), 1);
  ReplayRequest asked = request(folder / "a.graze", 0, "still");
  const StepLog all = replay(asked).file.log;
  asked.most_bytes = 20'000;
  std::string message;
  try {
    replay(asked);
  } catch (const InputError& error) {
    message = error.what();
  }
  EXPECT_THAT(message, HasSubstr("--output: " + std::to_string(all.time.size()) + " frames take "));
  const std::size_t at = message.find("--every ");
  ASSERT_NE(at, std::string::npos) << message;
  asked.every = static_cast<std::uint32_t>(std::stoul(message.substr(at + 8)));
  asked.most_bytes = kMaxReplayBytes;
  const Replay thinned = replay(asked);
  EXPECT_TRUE(thinned.verified());
  const StepLog& some = thinned.file.log;
  ASSERT_EQ(some.time.size(), (all.time.size() - 1) / asked.every + 1);
  for (std::size_t k = 0; k < some.time.size(); ++k) {
    EXPECT_EQ(some.time[k], all.time[k * asked.every]);
    EXPECT_EQ(row(table(some, "q"), k), row(table(all, "q"), k * asked.every));
  }
}

}  // namespace
}  // namespace graze
