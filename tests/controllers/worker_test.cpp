// Claim: what happens to the processes of controllers is told as what it is. Only what a controller does in a particle
// costs this particle; what the clock has decided, or who runs the campaign has done, leaves particles unfinished, and
// `resume` finishes them with the bits that they have in a campaign where all goes well.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>

#include "jobs/workers/record_bytes.h"
#include "jobs/workers/worker_channel.h"
#include "tests/controllers/swing.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Outcomes;
using testing::outcomes;
using testing::Result;
using testing::Swing;

/// A swing, and what comes of it where the controller does nothing odd.
struct Campaign : Swing {
  std::uint32_t tried = 8;  // particles of a campaign that goes wrong: few, since each costs time
  Outcomes well;
  Campaign() {
    odd("nothing");
    EXPECT_EQ(graze("run swing.yaml --trust --quiet -o well.graze").code, 0);
    well = outcomes(folder / "well.graze");
    EXPECT_EQ(well.digest.size(), 24u);
    EXPECT_GT(odd_ones(), 1u);
    EXPECT_LT(odd_ones(), tried);
  }
  std::size_t odd_ones() const { return std::distance(well.high.begin(), well.high.lower_bound(tried)); }
  Result run(const std::string& more) const {
    return graze("run swing.yaml --trust --quiet --force -o ill.graze -n " + std::to_string(tried) + " " + more);
  }
  /// All particles that did nothing odd have their bits, and no others have any.
  void expect_rest_well(const Outcomes& ill) const {
    EXPECT_EQ(ill.digest.size() + odd_ones(), tried);
    for (const auto& [id, digest] : ill.digest) EXPECT_EQ(digest, well.digest.at(id)) << id;
  }
  /// Finishes ill.graze with a controller that does nothing odd any more.
  void expect_resumes_well() const {
    setenv("ODD_TAME", "1", 1);
    const Result resumed = graze("resume ill.graze -n 24 --trust --quiet");
    unsetenv("ODD_TAME");
    EXPECT_EQ(resumed.code, 0) << resumed.err;
    const Outcomes ill = outcomes(folder / "ill.graze");
    EXPECT_EQ(ill.digest, well.digest);
    EXPECT_TRUE(ill.invalid.empty());
  }
};

/// The particle that begins highest, and its height, m.
std::pair<std::uint32_t, double> highest(const std::filesystem::path& path) {
  const Archive archive(path);
  std::size_t column = 0;
  while (archive.info().parameters.at(column).name != "initial.base.z") ++column;
  std::pair<std::uint32_t, double> out{0, -1};
  for (std::uint32_t id = 0; id < archive.info().particles; ++id) {
    const double height = archive.particle_values(id).at(column) + 0.2;
    if (height > out.second) out = {id, height};
  }
  return out;
}

TEST(Worker, TimeoutAndStoppedOrKilledProcessLeaveUnfinished) {
  Campaign swing;
  swing.tried = std::max(*swing.well.high.begin(), 1u) + 1;  // one odd particle, and others
  struct Case {
    const char *does, *more, *options, *reason;
  };
  for (const Case& one : {Case{"loop", ", timeout: 0.3 s", "", "act() at 0.01 s did not come back within 0.3 s"},
                          Case{"forge_part", ", timeout: 0.3 s", "", "act() at 0.01 s did not come back within 0.3 s"},
                          Case{"killed", "", "", "the controller was killed (SIGKILL), by somebody"},
                          Case{"freeze", ", timeout: 600 s", "--watchdog 0.5", "did not run for 2 s"}}) {
    swing.odd(one.does, one.more);
    const Result run = swing.run(std::string("--threads 2 ") + one.options);
    EXPECT_EQ(run.code, 3) << one.does << run.err;
    EXPECT_THAT(run.err, AllOf(HasSubstr(one.reason), HasSubstr("policy still, particle ")));
    const Outcomes ill = outcomes(swing.folder / "ill.graze");
    EXPECT_TRUE(ill.invalid.empty()) << one.does;
    swing.expect_rest_well(ill);
    swing.expect_resumes_well();
  }
}

// Whoever asks the program to end does not wait for ever, as a scheduler does not.
TEST(Worker, StoppedProcessDoesNotKeepTheProgramFromEnding) {
  const Swing swing;
  swing.write("file: odd.so, settings: {does: freeze, above: 0}, timeout: 600 s");
  const Result run =
      testing::shell(swing.folder.path(), fmt::format("timeout --preserve-status -s TERM -k 60 2 '{}' run swing.yaml "
                                                      "--trust --quiet -n 1 -o ill.graze",
                                                      GRAZE_PROGRAM));
  EXPECT_EQ(run.code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("process did not run for 5 s, as if it had been stopped"));
}

