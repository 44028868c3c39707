// Batch scripts: what graze submit writes, what it refuses; and campaigns that are simulated in parts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "archive/archive.h"
#include "jobs/batch_script.h"
#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::TemporaryFolder;

// Claim: every form of time that Slurm reads means what Slurm takes it for (man sbatch).
TEST(SlurmTime, ReadsWhatSlurmReads) {
  EXPECT_EQ(parse_slurm_time("90"), 90u * 60);
  EXPECT_EQ(parse_slurm_time("1:30"), 90u);
  EXPECT_EQ(parse_slurm_time("2:00:00"), 7200u);
  EXPECT_EQ(parse_slurm_time("1-12"), 36u * 3600);
  EXPECT_EQ(parse_slurm_time("1-00:30"), 24u * 3600 + 1800);
  EXPECT_EQ(parse_slurm_time("2-03:04:05"), 183845u);
  EXPECT_EQ(slurm_time(183845), "2-03:04:05");
}

// Claim: what it does not read is refused with the nearest right answer, which reads.
TEST(SlurmTime, RefusesTheRestWithTheNearestRightAnswer) {
  const auto nearest_to = [](const std::string& text) -> std::string {
    try {
      parse_slurm_time(text);
      return "taken";
    } catch (const InputError& error) {
      const std::string message = error.what(), mark = "nearest right answer: ";
      return message.substr(message.find(mark) + mark.size());
    }
  };
  EXPECT_EQ(nearest_to("2h"), "0-02:00:00");
  EXPECT_EQ(nearest_to("90 min"), "0-01:30:00");
  EXPECT_EQ(nearest_to("1.5 days"), "1-12:00:00");
  EXPECT_EQ(nearest_to("1:75:00"), "0-02:15:00");
  EXPECT_EQ(nearest_to("1-30"), "2-06:00:00");
  EXPECT_EQ(nearest_to("soon"), "2:00:00 (hours:minutes:seconds)");
  EXPECT_EQ(nearest_to(""), "2:00:00 (hours:minutes:seconds)");
  EXPECT_EQ(nearest_to("0"), "2:00:00");
  EXPECT_EQ(parse_slurm_memory("4000"), "4000");
  EXPECT_EQ(parse_slurm_memory("4G"), "4G");
  EXPECT_THROW(parse_slurm_memory("4 GB"), InputError);
}

TEST(Submit, PrintsAScriptThatTheShellReads) {
  const testing::BallCampaign campaign;
  const testing::Result mpi = campaign.graze(
      "submit ball.yaml --nodes 3 --ntasks-per-node 2 --cpus-per-task 8 --time 1-12 --partition long --mem 4G "
      "-n 500 --set 'time.end=40 ms' --until 'p >= 0.9' -o out.graze --dry-run");
  EXPECT_EQ(mpi.code, 0) << mpi.err;
  EXPECT_THAT(mpi.out, AllOf(HasSubstr("#SBATCH --nodes=3\n"), HasSubstr("#SBATCH --ntasks-per-node=2\n"),
                             HasSubstr("#SBATCH --cpus-per-task=8\n"), HasSubstr("#SBATCH --time=1-12:00:00\n"),
                             HasSubstr("#SBATCH --partition=long\n"), HasSubstr("#SBATCH --mem=4G\n"),
                             HasSubstr("#SBATCH --requeue\n"), HasSubstr("#SBATCH --signal=B:USR1@120\n"),
                             HasSubstr("run ball.yaml -n 500 --set 'time.end=40 ms' --until 'p >= 0.9' --threads"),
                             HasSubstr("resume \"$campaign\""), HasSubstr("mpirun -np \"$SLURM_NTASKS\"")));
  const testing::Result array = campaign.graze("submit ball.yaml --array 4 --time 10 --watchdog 5 --dry-run");
  EXPECT_THAT(array.out, AllOf(HasSubstr("#SBATCH --array=1-4\n"), HasSubstr("--part \"$SLURM_ARRAY_TASK_ID/4\""),
                               HasSubstr("pack ball.parts/* -o ball.h5"),
                               HasSubstr("resume \"$campaign\" --watchdog 5 --threads"), Not(HasSubstr("mpirun"))));
  for (const std::string& script : {mpi.out, array.out}) {
    testing::write_file(campaign.folder / "script", script);
    const testing::Result read = testing::shell(campaign.folder.path(), "bash -n script");
    EXPECT_EQ(read.code, 0) << read.err;
  }
  EXPECT_FALSE(std::filesystem::exists(campaign.folder / "out.sbatch")) << "--dry-run writes nothing";
}

