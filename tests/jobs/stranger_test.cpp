// Claim: what strangers have written (archives with a fitting seal, names) neither crashes a verb nor floods it, and
// does nothing to the terminal that it is printed on.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "archive/files/files.h"
#include "archive/files/seal.h"
#include "archive/files/utf8.h"
#include "archive/hdf5/reading_child.h"
#include "jobs/cli/reading_verb.h"
#include "sampling/stream.h"
#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::ExitedWithCode;
using ::testing::HasSubstr;
using ::testing::KilledBySignal;

/// The exit code of a verb, and its message on stderr, as main() has them.
int as_main(const std::function<int()>& act) {
  try {
    return in_reading_child({"archive.h5"}, act);
  } catch (const InputError& error) {
    std::fputs(error.what(), stderr);
    return 2;
  } catch (const MachineError& error) {
    std::fputs(error.what(), stderr);
    return 3;
  }
}

int die_of(int signal) {
  std::signal(signal, SIG_DFL);  // sanitizers have handlers
  return std::raise(signal);
}

TEST(ReadingVerbDeathTest, GivesTheExitCodeOfItsChildOrSaysWhatKilledIt) {
  EXPECT_EXIT(std::_Exit(as_main([] { return 4; })), ExitedWithCode(4), "");
  EXPECT_EXIT(std::_Exit(as_main([] {
                const ReadingNote inside("shards/000007.h5");
                return die_of(SIGSEGV);
              })),
              ExitedWithCode(2), "shards/000007.h5: the HDF5 library crashed on it \\(SIGSEGV\\)");
  EXPECT_EXIT(std::_Exit(as_main([] { return die_of(SIGABRT); })), ExitedWithCode(3), "internal error");
  EXPECT_EXIT(std::_Exit(as_main([]() -> int { throw std::bad_alloc(); })), ExitedWithCode(2), "takes more memory");
}

// Ctrl-C, a closed pipe: whoever started the program sees what it has always seen.
TEST(ReadingVerbDeathTest, EndsByTheSignalThatEndedItsChild) {
  for (const int signal : {SIGINT, SIGTERM, SIGPIPE}) {
    EXPECT_EXIT(std::_Exit(as_main([=] { return die_of(signal); })), KilledBySignal(signal), "");
  }
}

class StrangeArchive : public ::testing::Test, public testing::BallCampaign {
 protected:
  /// A file of an archive with some bytes changed, and sealed again.
  void change(const std::string& name, const std::string& bytes, int round) const {
    std::string changed = bytes.substr(0, bytes.size() - 24);
    for (int k = 0; k < 4; ++k) {
      const auto at = static_cast<std::size_t>(uniform(3, round, 2 * k, 0) * static_cast<double>(changed.size()));
      changed[at] = static_cast<char>(static_cast<unsigned char>(256 * uniform(3, round, 2 * k + 1, 0)));
    }
    testing::write_file(folder / name, changed);
    const Descriptor file(open((folder / name).c_str(), O_RDWR | O_CLOEXEC));
    ASSERT_EQ(seal_file(file.number()), 0);
  }
};

/// Whether the HDF5 library crashed on a file and a sanitizer told it before the verb could. Only a fault whose
/// innermost frame, but for the sanitizer's own, is the library's: one of ours stays a failure. Both lie in the
/// program, as ours do, but have no source line; the sanitizer's functions have the names that the linker gives them.
bool sanitizer_saw_hdf5_crash(const std::string& err) {
  if (err.find("ERROR: AddressSanitizer") == std::string::npos) return false;
  for (std::size_t frame = err.find("    #"); frame != std::string::npos; frame = err.find("    #", frame + 1)) {
    const std::string line = err.substr(frame, err.find('\n', frame) - frame);
    if (line.find(" in H5") != std::string::npos || line.find("/libhdf5") != std::string::npos) return true;
    if (line.find("/graze+0x") == std::string::npos) return false;
  }
  return false;
}

TEST(SanitizerSawHdf5Crash, WhereTheInnermostFrameIsTheLibrarys) {
  const std::string head = "==29611==ERROR: AddressSanitizer: memcpy-param-overlap\n";
  const std::string sanitizer = "    #0 0xe70bf5 in memcpy (/b/graze+0xe70bf5) (BuildId: d1f3)\n";
  const std::string library = "    #1 0x7f2d in H5HG_read (/b/graze+0x167b8d) (BuildId: e923)\n";
  const std::string shared = "    #1 0x7f2d  (/lib/libhdf5_serial.so.103+0x167b8d) (BuildId: e923)\n";
  const std::string ours = "    #1 0x2b8c0e2 in graze::hdf5::read_strings(long) /b/archive/hdf5/hdf5.cpp:293:23\n";
  EXPECT_TRUE(sanitizer_saw_hdf5_crash(head + sanitizer + library + ours));
  EXPECT_TRUE(sanitizer_saw_hdf5_crash(head + sanitizer + shared + ours));
  EXPECT_TRUE(sanitizer_saw_hdf5_crash(head + library + ours));
  EXPECT_FALSE(sanitizer_saw_hdf5_crash(head + sanitizer + ours + library));
  EXPECT_FALSE(sanitizer_saw_hdf5_crash(head + ours + library));
  EXPECT_FALSE(sanitizer_saw_hdf5_crash(sanitizer + library)) << "no sanitizer spoke";
}