TEST(Worker, PromiseOfWhatIsUnfinishedIsNotKnown) {
  const Swing swing;
  swing.write("file: odd.so, settings: {does: loop, above: 0}, timeout: 0.3 s");
  const Result check = swing.graze("check swing.yaml --determinism --trust -n 1");
  EXPECT_EQ(check.code, 3) << check.err;
  EXPECT_THAT(check.out, HasSubstr("4 traces were left unfinished, so nobody knows"));  // once in each company
}

// A controller that hangs when it has had other robots before loses nothing, and is told of.
TEST(Worker, BlocksThatDoNotComeBackAreToldThoughTheirRobotsDo) {
  const Swing swing;
  swing.write("file: odd.so, settings: {does: tire}, timeout: 0.3 s");
  const Result run = swing.graze("run swing.yaml --trust --quiet --threads 1 -n 16 -o tired.graze");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("policy still: a block of robots beside each other failed"),
                             HasSubstr("did not come back within 0.3 s"), HasSubstr("too slow for its timeout")));
  EXPECT_EQ(outcomes(swing.folder / "tired.graze").digest.size(), 16u);
  const Result check = swing.graze("check swing.yaml --determinism --trust -n 16");
  EXPECT_EQ(check.code, 1);
  EXPECT_THAT(check.out, HasSubstr("did NOT COME BACK although its robots do"));
}

// The other values are simulated, and the table is printed.
TEST(Worker, SweepsGoOnBesideUnfinishedTraces) {
  Swing swing;
  swing.odd("loop", ", timeout: 0.3 s");
  const Result sweep = swing.graze("sweep swing.yaml --over contact.friction=0.5,0.7 -n 4 --trust --quiet -o a.sweep");
  EXPECT_EQ(sweep.code, 3);
  EXPECT_THAT(sweep.out, AllOf(HasSubstr("0.5"), HasSubstr("0.7")));
  EXPECT_THAT(sweep.err,
              AllOf(HasSubstr("sweep: 2 of 2 values lack traces that were left unfinished"),
                    HasSubstr("contact.friction=0.5: 4 particles"), HasSubstr("contact.friction=0.7: 4 particles")));
  setenv("ODD_TAME", "1", 1);
  const Result again = swing.graze("sweep a.sweep --trust --quiet");
  unsetenv("ODD_TAME");
  EXPECT_EQ(again.code, 0) << again.err;
}

// An adaptive end has to wait for every trace, and says so.
TEST(Worker, UntilTellsWhyItEndsAtAnUnfinishedTrace) {
  Swing swing;
  swing.odd("loop", ", timeout: 0.3 s");
  const Result run = swing.graze("run swing.yaml --trust --quiet -n 16 --until 'p >= 0.1' -o ill.graze");
  EXPECT_EQ(run.code, 3);
  EXPECT_THAT(run.err, HasSubstr("--until ends with the first of them"));
  EXPECT_THAT(swing.graze("status ill.graze").out, HasSubstr("Unfinished, because their controller did not come back"));
}

TEST(Worker, LibraryThatVanishesEndsTheCampaign) {
  const Campaign swing;
  swing.odd("vanish");
  setenv("ODD_TAME", "1", 1);
  ASSERT_EQ(swing.run("").code, 0);
  unsetenv("ODD_TAME");
  const Result run = swing.graze("resume ill.graze -n 24 --threads 1 --trust --quiet");
  EXPECT_EQ(run.code, 3) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("odd.so: the library is not there"), HasSubstr("graze resume")));
  swing.build("odd.so");
  swing.expect_resumes_well();
  swing.build("odd.so", "-DANOTHER -O0");
  EXPECT_EQ(swing.graze("resume ill.graze -n 30 --trust --quiet").code, 2);
}

