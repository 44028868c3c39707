// Runs verbs in forked processes.
#include <execinfo.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <new>
#include <sstream>
#include <thread>

#include "tests/faults/board.h"

/// What is lost on the way out of a fault is not looked for: it would take longer than the trial.
extern "C" const char* __asan_default_options() { return "detect_leaks=0"; }

int graze_main(int argc, char** argv);  // the program's main, under another name

namespace graze::faults {

Board* board = nullptr;

namespace {

constexpr unsigned kMostSeconds = 60;

/// Head of a change in the record; its texts and data stand behind it.
struct Head {
  Change::Kind kind;
  std::uint32_t path, to;
  std::uint64_t inode, offset, data;
};

/// Forked processes inherit it.
Board* shared_board() {
  static Board* const made = [] {
    void* const memory = mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    std::array<void*, 2> frames{};
    backtrace(frames.data(), 2);  // loads what it needs
    return static_cast<Board*>(memory);
  }();
  return made;
}

void prepare(const std::filesystem::path& folder, const Plan& plan) {
  Board& b = *shared_board();
  b.what = plan.what;
  b.at = plan.at;
  b.for_good = plan.for_good;
  b.error = plan.error;
  b.allocation = plan.allocation;
  b.thread = plan.thread;
  b.note_paths = plan.paths;
  b.show = std::getenv("GRAZE_SHOW_FAULTS") != nullptr;
  b.calls = 0;
  b.allocations = 0;
  b.threads = 0;
  b.failed = false;
  b.lost = false;
  b.failed_call[0] = b.failed_path[0] = 0;
  b.recorded = 0;
  b.recording.clear();
  const std::string under = std::filesystem::canonical(folder).string();
  std::snprintf(b.under, sizeof b.under, "%s", under.c_str());
  b.under_length = std::strlen(b.under);
}

/// A file without a name for what the verb prints.
int scratch() { return memfd_create("output", MFD_CLOEXEC); }

std::string content(int descriptor) {
  std::string text(static_cast<std::size_t>(lseek(descriptor, 0, SEEK_END)), '\0');
  if (pread(descriptor, text.data(), text.size(), 0) < 0) text.clear();
  close(descriptor);
  return text;
}

[[noreturn]] void child(const std::filesystem::path& folder, std::vector<std::string> words, int out, int err) {
  for (const int number : {SIGPIPE, SIGXFSZ}) std::signal(number, SIG_DFL);
  alarm(kMostSeconds);
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  if (chdir(folder.c_str()) != 0) _exit(126);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  board = shared_board();
  std::exit(graze_main(static_cast<int>(words.size()), argv.data()));
}

std::string text_from(const std::byte*& at, std::uint64_t size) {
  std::string out(reinterpret_cast<const char*>(at), size);
  at += size;
  return out;
}

std::vector<Change> changes_of(const Board& b) {
  if (b.lost) throw std::runtime_error("a change of the disk was not recorded");
  std::vector<Change> out;
  const std::byte* at = b.record;
  const std::byte* const end = at + b.recorded;
  while (at < end) {
    Head head{};
    std::memcpy(&head, at, sizeof head);
    at += sizeof head;
    Change& change = out.emplace_back();
    change.kind = head.kind;
    change.inode = head.inode;
    change.offset = head.offset;
    change.path = text_from(at, head.path);
    change.to = text_from(at, head.to);
    change.data = text_from(at, head.data);
  }
  return out;
}

}  // namespace

void record(Change::Kind kind, std::uint64_t inode, std::uint64_t offset, const char* path, const char* to,
            const void* data, std::size_t size) {
  const Head head{
      kind, static_cast<std::uint32_t>(std::strlen(path)), static_cast<std::uint32_t>(std::strlen(to)), inode, offset,
      size};
  std::size_t at = board->recorded;
  if (at + sizeof head + head.path + head.to + size > Board::kRecord) {
    board->lost = true;
    return;
  }
  const auto add = [&](const void* from, std::size_t bytes) {
    if (bytes > 0) std::memcpy(board->record + at, from, bytes);
    at += bytes;
  };
  add(&head, sizeof head);
  add(path, head.path);
  add(to, head.to);
  add(data, size);
  board->recorded = at;
}

Outcome run(const std::filesystem::path& folder, const std::string& arguments, const Plan& plan) {
  prepare(folder, plan);
  std::vector<std::string> words = {"graze"};
  std::istringstream in(arguments);
  for (std::string word; in >> word;) words.push_back(word);
  std::cout.flush();
  std::fflush(nullptr);
  const int out = scratch(), err = scratch();
  const pid_t id = fork();
  if (id == 0) child(folder, std::move(words), out, err);
  if (plan.kill_after >= 0) {
    std::this_thread::sleep_for(std::chrono::microseconds(plan.kill_after));
    kill(id, SIGKILL);
  }
  int status = 0;
  waitpid(id, &status, 0);
  const Board& b = *shared_board();
  Outcome outcome;
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  outcome.out = content(out);
  outcome.err = content(err);
  outcome.calls = b.calls;
  outcome.allocations = b.allocations;
  outcome.threads = b.threads;
  if (b.failed) {
    outcome.failed = std::string(b.failed_call) + " " + b.failed_path;
    outcome.failed_path = b.failed_path;
  }
  if (plan.paths) {
    const auto noted = std::min<std::size_t>(Board::kPaths, static_cast<std::size_t>(outcome.allocations));
    outcome.call_paths.assign(b.call_path, b.call_path + noted);
  }
  if (plan.what == What::record) outcome.changes = changes_of(b);
  return outcome;
}

}  // namespace graze::faults