TEST_F(StrangeArchive, EveryVerbEndsWithAMessage) {
  ASSERT_EQ(graze("run ball.yaml -n 20 --quiet -o good.h5").code, 0);
  const std::string bytes = testing::read_file(folder / "good.h5");
  const int rounds = std::getenv("GRAZE_LONG") != nullptr ? 3000 : 18;
  const std::string verbs[] = {"score ",
                               "status ",
                               "replay --particle 3 ",
                               "score --failures --json ",
                               "report --json ",
                               "view --particle 3 --force "};
  int refused = 0;
  for (int round = 0; round < rounds; ++round) {
    change("changed.h5", bytes, round);
    const testing::Result run = graze(verbs[round % std::size(verbs)] + "changed.h5");
    EXPECT_LT(run.code, 5) << "round " << round << ": " << run.err;
    if (run.code == 0) continue;
    ++refused;
    if (sanitizer_saw_hdf5_crash(run.err)) continue;
    EXPECT_THAT(run.err, AllOf(HasSubstr("graze: "), HasSubstr("changed.h5"))) << "round " << round;
  }
  EXPECT_GT(refused, 0);
}

TEST_F(StrangeArchive, ResumePutsAsideWhatCannotBeRead) {
  ASSERT_EQ(graze("run ball.yaml -n 20 --quiet -o good.graze").code, 0);
  const std::string bytes = testing::read_file(folder / "good.graze/shards/000001.h5");
  int damaged = 0;
  for (int round = 0; round < 5; ++round) {
    SCOPED_TRACE(round);
    std::filesystem::remove_all(folder / "a.graze");
    std::filesystem::copy(folder / "good.graze", folder / "a.graze", std::filesystem::copy_options::recursive);
    change("a.graze/shards/000001.h5", bytes, round);
    const testing::Result resumed = graze("resume a.graze --quiet");
    EXPECT_EQ(resumed.code, 0) << resumed.err;
    EXPECT_EQ(graze("score a.graze").code, 0) << "whatever was kept can be read";
    damaged += std::filesystem::exists(folder / "a.graze/damaged/000001.h5");
  }
  EXPECT_GT(damaged, 0);
}

TEST(Printable, EscapesWhatActsOnATerminalAndNothingElse) {
  EXPECT_EQ(printable("step/1 cm: α"), "step/1 cm: α");
  EXPECT_EQ(printable("\x1b[31mred\x07\x7f"), "\\u001b[31mred\\u0007\\u007f");
  EXPECT_EQ(printable("\xC2\x9B"
                      "2J"),
            "\\u009b2J")
      << "the C1 control that begins a sequence";
  EXPECT_EQ(printable("\x9B"
                      "2J"),
            "\\x9b2J")
      << "the same as a byte that is no UTF-8";
  EXPECT_EQ(printable("a\xE2\x80\xAE"
                      "b\xE2\x81\xA6"
                      "c"),
            "a\\u202eb\\u2066c")
      << "direction of writing";
  EXPECT_EQ(printable("two\nlines\t"), "two\\u000alines\\u0009");
  EXPECT_EQ(printable_lines("two\nlines\r\t"), "two\nlines\\u000d\t");
  EXPECT_EQ(printable_message("no\ngraze: all is well\n  a list"), "no\n  graze: all is well\n  a list");
  EXPECT_EQ(printable(std::string_view("a\0b", 3)), "a\\u0000b");
}

TEST_F(StrangeArchive, NamesReachTheTerminalEscaped) {
  const std::string name = "Ba\x1b[2Jll\xE2\x80\xAE\xC2\x9B", shown = "\\u001b[2Jll\\u202e\\u009b";
  std::string scenario = testing::ball_scenario();
  scenario.replace(scenario.find("name: Ball"), 10, "name: \"Ba\\e[2Jll\\u202e\\u009b\"");
  scenario.replace(scenario.find("    high:"), 9, "    \"hi\\e[7mgh\":");
  scenario.replace(scenario.find("above: 0.05"), 11, "above: 0.17");
  testing::write_file(folder / "ball.yaml", scenario);
  const auto clean = [](const std::string& text) {
    return text.find('\x1b') == std::string::npos && text.find("\xE2\x80\xAE") == std::string::npos &&
           text.find("\xC2\x9B") == std::string::npos;
  };
  // What each shows of it: the campaign's name, a requirement's, or (a message) the value that is refused.
  const std::pair<const char*, std::string> verbs[] = {
      {"check ball.yaml", shown},
      {"run ball.yaml -n 20 --quiet -o a.graze", shown},
      {"score a.graze", "hi\\u001b[7mgh"},
      {"score a.graze --failures", "hi\\u001b[7mgh"},
      {"status a.graze", "hi\\u001b[7mgh"},
      {"replay a.graze --particle 0", shown},
      {"replay a.graze --particle 0 --json", shown},
      {"score a.graze --json", shown},
      {"report a.graze --json", shown},
      {"score a.graze --policy $'\\e[1m'", "\\u001b[1m"},
      {"check ball.yaml --set name=$'[\\e[1m'", "\\u001b[1m"},
  };
  for (const auto& [verb, part] : verbs) {
    SCOPED_TRACE(verb);
    const testing::Result run =
        testing::shell(folder.path(), std::string("exec bash -c \"'") + GRAZE_PROGRAM + "' " + verb + "\"");
    EXPECT_TRUE(clean(run.out)) << run.out;
    EXPECT_TRUE(clean(run.err)) << run.err;
    EXPECT_THAT(run.out + run.err, HasSubstr(part));
  }
  EXPECT_EQ(nlohmann::json::parse(graze("score a.graze --json").out)["campaign"], name) << "JSON says the same";
}

}  // namespace
}  // namespace graze