// What was finished by then is kept, though no shard had been written.
TEST(Worker, LibraryThatIsReplacedEndsTheCampaignAndLosesNothing) {
  const Swing swing;
  swing.odd("nothing");
  ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet --seed 6 -n 64 -o well.graze").code, 0);
  const Outcomes well = outcomes(swing.folder / "well.graze");
  const auto [culprit, height] = highest(swing.folder / "well.graze");
  ASSERT_GE(culprit, 8u) << "the first block is well";
  for (const char* isolation : {"process", "none"}) {
    swing.write("file: odd.so, settings: {does: replace, above: " + std::to_string(height - 1e-6) +
                "}, isolation: " + isolation);
    const Result run = swing.graze("run swing.yaml --trust --quiet --threads 1 --seed 6 -n 64 --force -o ill.graze");
    EXPECT_EQ(run.code, 3) << isolation << run.err;
    EXPECT_THAT(run.err, AllOf(HasSubstr("odd.so: is another library than the one that was meant"),
                               HasSubstr("of 64 traces are kept, and 'graze resume ill.graze --trust' does the rest")));
    const Outcomes kept = outcomes(swing.folder / "ill.graze");
    EXPECT_GE(kept.digest.size(), 8u) << isolation;
    EXPECT_TRUE(kept.invalid.empty()) << isolation;
    swing.build("odd.so");
    setenv("ODD_TAME", "1", 1);
    EXPECT_EQ(swing.graze("resume ill.graze --trust --quiet").code, 0);
    unsetenv("ODD_TAME");
    EXPECT_EQ(outcomes(swing.folder / "ill.graze").digest, well.digest) << isolation;
  }
}

TEST(Worker, ExitInTheProgramItselfIsNoSuccess) {
  const Campaign swing;
  for (const auto& [does, call] : {std::pair{"exit_well", "exit(0)"}, std::pair{"exit", "exit(3)"}}) {
    swing.odd(does, ", isolation: none");
    const Result run = swing.run("--threads 2");
    EXPECT_EQ(run.code, 3) << does;
    EXPECT_THAT(run.err, HasSubstr(std::string("the controller odd.so called ") + call + " in act() at 0.01 s"));
    EXPECT_THAT(run.err, HasSubstr("graze resume"));
    swing.expect_resumes_well();
  }
}

// Nor is it one in a thread of its own, where no call is known to have done it; a crash there names who may have.
TEST(Worker, ExitInAnotherThreadIsNoSuccess) {
  const Campaign swing;
  for (const auto& [does, told] :
       {std::pair{"exit_thread", "exit(0) before the work was done"},
        std::pair{"exit_thread_ill", "exit(9) before the work was done"}, std::pair{"crash_thread", "SIGSEGV"}}) {
    if (GRAZE_SANITIZED && std::string(told) == "SIGSEGV") continue;  // the sanitizer is there first
    swing.odd(does, ", isolation: none");
    const Result run = swing.run("--threads 2");
    EXPECT_EQ(run.code, 3) << does;
    EXPECT_THAT(run.err, AllOf(HasSubstr(told), HasSubstr("into the program (odd.so)"), HasSubstr("graze resume")));
    swing.expect_resumes_well();
  }
}

// What a controller does at its end costs no trace that was simulated.
TEST(Worker, TracesAreSafeBeforeControllersInTheProgramEnd) {
  if (GRAZE_SANITIZED) GTEST_SKIP() << "the sanitizer is there first";
  const Campaign swing;
  for (const char* does : {"crash_destroy", "exit_destroy"}) {
    swing.odd(does, ", isolation: none");
    const Result run = swing.run("--threads 2");
    EXPECT_EQ(run.code, 3) << does;
    EXPECT_THAT(run.err, AllOf(HasSubstr("odd.so"), HasSubstr("destroy()"))) << does;
    const Outcomes ill = outcomes(swing.folder / "ill.graze");
    EXPECT_EQ(ill.digest.size(), swing.tried) << does;
    for (const auto& [id, digest] : ill.digest) EXPECT_EQ(digest, swing.well.digest.at(id)) << id;
    swing.expect_resumes_well();
  }
}

// A stack that has overflowed leaves no room for a handler: one of its own is needed.
TEST(Worker, CrashInTheProgramItselfIsTold) {
  if (GRAZE_SANITIZED) GTEST_SKIP() << "the sanitizer is there first";
  const Campaign swing;
  for (const char* does : {"overflow", "segfault"}) {
    swing.odd(does, ", isolation: none");
    const Result run = swing.run("--threads 2");
    EXPECT_EQ(run.code, 3) << does << run.err;
    EXPECT_THAT(run.err,
                HasSubstr("the controller odd.so crashed (SIGSEGV) in act() at 0.01 s, in the program itself"));
    EXPECT_THAT(run.err, AllOf(HasSubstr("isolation: none"), HasSubstr("graze resume")));
    swing.expect_resumes_well();
    swing.write(std::string("file: odd.so, settings: {does: ") + does + ", above: 0}, isolation: none");
    const Result predicted = swing.graze("predict swing.yaml --at 0 -n 16 --threads 2 --trust");  // other threads
    EXPECT_EQ(predicted.code, 3) << predicted.err;
    EXPECT_THAT(predicted.err, HasSubstr("the controller odd.so crashed (SIGSEGV) in act() at 0.01 s"));
  }
}

