// Claim: a supervised session makes what its answers say, keeps them, and is the same again from the file of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/jobs/swing_session.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using PlainJson = nlohmann::json;

struct SupervisedImprove : testing::SwingSession {
  /// Answers, one a line, as they would be typed.
  testing::Result ask(const std::string& answers, const std::string& options) const {
    testing::write_file(folder / "typed", answers);
    return testing::shell(folder.path(), "'" GRAZE_PROGRAM "' improve swing.yaml --ask <typed " + options);
  }
  PlainJson steps(const std::string& session) const {
    return PlainJson::parse(testing::read_file(folder / session / "improve.json"))["state"]["steps"];
  }
};

TEST_F(SupervisedImprove, MakesWhatItIsTold) {
  const testing::Result run = ask(
      "zero thick mot*\naccept\nback\nset rods 25 cm\naccept\nonly thick\nscale -1  # the other way\naccept\nauto\n",
      "-o told");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("Step 1 of task 1 of 3"), HasSubstr("predicted"),
                             HasSubstr("back after 0 steps"), HasSubstr("Every limit holds in every task")));
  const PlainJson made = steps("told");
  ASSERT_GE(made.size(), 2u);
  EXPECT_NEAR(made[0]["after"][0].get<double>(), 0.25, 1e-12);
  EXPECT_NE(made[0]["before"][1], made[0]["after"][1]) << "'back' has forgotten what was made zero";
  EXPECT_EQ(made[1]["before"][0], made[1]["after"][0]);
  EXPECT_NE(made[1]["before"][1], made[1]["after"][1]);
  EXPECT_EQ(testing::read_file(folder / "told/answers.txt"),
            "zero thick mot*\naccept\nback\nset rods 25 cm\naccept\nonly thick\nscale -1\naccept\nauto\n");
}

TEST_F(SupervisedImprove, IsRepeatedFromItsAnswers) {
  const std::string answers = "scale 0.5\naccept\nsame rods thick\naccept\nback 2\nzero thick\naccept\nauto\n";
  ASSERT_EQ(ask(answers, "-o told").code, 0);
  EXPECT_EQ(graze("improve swing.yaml --answers told/answers.txt -o again --threads 1").code, 0);
  EXPECT_EQ(testing::read_file(folder / "again/improve.json"), testing::read_file(folder / "told/improve.json"));
  // In parts, the first of which ends in the middle of a question.
  EXPECT_EQ(ask("scale 0.5\naccept\nzero rods\n", "-o parts").code, 4);
  EXPECT_EQ(ask("same rods thick\naccept\nback 2\nquit\n", "-o parts").code, 4);
  EXPECT_EQ(ask("zero thick\naccept\nauto\n", "-o parts").code, 0);
  EXPECT_EQ(testing::read_file(folder / "parts/improve.json"), testing::read_file(folder / "told/improve.json"));
  EXPECT_EQ(testing::read_file(folder / "parts/answers.txt"), answers);
}

// Steps that were made without questions are told as such, whoever made them and whenever it was ended.
TEST_F(SupervisedImprove, StepsWithoutQuestionsAreAnswersToo) {
  EXPECT_EQ(graze("improve swing.yaml --max-steps 1 -o mixed").code, 4);
  EXPECT_EQ(ask("scale 0.5\naccept\nauto 1\nquit\n", "-o mixed").code, 4);
  EXPECT_EQ(ask("auto\n", "-o mixed --max-steps 4").code, 4);
  EXPECT_EQ(testing::read_file(folder / "mixed/answers.txt"), "auto 1\nscale 0.5\naccept\nauto 1\nauto\n");
  EXPECT_EQ(ask("zero thick\naccept\nquit\n", "-o mixed").code, 4);
  EXPECT_EQ(graze("improve swing.yaml -o mixed").code, 0);
  EXPECT_EQ(testing::read_file(folder / "mixed/answers.txt"),
            "auto 1\nscale 0.5\naccept\nauto 1\nauto 1\nzero thick\naccept\nauto\n");
  EXPECT_EQ(graze("improve swing.yaml --answers mixed/answers.txt -o again").code, 0);
  EXPECT_EQ(testing::read_file(folder / "again/improve.json"), testing::read_file(folder / "mixed/improve.json"));
  // The same command goes on, wherever it was ended.
  const std::string command = "improve swing.yaml --answers mixed/answers.txt -o parts --max-steps ";
  for (const char* most : {"1", "2", "3", "4", "5"}) EXPECT_EQ(graze(command + most).code, 4) << most;
  EXPECT_EQ(graze(command + "100").code, 0);
  EXPECT_EQ(testing::read_file(folder / "parts/improve.json"), testing::read_file(folder / "mixed/improve.json"));
  EXPECT_THAT(
      ask("auto 0\nauto 1.5\nauto 1 2\n", "-o wrong").out,
      AllOf(HasSubstr("auto 0: must be a whole number from 1"), HasSubstr("'auto 1 2': is written 'auto [STEPS]'")));
}

TEST_F(SupervisedImprove, AsksAgainWhatItDoesNotUnderstand) {
  const testing::Result run = ask(
      "acept\nset rod 20 cm\nset rods 3 m\nset rods 2 kg\nset *o* 1\nzero\nback\nscale much\nscale 0\naccept\nhelp\n",
      "-o none");
  EXPECT_EQ(run.code, 4) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("'acept': no answer; nearest: accept"), HasSubstr("nearest: rods"),
                             HasSubstr("must lie from 0.1 to 0.6 m; nearest right answer: 0.6"), HasSubstr("kg"),
                             HasSubstr("this names several"), HasSubstr("'zero': is written 'zero VARIABLE…'"),
                             HasSubstr("back: no step was made yet")));
  EXPECT_THAT(run.out, AllOf(HasSubstr("much"), HasSubstr("the step changes nothing"),
                             HasSubstr("take back the last step, or so many")));
  EXPECT_THAT(run.out, Not(HasSubstr(":1:8"))) << "a place in no file";
  EXPECT_EQ(steps("none").size(), 0u);
}

TEST_F(SupervisedImprove, FileOfAnswersSaysWhereItIsWrong) {
  testing::write_file(folder / "a.txt", "# a session\n\naccept\nacept\n");
  const testing::Result run = graze("improve swing.yaml --answers a.txt -o s");
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.err, HasSubstr("a.txt:4: 'acept': no answer"));
  EXPECT_EQ(steps("s").size(), 1u) << "what was made is kept";
  testing::write_file(folder / "a.txt", "accept\nset rods 25 cm\naccept\nquit\n");
  EXPECT_EQ(graze("improve swing.yaml --answers a.txt -o s").code, 4) << "it goes on where it was";
  EXPECT_EQ(steps("s").size(), 2u);
  testing::write_file(folder / "a.txt", "scale 0.5\naccept\n");
  const testing::Result more = graze("improve swing.yaml --answers a.txt -o s");
  EXPECT_EQ(more.code, 2);
  EXPECT_THAT(more.err, AllOf(HasSubstr("a.txt:1: 'scale 0.5' is not what the session was told there, 'accept'"),
                              HasSubstr("--force")));
  EXPECT_THAT(graze("improve swing.yaml --answers b.txt -o t").err, HasSubstr("--answers b.txt: there is no such"));
  EXPECT_THAT(graze("improve swing.yaml --answers a.txt --auto -o t").err, Not(HasSubstr("internal")));
}

}  // namespace
}  // namespace graze