/// Slurm's variables, as a job of one task has them.
const char* const kJob = "SLURM_CPUS_PER_TASK=1 SLURM_NTASKS=1 SLURM_JOB_ID=1 ";

// Claim: the script runs the campaign; started again it resumes what is there, with what it found finished.
TEST(Submit, ScriptCanBeStartedAgain) {
  const testing::BallCampaign campaign;
  const testing::Result script = campaign.graze("submit ball.yaml --time 10 -n 100 --dry-run");
  testing::write_file(campaign.folder / "job", script.out);
  const testing::Result first = testing::shell(campaign.folder.path(), std::string(kJob) + "bash job");
  EXPECT_EQ(first.code, 0) << first.err;
  const testing::Result second = testing::shell(campaign.folder.path(), std::string(kJob) + "bash job");
  EXPECT_EQ(second.code, 0);
  EXPECT_THAT(second.err, HasSubstr("100 of 100 traces are there"));
}

// Claim: the signal that Slurm sends before the time is up makes the script finish its blocks, queue itself again, and
// go on from there; the result has the bits of a plain run.
TEST(Submit, SignalledScriptQueuesItselfAgain) {
  const testing::BallCampaign campaign;
  const testing::Result script = campaign.graze("submit ball.yaml --time 10 -n 100000 --dry-run");
  testing::write_file(campaign.folder / "job", script.out);
  testing::write_file(campaign.folder / "scontrol", "#!/bin/sh\necho \"$@\" >>requeued\n");
  const std::string start = std::string("chmod +x scontrol; export PATH=\"$PWD:$PATH\" ") + kJob;
  const testing::Result stopped = testing::shell(
      campaign.folder.path(), start +
                                  "; bash job & job=$!; while [ ! -e ball.graze/shards ]; do sleep 0.02; done; "
                                  "sleep 0.3; kill -USR1 $job; wait $job");
  EXPECT_EQ(stopped.code, 3) << stopped.err;
  EXPECT_EQ(testing::read_file(campaign.folder / "requeued"), "requeue 1\n");
  const testing::Result again = testing::shell(campaign.folder.path(), start + "; bash job");
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_THAT(again.err, Not(HasSubstr(" 0 of 100000")));
  ASSERT_EQ(campaign.graze("run ball.yaml -n 100000 --quiet -o plain.graze").code, 0);
  EXPECT_EQ(Archive(campaign.folder / "ball.graze").traces("still").digest,
            Archive(campaign.folder / "plain.graze").traces("still").digest);
}

TEST(Submit, MistakesAreToldBeforeAnythingIsQueued) {
  const testing::BallCampaign campaign;
  const auto refused = [&](const std::string& arguments, const std::string& what) {
    const testing::Result result = campaign.graze("submit " + arguments);
    EXPECT_EQ(result.code, 2) << arguments << result.err;
    EXPECT_THAT(result.err, HasSubstr(what));
    EXPECT_FALSE(std::filesystem::exists(campaign.folder / "ball.sbatch"));
  };
  refused("ball.yaml --time 2h", "nearest right answer: 0-02:00:00");
  refused("ball.yaml --time 10 --mem 4GB", "nearest right answer: 4G");
  refused("ball.yml --time 10", "ball.yml");
  refused("ball.yaml --time 10 --polcy still", "--polcy");
  refused("ball.yaml --time 10 --policy stil", "nearest: still");
  refused("ball.yaml --time 10 --until 'p => 0.9'", "nearest right answer: 'p >= 0.95'");
  refused("ball.yaml --time 10 --until 'p >= 0.9' --array 4", "leave out --array");
  refused("ball.yaml --time 10 --nodes 2 --array 4", "--array");
  refused("ball.yaml --time 10 -o ball.h5", "nearest: -o ball.graze");
  refused("ball.yaml --time 10 --force", "choose another -o");
  refused("ball.yaml", "--time is required");
  std::filesystem::create_directory(campaign.folder / "ball.graze");
  refused("ball.yaml --time 10", "exists already");
}