TEST(Worker, CopiesByForkGoOnWithNothing) {
  const Campaign swing;
  for (const char* isolation : {"process", "none"}) {
    swing.odd("fork_back", std::string(", isolation: ") + isolation);
    const Result run = swing.run("--threads 2");
    EXPECT_EQ(run.code, 0) << isolation << run.err;
    EXPECT_EQ(run.err, "");
    const auto digest = outcomes(swing.folder / "ill.graze").digest;
    EXPECT_EQ(digest.size(), swing.tried) << isolation;
    for (const auto& [id, bits] : digest) EXPECT_EQ(bits, swing.well.digest.at(id)) << isolation << id;
  }
}

TEST(Worker, ForgedAnswersCostTheirParticle) {
  const Campaign swing;
  for (const auto& [does, reason] : {std::pair{"forge_length", "wrote into the simulator's socket"},
                                     std::pair{"forge_words", "wrote into the simulator's socket"},
                                     std::pair{"shut", "closed its process's connection to the simulator"}}) {
    swing.odd(does);
    const Result run = swing.run("--threads 2");
    EXPECT_EQ(run.code, 0) << does << run.err;
    EXPECT_THAT(run.err, AllOf(HasSubstr("policy still, particle "), HasSubstr(reason), Not(HasSubstr("SIGKILL"))));
    const Outcomes ill = outcomes(swing.folder / "ill.graze");
    EXPECT_EQ(ill.invalid.size(), swing.odd_ones()) << does;
    EXPECT_THAT(run.out, HasSubstr("e.g. ")) << does;  // one reason stands for those of several traces
    for (const auto& [id, why] : ill.invalid) EXPECT_THAT(why, HasSubstr(reason)) << id;
    swing.expect_rest_well(ill);
  }
}

// Other threads of the process give signs of life then, and it never ends.
TEST(Worker, EndOfTheThreadThatSimulatesCostsItsParticle) {
  const Campaign swing;
  swing.odd("end_thread");
  const Result run = swing.run("--threads 2");
  EXPECT_EQ(run.code, 0) << run.err;
  const Outcomes ill = outcomes(swing.folder / "ill.graze");
  EXPECT_EQ(ill.invalid.size(), swing.odd_ones());
  for (const auto& [id, why] : ill.invalid) {
    EXPECT_THAT(why, HasSubstr("ended the thread that simulates in act() at 0.01 s")) << id;
  }
  swing.expect_rest_well(ill);
}

TEST(Worker, SharedPagesCannotBeCutOff) {
  const Campaign swing;
  swing.odd("truncate");
  const Result run = swing.run("--threads 2");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_TRUE(outcomes(swing.folder / "ill.graze").invalid.empty());
}

// Over the page by which the simulator sees where a controller is.
TEST(Worker, OverwrittenPagesCostTheirParticle) {
  const Campaign swing;
  swing.odd("scribble");
  const Result run = swing.run("--threads 2");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.err, Not(HasSubstr("array::at")));
  const Outcomes ill = outcomes(swing.folder / "ill.graze");
  EXPECT_EQ(ill.invalid.size(), swing.odd_ones());
  for (const auto& [id, why] : ill.invalid) {
    EXPECT_EQ(why, "the controller has overwritten what its process shares with the simulator") << id;
  }
  swing.expect_rest_well(ill);
}

TEST(Worker, FewDescriptorsAreTheMachinesMatter) {
  if (GRAZE_SANITIZED) GTEST_SKIP() << "a sanitizer takes descriptors of its own";
  const Swing swing;
  swing.odd("nothing");
  int failed = 0;
  for (const char* limit : {"8", "10", "12", "14", "16", "18", "20"}) {
    const std::string program = std::string("ulimit -n ") + limit + "; '" + GRAZE_PROGRAM + "' ";
    const Result run = testing::shell(swing.folder.path(),
                                      program + "run swing.yaml --trust --quiet --threads 4 --force -o few.graze");
    if (run.code == 0) {
      EXPECT_EQ(outcomes(swing.folder / "few.graze").digest.size(), 24u) << limit;
      continue;
    }
    ++failed;
    EXPECT_EQ(run.code, 3) << limit << run.err;
    EXPECT_THAT(run.err, AllOf(AnyOf(HasSubstr("no process can be started"), HasSubstr("Too many open files")),
                               Not(HasSubstr("is not a verb"))));
  }
  EXPECT_GT(failed, 0);
}

