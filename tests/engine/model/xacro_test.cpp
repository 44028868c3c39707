// Claim: a file that needs xacro is expanded by the program of that name on PATH, whatever that does; without it, the
// command is shown.

#include "engine/model/xacro.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <chrono>

#include "engine/model/limits.h"
#include "engine/settings/inputs.h"
#include "tests/engine/model/support.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kNeeds =
    "<robot name=\"r\" xmlns:xacro=\"http://ros.org/wiki/xacro\">\n<xacro:ball name=\"a\"/>\n</robot>";
const std::string kExpanded =
    "<robot name=\"r\"><link name=\"a\"><inertial><mass value=\"2\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" "
    "iyz=\"0\" izz=\"1\"/></inertial></link></robot>";

/// A folder that alone is PATH, with the shell's own tools by their full names.
class Xacro : public ::testing::Test {
 protected:
  Xacro() : path_(getenv("PATH") ? getenv("PATH") : "") {
    std::filesystem::create_directory(folder_.path() / "bin");
    setenv("PATH", (folder_.path() / "bin").c_str(), 1);
  }
  ~Xacro() override { setenv("PATH", path_.c_str(), 1); }

  /// Puts a program `xacro` there that is this shell script.
  void stand_in(const std::string& script) const {
    const std::string file = folder_.write("bin/xacro", "#!/bin/sh\n" + script + "\n");
    chmod(file.c_str(), 0700);
  }

  const TemporaryFolder folder_;
  const std::string path_;
};

TEST_F(Xacro, ExpandsWhatNeedsIt) {
  const std::string file = folder_.write("it's $(a) robot.urdf.xacro", kNeeds);
  EXPECT_THAT(input_error([&] { load_urdf(file); }),
              AllOf(HasSubstr(file + ":2: <xacro:ball>: this is a xacro file; expand it first: xacro "),
                    HasSubstr("robot.urdf")));
  const std::string seen = (folder_.path() / "seen").string();
  stand_in("echo \"$#:$1\" >>" + seen + "\necho '" + kExpanded + "'");
  InputFiles kept;
  {
    const InputRecord record;
    EXPECT_EQ(load_urdf(file).link("a").inertia.mass, 2);
    kept = record.files();
  }
  EXPECT_EQ(load_urdf(file).link("a").inertia.mass, 2);
  std::ifstream in(seen);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), "1:" + file + "\n") << "one argument, and run once";
  // A replay takes what was printed then.
  stand_in("exit 1");
  const InputReplay replay(kept, input_folder());
  EXPECT_EQ(load_urdf(file).link("a").inertia.mass, 2);
}

// Only what uses xacro: files that were expanded keep its name space, and expressions may stand in comments and texts.
TEST_F(Xacro, IsNotAskedOfOthers) {
  stand_in("exit 1");
  std::string plain = kExpanded;
  plain.replace(plain.find("<link"), 5,
                "<!-- <xacro:x a=\"${b}\"/> --><gazebo><p a=\"$(find x)\">${c}</p></gazebo><link");
  plain.replace(plain.find("<robot"), 6, "<robot xmlns:xacro=\"http://ros.org/wiki/xacro\"");
  EXPECT_EQ(load_urdf(folder_.write("plain.xacro", plain)).links.size(), 1u);
  std::string uses = kExpanded;
  uses.replace(uses.find("value=\"2\""), 9, "value=\"${m}\"");
  EXPECT_THAT(input_error([&] { load_urdf(folder_.write("uses.urdf", uses)); }), HasSubstr("ended with exit code 1"));
  std::string inside = kExpanded;
  inside.replace(inside.find("</link>"), 7, "<xacro:if value=\"1\"/></link>");
  EXPECT_THAT(input_error([&] { parse_urdf(inside, "r.urdf"); }), HasSubstr("<xacro:if>: this is a xacro file"));
}

