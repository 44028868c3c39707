// Batch scripts: what graze submit writes, what it refuses; and campaigns that are simulated in parts.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "archive/archive.h"
#include "jobs/slurm/batch_script.h"
#include "tests/archive/tables.h"
#include "tests/jobs/ball_campaign.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;
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
  const int count = GRAZE_SANITIZED ? 40000 : 100000;  // enough that it is stopped on the way
  const testing::Result script = campaign.graze(fmt::format("submit ball.yaml --time 10 -n {} --dry-run", count));
  testing::write_file(campaign.folder / "job", script.out);
  testing::write_file(campaign.folder / "scontrol", "#!/bin/sh\necho \"$@\" >>requeued\n");
  const std::string start = std::string("chmod +x scontrol; export PATH=\"$PWD:$PATH\" ") + kJob;
  const testing::Result stopped = testing::shell(
      campaign.folder.path(), start +
                                  "; bash job & job=$!; until ls ball.graze/shards/*.h5 >/dev/null 2>&1; do "
                                  "kill -0 $job || break; sleep 0.02; done; kill -USR1 $job; wait $job");
  EXPECT_EQ(stopped.code, 3) << stopped.err;
  EXPECT_EQ(testing::read_file(campaign.folder / "requeued"), "requeue 1\n");
  const testing::Result again = testing::shell(campaign.folder.path(), start + "; bash job");
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_THAT(again.err, Not(HasSubstr(fmt::format(" 0 of {}", count))));
  ASSERT_EQ(campaign.graze(fmt::format("run ball.yaml -n {} --quiet -o plain.graze", count)).code, 0);
  EXPECT_EQ(table_of(Archive(campaign.folder / "ball.graze"), "still").digest,
            table_of(Archive(campaign.folder / "plain.graze"), "still").digest);
}

/// The ball campaign beside a stand-in for sbatch, which notes its arguments in `queued` and numbers jobs from 1.
struct FakeSlurm : testing::BallCampaign {
  explicit FakeSlurm(const std::string& extra = "") : BallCampaign(extra) {
    sbatch("echo \"$@\" >>queued; wc -l <queued");
  }
  void sbatch(const std::string& script) const {
    testing::write_file(folder / "bin_sbatch", "#!/bin/sh\n" + script + "\n");
    testing::shell(folder.path(), "mkdir -p bin; mv bin_sbatch bin/sbatch; chmod +x bin/sbatch");
  }
  testing::Result submit(const std::string& arguments) const {
    return testing::shell(folder.path(),
                          "PATH=\"$PWD/bin:$PATH\" '" GRAZE_PROGRAM "' submit ball.yaml --time 10 " + arguments);
  }
  std::string queued() const { return testing::read_file(folder / "queued"); }
  /// Claim: it is refused, as a job and as a dry run, and nothing is written or queued.
  void refused(const std::string& arguments, const std::string& what, int code = 2) const {
    SCOPED_TRACE(arguments);
    const std::string before = queued();
    for (const char* dry : {"", " --dry-run"}) {
      const testing::Result result = submit(arguments + dry);
      EXPECT_EQ(result.code, code) << result.err;
      EXPECT_EQ(result.out, "");
      EXPECT_THAT(result.err, HasSubstr(what));
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "ball.sbatch"));
    EXPECT_EQ(queued(), before);
  }
};

TEST(Submit, MistakesAreToldBeforeAnythingIsQueued) {
  const FakeSlurm slurm;
  slurm.refused("--mem 4GB", "nearest right answer: 4G");
  slurm.refused("--polcy still", "--polcy");
  slurm.refused("--policy stil", "nearest: still");
  slurm.refused("--nodes 2 --array 4", "--array");
  slurm.refused("-o ball.h5", "nearest right answer: ball.graze");
  EXPECT_THAT(slurm.graze("submit ball.yml --time 10").err, HasSubstr("ball.yml"));
  EXPECT_THAT(slurm.graze("submit ball.yaml --time 2h").err, HasSubstr("nearest right answer: 0-02:00:00"));
  EXPECT_THAT(slurm.graze("submit ball.yaml").err, HasSubstr("--time is required"));
}