TEST(Worker, EndsInOrder) {
  const Swing swing;
  const auto trace = swing.folder / "destroyed";
  setenv("ODD_DESTROYED", trace.c_str(), 1);
  for (const char* does : {"nothing", "hang_destroy"}) {
    std::filesystem::remove(trace);
    swing.odd(does, ", timeout: 0.3 s");
    const Result run = swing.graze("run swing.yaml --trust --quiet -n 8 --threads 1 --force -o end.graze");
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_EQ(testing::read_file(trace), "destroyed\ndestroyed\n");  // before the campaign, and in it
    EXPECT_EQ(outcomes(swing.folder / "end.graze").digest.size(), 8u);
    const bool hangs = std::string(does) == "hang_destroy";
    EXPECT_EQ(run.err.find("destroy() did not end within 2 s and was killed") != std::string::npos, hangs) << run.err;
  }
  unsetenv("ODD_DESTROYED");
  swing.odd("exit_destroy");
  EXPECT_THAT(swing.graze("run swing.yaml --trust --quiet -n 8 --threads 1 -o exits.graze").err,
              HasSubstr("ended its process with exit code 0 in destroy()"));
}

TEST(Worker, SourcesTellWhyTracesAreInvalid) {
  const Swing swing;
  swing.odd("error", ", isolation: none");
  EXPECT_THAT(swing.graze("sources swing.yaml --trust -n 16").err,
              AllOf(HasSubstr("sources: some traces are invalid; one of them: policy still, particle "),
                    HasSubstr("returned error 7")));
}

// Pages have trusted controllers in the process that makes them: one that ends it, or never comes back, is no success
// and no damaged archive, and what else there is to tell is told.
TEST(Worker, ControllersThatEndAPageAreToldFromArchives) {
  if (GRAZE_SANITIZED) GTEST_SKIP() << "the sanitizer is there first";
  const Swing swing;
  for (const char* does : {"exit_destroy", "crash_destroy", "loop"}) {
    swing.write(fmt::format("file: odd.so, settings: {{does: {}, above: -1}}, timeout: 0.3 s", does));
    setenv("ODD_TAME", "1", 1);
    ASSERT_EQ(swing.graze("run swing.yaml --trust --quiet -n 2 --force -o a.graze").code, 0);
    unsetenv("ODD_TAME");
    const Result view = swing.graze("view a.graze --trust --particle 0 --force -o page.html");
    EXPECT_EQ(view.code, 3) << does << view.err;
    EXPECT_THAT(view.err, AllOf(HasSubstr("by a controller of the campaign's"), HasSubstr("made without such traces"),
                                HasSubstr("did not run for this page"), Not(HasSubstr("damaged"))));
    EXPECT_TRUE(std::filesystem::exists(swing.folder / "page.html"));
    const Result plot = swing.graze("plot a.graze lapse --trust --force -o page.svg");
    EXPECT_EQ(plot.code, 3) << does << plot.err;
    EXPECT_THAT(plot.err, HasSubstr("without it no such trace is simulated"));
    EXPECT_EQ(swing.graze("view a.graze --particle 0 --force -o page.html").code, 0);
  }
}

TEST(Worker, ControllersThatHangInTheProgramEndIt) {
  const Swing swing;
  swing.write("file: odd.so, settings: {does: loop, above: -1}, isolation: none, timeout: 0.3 s");
  for (const char* verb : {"steps swing.yaml -n 4", "predict swing.yaml --at 0.02s -n 4", "check swing.yaml --probe"}) {
    const Result run = swing.graze(std::string(verb) + " --trust");
    EXPECT_NE(run.code, 0) << verb;
    EXPECT_THAT(run.err, AllOf(HasSubstr("act() at 0.01 s"), HasSubstr("did not come back"))) << verb;
  }
}

/// What may be changed of the ball, which is to stay in the air.
constexpr const char* kLighterBall =
    "task: !replace {requirements: {high: {height: {link: ball, above: 0.19}}}}\n"
    "design: {variables: {mass: {of: robot.link.ball.mass, within: [0.5 kg, 2 kg]},\n"
    "  radius: {of: robot.link.ball.radius, within: [2 cm, 19 cm]}}}\n";