TEST(Submit, SaysWhenThereIsNoSlurm) {
  const testing::BallCampaign campaign;
  const testing::Result result = testing::shell(
      campaign.folder.path(), std::string("PATH=/nowhere '") + GRAZE_PROGRAM + "' submit ball.yaml --time 10");
  EXPECT_EQ(result.code, 3);
  EXPECT_THAT(result.err, AllOf(HasSubstr("sbatch: not found"), HasSubstr("ball.sbatch")));
}

// Claim: parts of any number, packed together, are byte for byte the campaign of one run.
TEST(Parts, TogetherAreTheCampaign) {
  const testing::BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 101 --quiet -o whole.graze").code, 0);
  for (const char* part : {"1/3", "2/3", "3/3"}) {
    const testing::Result ran =
        campaign.graze(std::string("run ball.yaml -n 101 --quiet -o p") + part[0] + " --part " + part);
    ASSERT_EQ(ran.code, 0) << ran.err;
    EXPECT_TRUE(Archive(campaign.folder / (std::string("p") + part[0])).complete());
  }
  EXPECT_THAT(campaign.graze("status p1").out, HasSubstr("34 of 34 traces (100.0 %)"));
  const testing::Result some = campaign.graze("pack p1 p3 -o some.h5");
  ASSERT_EQ(some.code, 0) << some.err;
  EXPECT_FALSE(Archive(campaign.folder / "some.h5").complete());
  ASSERT_EQ(campaign.graze("pack p3 p1 p2 -o joined.h5").code, 0);
  ASSERT_EQ(campaign.graze("pack whole.graze").code, 0);
  const Archive joined(campaign.folder / "joined.h5"), whole(campaign.folder / "whole.h5");
  EXPECT_TRUE(joined.complete());
  const TraceTable a = joined.traces("still"), b = whole.traces("still");
  EXPECT_EQ(a.particle, b.particle);
  EXPECT_EQ(a.digest, b.digest);
  // Under one name, which the table's replay commands have in them.
  const std::string table = campaign.graze("score whole.h5").out;
  std::filesystem::rename(campaign.folder / "joined.h5", campaign.folder / "whole.h5");
  EXPECT_EQ(campaign.graze("score whole.h5").out, table);
}

TEST(Parts, AreFinishedByResumeAndKeptApartFromOthers) {
  const testing::BallCampaign campaign;
  ASSERT_EQ(campaign.graze("run ball.yaml -n 90 --part 2/3 --quiet -o part").code, 0);
  std::filesystem::remove_all(campaign.folder / "part" / "shards");
  std::filesystem::create_directory(campaign.folder / "part" / "shards");
  const testing::Result again = campaign.graze("resume part");
  EXPECT_THAT(again.err, HasSubstr("0 of 30 traces are there"));
  const TraceTable table = Archive(campaign.folder / "part").traces("still");
  ASSERT_EQ(table.size(), 30u);
  EXPECT_EQ(table.particle.front(), 30u);
  EXPECT_EQ(campaign.graze("resume part -n 100").code, 2);
  ASSERT_EQ(campaign.graze("run ball.yaml -n 90 --seed 5 --part 1/3 --quiet -o other").code, 0);
  const testing::Result mixed = campaign.graze("pack part other -o x.h5");
  EXPECT_EQ(mixed.code, 2);
  EXPECT_THAT(mixed.err, HasSubstr("their seeds"));
  EXPECT_THAT(campaign.graze("run ball.yaml --part 4/3").err, HasSubstr("nearest right answer: 1/3"));
  EXPECT_THAT(campaign.graze("run ball.yaml --part half").err, HasSubstr("nearest right answer: 1/2"));
}

}  // namespace
}  // namespace graze