// Claim: whatever the job would refuse hours later is refused now, in the same words.
TEST(Submit, RefusesWhatTheJobWould) {
  const FakeSlurm slurm("sampling: {particles: 50}\n");
  for (const std::string words :
       {"--part 9/4", "--part half", "--confidence 5 --until 'p >= 0.9'", "--confidence 99%", "--until 'p => 0.9'",
        "--until 'nosuch: p >= 0.9'", "--until 'p >= 0.9' --set sampling.design=latin_hypercube",
        "--until 'p >= 0.9' --part 1/2", "--last '10 ms' --telemetry all", "--set time.end=-1"}) {
    const testing::Result run = slurm.graze("run ball.yaml " + words);
    ASSERT_EQ(run.code, 2) << words;
    slurm.refused(words, run.err);
  }
}

TEST(Submit, RefusesWhatAnArrayCannotDo) {
  const FakeSlurm slurm;
  slurm.refused("--array 4 --until 'p >= 0.9'", "leave out --array");
  slurm.refused("--array 4 --part 1/2", "leave out --part");
  slurm.refused("--array 200 -n 100", "there are only 100 particles");
  EXPECT_EQ(slurm.submit("--array 100 -n 100 --dry-run").code, 0);
}

// Claim: a campaign, a packed file or a folder that is in the way is told before anything is queued.
TEST(Submit, LeavesAloneWhatIsThere) {
  const FakeSlurm slurm;
  ASSERT_EQ(slurm.graze("run ball.yaml -n 8 --quiet -o exp.h5").code, 0);
  const std::string packed = testing::read_file(slurm.folder / "exp.h5");
  slurm.refused("-o exp.graze --array 2", "exp.h5: exists already");
  EXPECT_EQ(testing::read_file(slurm.folder / "exp.h5"), packed);
  EXPECT_EQ(slurm.submit("-o exp.graze --dry-run").code, 0) << "this one makes no exp.h5";
  for (const char* there : {"exp.graze", "my exp.graze", "exp.parts"}) {
    std::filesystem::create_directory(slurm.folder / there);
  }
  slurm.refused("-o exp.graze", "go on with it: graze resume exp.graze");
  slurm.refused("-o exp.graze/ --force", "exp.graze: exists already");
  slurm.refused("-o 'my exp.graze'", "graze resume 'my exp.graze'");
  slurm.refused("-o exp --array 2", "exp.parts: exists already");
  slurm.refused("-o ball.urdf/a.graze", "ball.urdf is no folder", 3);
}

// Claim: names that differ give scripts, logs and files that differ; only a trailing .graze is left out.
TEST(Submit, NamesFollowTheCampaigns) {
  const FakeSlurm slurm;
  for (const std::string name : {"exp.1", "exp.2"}) {
    EXPECT_EQ(slurm.submit("-o " + name).code, 0);
    EXPECT_THAT(testing::read_file(slurm.folder / (name + ".sbatch")),
                AllOf(HasSubstr("campaign=" + name + "\n"), HasSubstr("--output=" + name + ".%j.log\n"),
                      HasSubstr("--job-name=graze-" + name + "\n")));
  }
  EXPECT_EQ(slurm.submit("-o exp.3.graze --array 2").code, 0);
  EXPECT_EQ(slurm.queued(),
            "--parsable exp.1.sbatch\n--parsable exp.2.sbatch\n--parsable exp.3.sbatch\n"
            "--parsable --dependency=afterany:3 exp.3.join.sbatch\n");
}

