// Claim: whatever the HDF5 library does with a file that has a fitting seal, it does it in a child process, which ends,
// and the user gets a message that names the file.
#include "archive/hdf5/reading_child.h"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "tests/archive/forge.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

/// Children end after so many seconds of processor time, and so does this process.
void allow_seconds(rlim_t seconds) {
  rlimit limit{};
  getrlimit(RLIMIT_CPU, &limit);
  limit.rlim_cur = seconds;
  setrlimit(RLIMIT_CPU, &limit);
}

TEST(ReadingChild, TellsWhichFileKillsOrIsRefused) {
  const std::vector<fs::path> files = {"good", "crash", "refused", "also good", "large"};
  const auto bad = unreadable(files, [](const fs::path& file) {
    if (file == "crash") {
      std::signal(SIGSEGV, SIG_DFL);  // sanitizers have a handler
      std::raise(SIGSEGV);
    }
    if (file == "refused") throw InputError("refused: is refused");
    if (file == "large") throw std::bad_alloc();
  });
  ASSERT_EQ(bad.size(), 3u);
  EXPECT_EQ(bad[0].file, 1u);
  EXPECT_THAT(bad[0].why, HasSubstr("crash: the HDF5 library crashed on it (SIGSEGV)"));
  EXPECT_EQ(bad[1].file, 2u);
  EXPECT_EQ(bad[1].why, "refused: is refused");
  EXPECT_EQ(bad[2].file, 4u);
  EXPECT_THAT(bad[2].why, HasSubstr("large: reading it takes more memory"));
}

TEST(ReadingChild, HasNoMoreMemoryThanAnArchiveNeeds) {
#if GRAZE_SANITIZED
  GTEST_SKIP() << "no limit on memory under a sanitizer";
#else
  const auto take = [](std::size_t bytes) {
    return unreadable(std::vector<fs::path>{"file"}, [=](const fs::path&) { std::string(bytes, 'x'); });
  };
  EXPECT_TRUE(take(std::size_t{1} << 20).empty());
  const auto bad = take(std::size_t{2} << 30);
  ASSERT_EQ(bad.size(), 1u);
  EXPECT_THAT(bad[0].why, HasSubstr("file: reading it takes more memory than an archive of its size may"));
#endif
}

TEST(ReadingChildDeathTest, IsEndedWhenItHangs) {
  EXPECT_EXIT(
      {
        allow_seconds(1);
        const auto bad = unreadable(std::vector<fs::path>{"file"}, [](const fs::path&) {
          for (volatile int forever = 1; forever != 0;) continue;
        });
        std::fputs(bad.at(0).why.c_str(), stderr);
        std::_Exit(0);
      },
      ::testing::ExitedWithCode(0), "file: reading it took more than .* s of processor time");
}

TEST(ReadingChild, DiesWithItsParent) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t parent = fork();
  if (parent == 0) {
    close(ends[0]);
    if (!go_on_in_child({std::uint64_t{1} << 30, 60})) {
      const char ready = 'r';
      if (::write(ends[1], &ready, 1) == 1) pause();
    }
    _exit(0);
  }
  close(ends[1]);
  char text = 0;
  ASSERT_EQ(::read(ends[0], &text, 1), 1);
  kill(parent, SIGKILL);
  EXPECT_EQ(::read(ends[0], &text, 1), 0) << "nobody has the other end any more";
  waitpid(parent, nullptr, 0);
  close(ends[0]);
}

// A child that is stopped may be woken, or ended, by others before it is given up: how it ended is told all the same.
TEST(ReadingChild, StoppedOnesMayGoOnOrBeEnded) {
  const auto stopped_until = [](int signal) {
    const std::optional<ReaderEnd> end = go_on_in_child({std::uint64_t{1} << 30, 60});
    if (!end) {
      const pid_t child = getpid();
      if (fork() == 0) {
        usleep(300'000);
        kill(child, signal);
        _exit(0);
      }
      raise(SIGSTOP);
      _exit(7);
    }
    return end->status;
  };
  const int woken = stopped_until(SIGCONT), ended = stopped_until(SIGKILL);
  EXPECT_TRUE(WIFEXITED(woken));
  EXPECT_EQ(WEXITSTATUS(woken), 7);
  EXPECT_TRUE(WIFSIGNALED(ended));
  EXPECT_EQ(WTERMSIG(ended), SIGKILL);
}

// Claim: whatever ends the child, the file gets a reason.
TEST(ReadingChildDeathTest, AnExitWithoutAWordHasAReason) {
  EXPECT_EXIT(
      {
        const auto bad = unreadable(std::vector<fs::path>{"file"}, [](const fs::path&) { std::_Exit(7); });
        std::fputs(bad.at(0).why.c_str(), stderr);
        std::_Exit(0);
      },
      ::testing::ExitedWithCode(0), "file: the process that read it ended with code 7");
}

// Bytes changed at random behind a fitting seal: HDF5 itself survives only some of that.
TEST(ReadingChildDeathTest, ChangedBytesEndInAMessage) {
  const int rounds = std::getenv("GRAZE_LONG") != nullptr ? 20'000 : GRAZE_SANITIZED != 0 ? 20 : 60;
  const Folder folder;
  const fs::path source = packed(folder), changed = folder / "changed.h5";
  const std::string whole = content(source).substr(0, fs::file_size(source) - 24);
  EXPECT_EXIT(
      {
        allow_seconds(60);
        int refused = 0;
        int nameless = 0;
        for (int i = 0; i < rounds; ++i) {
          std::string bytes = whole;
          for (int k = 0; k < 4; ++k) {
            const auto at = static_cast<std::size_t>(uniform(11, i, 2 * k, 0) * static_cast<double>(bytes.size()));
            bytes[at] = static_cast<char>(static_cast<unsigned char>(256 * uniform(11, i, 2 * k + 1, 0)));
          }
          put(changed, bytes);
          reseal(changed, false);
          for (const Unreadable& bad : unreadable(std::vector<fs::path>{changed}, read_all)) {
            ++refused;
            if (bad.why.rfind(changed.string(), 0) == 0) continue;
            ++nameless;
            std::fprintf(stderr, "NAMELESS: %s\n", bad.why.c_str());
          }
        }
        std::fprintf(stderr, "refused %d\n", refused);
        std::_Exit(refused > 0 && nameless == 0 ? 0 : 1);
      },
      ::testing::ExitedWithCode(0), "refused [0-9]+\n$");  // before it: what sanitizers say of crashes in HDF5
}

}  // namespace
}  // namespace graze