TEST(Worker, ImproveTellsOfTracesThatAreLost) {
  const Swing swing;
  swing.odd("error", ", isolation: none");
  testing::write_file(swing.folder / "better.yaml", std::string("include: swing.yaml\n") + kLighterBall);
  const Result run = swing.graze("improve better.yaml --trust -n 16 --verdict 16 --max-steps 1 -o better");
  EXPECT_THAT(run.out, AllOf(HasSubstr("before this step "), HasSubstr("after this step "),
                             HasSubstr("of 16 particles have no valid trace (particle "), HasSubstr("returned error 7"),
                             HasSubstr("is judged without what they lack")));
  EXPECT_EQ(swing.graze("report better --trust -o page.html").code, 0);
  const Result refused = swing.graze("report better --force -o page.html");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--trust"));
}

// A controller of a design is told of the robot of that design.
TEST(Worker, ImproveTellsControllersOfTheirRobots) {
  const Swing swing;
  swing.write("file: odd.so, settings: {does: weigh}, isolation: none");
  testing::write_file(swing.folder / "better.yaml", std::string("include: swing.yaml\n") + kLighterBall);
  const Result run = swing.graze("improve better.yaml --trust --max-steps 1 -o better");
  EXPECT_THAT(run.err, AllOf(HasSubstr("weighs <mass value=\"1\""), HasSubstr("weighs <mass value=\"1.0015\""),
                             HasSubstr("weighs <mass value=\"0.9985\"")));
}

TEST(Worker, CommandsWithoutProcessesSayWhere) {
  const Swing swing;
  swing.odd("nothing");
  for (const char* verb : {"sources swing.yaml", "steps swing.yaml", "check swing.yaml --probe"}) {
    const Result refused = swing.graze(std::string(verb) + " --trust");
    EXPECT_EQ(refused.code, 2) << verb;
    EXPECT_THAT(refused.err, AllOf(HasSubstr("swing.yaml:13:"), HasSubstr("isolation: none"))) << verb;
  }
}

TEST(Worker, TracesAreThoseThatWereAskedFor) {
  std::vector<TraceRecord> records(2);
  records[0].particle = 3, records[1].particle = 8;
  const std::string bytes = bytes_of(records);
  EXPECT_EQ(records_of(bytes, {3, 8}).size(), 2u);
  for (const std::vector<std::uint32_t>& others : {std::vector<std::uint32_t>{3}, {8, 3}, {3, 8, 9}, {}}) {
    EXPECT_THROW(records_of(bytes, others), std::runtime_error);
  }
  // A number of traces that cannot be costs no memory: 2^40 of them would.
  std::string forged = bytes;
  const std::uint64_t many = std::uint64_t{1} << 40;
  std::memcpy(forged.data(), &many, sizeof many);
  EXPECT_THROW(records_of(forged, {3, 8}), std::runtime_error);
  EXPECT_THROW(records_of(bytes.substr(0, bytes.size() - 1), {3, 8}), std::runtime_error);
}

TEST(Worker, InboxTakesAnswersAloneAndNeverWaits) {
  using State = WorkerInbox::State;
  std::array<int, 2> ends{};
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()), 0);
  WorkerInbox inbox;
  EXPECT_EQ(inbox.look(ends[0], 7), State::part);  // nothing is there
  ASSERT_TRUE(send_word(ends[1], {'t', "traces", 7}));
  ASSERT_EQ(inbox.look(ends[0], 7), State::whole);
  EXPECT_EQ(inbox.take().bytes, "traces");
  ASSERT_EQ(send(ends[1], "t", 1, 0), 1);
  EXPECT_EQ(inbox.look(ends[0], 7), State::part);
  std::array<std::uint64_t, 2> head = {7, std::uint64_t{1} << 32};  // no worker has so much to say
  ASSERT_EQ(send(ends[1], head.data(), sizeof head, 0), static_cast<ssize_t>(sizeof head));
  EXPECT_EQ(inbox.look(ends[0], 7), State::part);  // just as much as can be
  WorkerInbox second, third;
  head[1] += 1;
  ASSERT_EQ(send(ends[1], "t", 1, 0) + send(ends[1], head.data(), sizeof head, 0), 17);
  EXPECT_EQ(second.look(ends[0], 7), State::garbled);
  ASSERT_TRUE(send_word(ends[1], {'t', "", 6}));  // an answer to what was asked before
  EXPECT_EQ(third.look(ends[0], 7), State::garbled);
  close(ends[0]), close(ends[1]);
}

}  // namespace
}  // namespace graze