// Claim: paths that are no plain words are quoted as sbatch reads them, or refused; their folders are made.
TEST(Submit, NamesNeedNotBePlain) {
  const FakeSlurm slurm;
  const testing::Result result = slurm.submit("--job-name 'a#b' -o \"runs/it's 50%.graze\"");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(
      testing::read_file(slurm.folder / "runs/it's 50%.sbatch"),
      AllOf(HasSubstr("#SBATCH --job-name=\"a#b\"\n"), HasSubstr("#SBATCH --output=\"runs/it's 50%%.%j.log\"\n")));
  EXPECT_THAT(result.out, HasSubstr("graze status 'runs/it'\\''s 50%.graze'"));
  EXPECT_THAT(slurm.submit("-o 'a \"b\"' --dry-run").out,
              AllOf(HasSubstr("--job-name=graze-a_b_\n"), HasSubstr("--output='a \"b\".%j.log'\n")));
  slurm.refused("-o \"a'\\\"b\"", "both kinds of quotes");
  slurm.refused("-o 'a\\b'", "backslash");
  slurm.refused("-o \"$(printf 'a\\nb')\"", "control characters");
  slurm.refused("--job-name 'a b'", "not one plain word");
  EXPECT_THAT(slurm.submit("-o other/a --dry-run").err, HasSubstr("other: is not there"));
}

// Claim: a script that was edited, or is another campaign's, is replaced only if that is asked for.
TEST(Submit, ReplacesAScriptOnlyIfTold) {
  const FakeSlurm slurm;
  const auto script = slurm.folder / "exp.sbatch";
  ASSERT_EQ(slurm.submit("-o exp.graze").code, 0);
  EXPECT_EQ(slurm.submit("-o exp.graze").code, 0) << "the same once more";
  testing::write_file(script, "#!/bin/sh\n# edited\n");
  const testing::Result refused = slurm.submit("-o exp.graze");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("exp.sbatch: exists already, and differs"), HasSubstr("(sbatch exp.sbatch)"),
                                 HasSubstr("--force")));
  EXPECT_EQ(testing::read_file(script), "#!/bin/sh\n# edited\n");
  const testing::Result dry = slurm.submit("-o exp.graze --dry-run");
  EXPECT_EQ(dry.code, 0);
  EXPECT_THAT(dry.err, HasSubstr("differs"));
  EXPECT_EQ(slurm.submit("-o exp.graze --force").code, 0);
  EXPECT_EQ(testing::read_file(script), dry.out);
}

// Claim: if Slurm refuses, nothing is left that would be in the way of the next attempt.
TEST(Submit, LeavesNoScriptThatSlurmRefuses) {
  const FakeSlurm slurm;
  slurm.sbatch("echo 'invalid partition' >&2; exit 1");
  const testing::Result refused = slurm.submit("--partition lnog");
  EXPECT_EQ(refused.code, 3);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("invalid partition"), HasSubstr("nothing is queued")));
  EXPECT_FALSE(std::filesystem::exists(slurm.folder / "ball.sbatch"));
  EXPECT_EQ(slurm.submit("-o runs/a.graze").code, 3);
  EXPECT_FALSE(std::filesystem::exists(slurm.folder / "runs"));
  slurm.sbatch("case \"$*\" in *join*) exit 1;; esac; echo 7");
  const testing::Result half = slurm.submit("--array 2");
  EXPECT_EQ(half.code, 3);
  EXPECT_THAT(half.err, HasSubstr("job 7 is queued all the same"));
  EXPECT_TRUE(std::filesystem::exists(slurm.folder / "ball.join.sbatch"));
}

// Claim: if there are no parts to join, the job says so by its exit code, and prints no table of an older file.
TEST(Submit, JoinStopsIfPackFails) {
  const FakeSlurm slurm;
  ASSERT_EQ(slurm.submit("--array 2 -o exp.graze -n 20").code, 0);
  ASSERT_EQ(slurm.graze("run ball.yaml -n 8 --quiet -o exp.h5").code, 0);
  const testing::Result failed = testing::shell(slurm.folder.path(), "bash exp.join.sbatch");
  EXPECT_EQ(failed.code, 2);
  EXPECT_EQ(failed.out, "");
  for (const std::string task : {"1", "2"}) {
    const std::string job = "SLURM_CPUS_PER_TASK=1 SLURM_ARRAY_TASK_ID=" + task + " bash exp.sbatch";
    EXPECT_EQ(testing::shell(slurm.folder.path(), job).code, 0);
  }
  EXPECT_EQ(testing::shell(slurm.folder.path(), "bash exp.join.sbatch").code, 0);
  EXPECT_EQ(table_of(Archive(slurm.folder / "exp.h5"), "still").size(), 20u);
}