TEST_F(Xacro, ThatFailsIsQuoted) {
  const std::string file = folder_.write("r.xacro", kNeeds);
  stand_in("echo 'error: No such file: base.xacro' >&2\necho 'when processing file: r.xacro' >&2\nexit 2");
  EXPECT_EQ(input_error([&] { load_urdf(file); }),
            file +
                ": xacro ended with exit code 2; it said:\n  error: No such file: base.xacro\n  when processing file: "
                "r.xacro");
  stand_in("exit 3");
  EXPECT_EQ(input_error([&] { load_urdf(file); }),
            file + ": xacro ended with exit code 3; it wrote nothing to standard error");
  stand_in("kill -9 $$");
  EXPECT_THAT(input_error([&] { load_urdf(file); }), HasSubstr("xacro was ended by a signal: Killed"));
  stand_in(
      "while :; do echo 'an endless complaint, an endless complaint' >&2 || exit 1; done & sleep=$!\n"
      "i=0; while [ $i -lt 20000 ]; do i=$((i+1)); done; kill $sleep; exit 1");
  EXPECT_LT(input_error([&] { load_urdf(file); }).size(), 5000u);
}

TEST_F(Xacro, ThatPrintsNonsenseIsTold) {
  const std::string file = folder_.write("r.xacro", kNeeds);
  stand_in("echo garbage");
  EXPECT_THAT(input_error([&] { load_urdf(file); }), HasSubstr(file + " (expanded by xacro):1: not XML"));
  const std::string empty = folder_.write("empty.xacro", kNeeds);
  stand_in(":");
  EXPECT_EQ(input_error([&] { load_urdf(empty); }), empty + ": xacro printed nothing");
  stand_in("echo; echo ' '");
  EXPECT_EQ(input_error([&] { load_urdf(empty); }), empty + ": xacro printed nothing");
  EXPECT_THAT(input_error([&] { parse_urdf(" \n", "r.urdf"); }), HasSubstr("r.urdf:1: not XML"));
  const std::string still = folder_.write("still.xacro", kNeeds);
  stand_in("echo '" + kNeeds + "'");
  EXPECT_THAT(input_error([&] { load_urdf(still); }), AllOf(HasSubstr("(expanded by xacro):2: <xacro:ball>"),
                                                            HasSubstr("printed it so"), Not(HasSubstr(" > "))));
}

// What hangs, with a child of its own, and what prints without end, are ended; neither their time nor their output
// grows.
TEST_F(Xacro, HasBounds) {
  const std::string file = folder_.write("r.xacro", kNeeds);
  const auto begin = std::chrono::steady_clock::now();
  const ProgramLimits limits{0.3, 10'000};
  stand_in("/bin/sleep 100 & wait");
  EXPECT_EQ(input_error([&] { expanded_by_xacro(file, kNeeds, limits); }),
            file + ": xacro did not end within 0.3 s; it wrote nothing to standard error");
  stand_in("exec >&- 2>&-\nexec /bin/sleep 100");
  EXPECT_THAT(input_error([&] { expanded_by_xacro(file, kNeeds, limits); }), HasSubstr("did not end within 0.3 s"));
  stand_in("while :; do echo aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa; done");
  EXPECT_THAT(input_error([&] {
                expanded_by_xacro(file, kNeeds, {30, 10'000});
              }),
              HasSubstr("xacro printed more than 10000 bytes"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
  // It has nothing to wait for on its standard input.
  stand_in("read line; echo \"<$line>\"");
  EXPECT_EQ(expanded_by_xacro(file, kNeeds + " ", {30, 10'000}), "<>\n");
}

TEST_F(Xacro, ThatCannotBeStarted) {
  const std::string file = folder_.write("r.xacro", kNeeds);
  chmod(folder_.write("bin/xacro", "not a program").c_str(), 0600);
  EXPECT_THAT(input_error([&] { load_urdf(file); }), HasSubstr("xacro cannot be started: Permission denied"));
}

}  // namespace
}  // namespace graze