// Claim: the scripts of an array are told apart in a dry run; a single one can be redirected into a file as it is.
TEST(Submit, DryRunNamesTheFiles) {
  const FakeSlurm slurm;
  EXPECT_THAT(slurm.submit("--array 2 -o 'my exp' --dry-run").out,
              AllOf(StartsWith("# ===== my exp.sbatch =====\n#!/bin/bash\n"),
                    HasSubstr("\n# ===== my exp.join.sbatch =====\n#!/bin/bash\n")));
  EXPECT_THAT(slurm.submit("--dry-run").out, StartsWith("#!/bin/bash\n"));
}

// Claim: ranks are refused by a program that has no MPI.
TEST(Submit, RefusesRanksWithoutMpi) {
  const FakeSlurm slurm;
  std::filesystem::copy(GRAZE_PROGRAM, slurm.folder / "bin/alone");
  const auto submit = [&](const std::string& options) {
    return testing::shell(slurm.folder.path(), "bin/alone submit ball.yaml --time 10 --dry-run " + options);
  };
  EXPECT_EQ(submit("").code, 0);
  const testing::Result refused = submit("--nodes 2 --ntasks-per-node 4");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("8 ranks: this graze was built without MPI"));
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
  const TraceTable a = table_of(joined, "still"), b = table_of(whole, "still");
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
  const TraceTable table = table_of(Archive(campaign.folder / "part"), "still");
  ASSERT_EQ(table.size(), 30u);
  EXPECT_EQ(table.particle.front(), 30u);
  EXPECT_EQ(campaign.graze("resume part -n 100").code, 2);
  ASSERT_EQ(campaign.graze("run ball.yaml -n 90 --seed 5 --part 1/3 --quiet -o other").code, 0);
  const testing::Result mixed = campaign.graze("pack part other -o x.h5");
  EXPECT_EQ(mixed.code, 2);
  EXPECT_THAT(mixed.err, HasSubstr("their seeds"));
  EXPECT_THAT(campaign.graze("run ball.yaml --part 4/3").err, HasSubstr("nearest right answer: 3/3"));
  EXPECT_THAT(campaign.graze("run ball.yaml --part half").err, HasSubstr("nearest right answer: 1/2"));
}

// Claim: parts that are given no directory do not take each other's place; one that is given another's is refused
// without the advice to force it, because that would lose the other; the same part again is told how it goes on.
TEST(Parts, HavePlacesOfTheirOwn) {
  const testing::BallCampaign campaign;
  for (const char* part : {"1/2", "2/2"}) {
    const testing::Result run = campaign.graze(std::string("run ball.yaml -n 9 --quiet --part ") + part);
    EXPECT_EQ(run.code, 0) << run.err;
  }
  EXPECT_EQ(campaign.graze("pack ball.1of2.graze ball.2of2.graze -o all.h5").code, 0);
  EXPECT_EQ(testing::digests(campaign.folder / "all.h5").at("still").size(), 9u);
  const testing::Result other = campaign.graze("run ball.yaml -n 9 --part 02/2 -o ball.1of2.graze");
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.err, AllOf(HasSubstr("holds another part of the same campaign, particles 0 to 4"),
                               HasSubstr("another --output for particles 5 to 8"), Not(HasSubstr("--force"))));
  const testing::Result same = campaign.graze("run ball.yaml -n 9 --part 02/2");
  EXPECT_EQ(same.code, 2);
  EXPECT_THAT(same.err, AllOf(HasSubstr("ball.2of2.graze: holds this part already"),
                              HasSubstr("'graze resume ball.2of2.graze'")));
  EXPECT_THAT(campaign.graze("run ball.yaml -n 9 --seed 7 --part 2/2").err, HasSubstr("or give --force"));
}

// Claim: the help says that there is a scenario.
TEST(Submit, HelpNamesTheScenario) {
  EXPECT_THAT(testing::BallCampaign().graze("submit --help").out, HasSubstr("graze submit [OPTIONS] SCENARIO"));
}

}  // namespace
}  // namespace graze
