#include "archive/hdf5/reading_child.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <climits>
#include <csignal>
#include <cstring>
#include <fstream>
#include <new>
#include <thread>

#include "archive/files/layout.h"
#include "engine/settings/child_end.h"
#include "engine/settings/forked.h"
#include "engine/settings/settings.h"

// Their shadow memory is larger than any limit.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define GRAZE_NO_MEMORY_LIMIT
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define GRAZE_NO_MEMORY_LIMIT
#endif
#endif

namespace graze {
namespace {

namespace fs = std::filesystem;

/// What a child reports to its parent, in memory that both share.
struct Report {
  int depth;  // of ReadingNote
  bool over, done;
  std::size_t index;
  std::array<char, PATH_MAX> file;
  std::array<char, 8192> message;
};

Report* report = nullptr;  // in a child and its parent
bool child = false;
struct {
  rlimit memory, processor, core;
} before;  // a child's limits, as they were

template <std::size_t N>
void put(std::array<char, N>& to, const char* text) {
  const std::size_t size = std::min(std::strlen(text), N - 1);
  std::memcpy(to.data(), text, size);
  to[size] = '\0';
}

Report& shared_report() {
  if (report == nullptr) {
    void* const memory = mmap(nullptr, sizeof(Report), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) {
      throw MachineError(fmt::format("no memory to be shared with a child process: {}", std::strerror(errno)));
    }
    report = static_cast<Report*>(memory);  // zeros
  }
  *report = Report{};
  return *report;
}

bool traced() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("TracerPid:", 0) == 0) return std::atoi(line.c_str() + std::strlen("TracerPid:")) != 0;
  }
  return false;
}

/// Lowers a soft limit; the user's own stays if it is lower.
void lower(decltype(RLIMIT_AS) which, const rlimit& now, rlim_t value) {
  rlimit limit = now;
  limit.rlim_cur = std::min({limit.rlim_cur, limit.rlim_max, value});
  setrlimit(which, &limit);
}

[[maybe_unused]] std::uint64_t address_space() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

void allow_time(std::uint64_t seconds) {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  lower(RLIMIT_CPU, before.processor,
        static_cast<std::uint64_t>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + seconds);
}

void allow_memory([[maybe_unused]] std::uint64_t bytes) {
#ifndef GRAZE_NO_MEMORY_LIMIT
  lower(RLIMIT_AS, before.memory, address_space() + bytes);
#endif
}

void become_child(pid_t parent, const ReadingLimits& limits) {
  child = true;
  die_with(parent);
  getrlimit(RLIMIT_CORE, &before.core);
  lower(RLIMIT_CORE, before.core, 0);
  getrlimit(RLIMIT_AS, &before.memory);
  getrlimit(RLIMIT_CPU, &before.processor);
  allow_memory(limits.memory);
  allow_time(limits.seconds);
}

/// What a file takes on its disk: a sparse one may claim any size.
std::uint64_t bytes_of(const fs::path& file) {
  struct stat status {};
  if (lstat(file.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return 0;
  constexpr std::uint64_t kBlock = 512;
  return std::min(static_cast<std::uint64_t>(status.st_size), static_cast<std::uint64_t>(status.st_blocks) * kBlock);
}

std::uint64_t bytes_in(const fs::path& folder) {
  std::uint64_t bytes = 0;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    bytes += bytes_of(at->path());
  }
  return bytes;
}

/// Reads files first, first + 1, … in a child, up to the first that cannot be read.
[[noreturn]] void read_in_child(const std::vector<fs::path>& files, std::size_t first,
                                const std::function<void(const fs::path&)>& read) {
  for (std::size_t i = first; i < files.size(); ++i) {
    report->index = i;
    const ReadingLimits limits = reading_limits({files[i]});
    allow_memory(limits.memory);
    allow_time(limits.seconds);
    try {
      const ReadingNote note(files[i]);
      read(files[i]);
      continue;
    } catch (const std::bad_alloc&) {
      put(report->message, too_large_text().c_str());
    } catch (const std::exception& error) {
      put(report->message, error.what());
    }
    _exit(1);
  }
  _exit(0);
}

}  // namespace

ReadingLimits reading_limits(const std::vector<fs::path>& paths, double seconds_per_megabyte) {
  constexpr std::uint64_t kMemory = 1'400'000'000, kSeconds = 30;
  std::uint64_t bytes = 0;
  for (const fs::path& path : paths) {
    const fs::path shards = path / kShardFolder;
    std::error_code error;
    bytes += bytes_of(path) + bytes_in(path) + (fs::is_symlink(shards, error) ? 0 : bytes_in(shards));
  }
  return {kMemory + 2 * bytes,
          kSeconds + static_cast<std::uint64_t>(seconds_per_megabyte * static_cast<double>(bytes) / 1e6)};
}

ReadingNote::ReadingNote(const fs::path& file) noexcept {
  if (report == nullptr) return;
  ++report->depth;
  put(report->file, file.c_str());
}

ReadingNote::~ReadingNote() {
  if (report != nullptr) --report->depth;
}

bool may_not_fork() { return child || traced(); }

namespace {

/// Waits for a child, and returns how it ended. One that stays stopped alone, by a controller in it, is not waited for:
/// a scheduler, or Ctrl-Z, stops this process, too, which looks more than once when it goes on, since both are woken at
/// nearly the same time.
int status_at_end(pid_t id) {
  constexpr int kLooks = 3;
  int stopped = 0;  // looks that have found it so
  while (true) {
    int status = 0;
    const pid_t found = waitpid(id, &status, WUNTRACED | WCONTINUED | (stopped > 0 ? WNOHANG : 0));
    if (found < 0) {
      if (errno != EINTR) throw MachineError(fmt::format("a child process is lost: {}", std::strerror(errno)));
    } else if (found == 0 && stopped > kLooks) {
      kill(id, SIGKILL);
      stopped = 0;
    } else if (found == 0) {
      std::this_thread::sleep_for(std::chrono::seconds(1));
      ++stopped;
    } else if (WIFSTOPPED(status)) {
      stopped = WSTOPSIG(status) == SIGSTOP ? 1 : 0;
    } else if (WIFCONTINUED(status)) {
      stopped = 0;
    } else {
      return status;
    }
  }
}

}  // namespace

std::optional<ReaderEnd> go_on_in_child(const ReadingLimits& limits) {
  Report& shared = shared_report();
  const pid_t parent = getpid();
  hear_of_children();
  const pid_t id = fork();
  if (id < 0) throw MachineError(fmt::format("no process can be started to read in: {}", std::strerror(errno)));
  if (id == 0) {
    become_child(parent, limits);
    return std::nullopt;
  }
  ReaderEnd end;
  end.status = status_at_end(id);
  end.file = shared.file.data();
  end.inside = shared.depth > 0;
  end.over = shared.over;
  end.done = shared.done;
  return end;
}

void end_of_child() noexcept {
  if (child) report->done = true;
}

void end_of_reading() {
  if (!child) return;
  report->over = true;
  setrlimit(RLIMIT_AS, &before.memory);
  setrlimit(RLIMIT_CPU, &before.processor);
  setrlimit(RLIMIT_CORE, &before.core);
}

bool died_of_reading(const ReaderEnd& end) {
  const int signal = WTERMSIG(end.status);
  constexpr std::array kCrashes = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP};
  const bool crash = std::find(kCrashes.begin(), kCrashes.end(), signal) != kCrashes.end();
  if (signal == SIGXCPU || (crash && end.inside)) return true;
  if (signal == SIGKILL) {
    throw MachineError(
        fmt::format("{}the process that read it was killed (SIGKILL), by the system if there is no memory left",
                    end.file.empty() ? "" : end.file + ": "));
  }
  if (crash) throw MachineError(fmt::format("internal error: signal {} after '{}' had been read", signal, end.file));
  std::signal(signal, SIG_DFL);
  std::raise(signal);
  _exit(128 + signal);
}

std::string death_text(const ReaderEnd& end, const ReadingLimits& limits) {
  const int signal = WTERMSIG(end.status);
  constexpr const char* kForged = "it is damaged or forged in a way that its checksum does not show";
  if (signal == SIGXCPU) {
    rlimit own{};
    getrlimit(RLIMIT_CPU, &own);  // the user's, if it is lower
    return fmt::format("{}: reading it took more than {} s of processor time, which no archive of its size takes; {}",
                       end.file, std::min<rlim_t>(limits.seconds, own.rlim_cur), kForged);
  }
  return fmt::format("{}: the HDF5 library crashed on it ({}); {}, or this machine has no memory left", end.file,
                     signal_name(signal), kForged);
}

std::string too_large_text() {
  rlimit limit{};
  getrlimit(RLIMIT_AS, &limit);
  return fmt::format("{}: reading it takes more memory than an archive of its size may ({:.1f} GB in all)",
                     report == nullptr ? "" : report->file.data(), static_cast<double>(limit.rlim_cur) / 1e9);
}

std::vector<Unreadable> unreadable(const std::vector<fs::path>& files,
                                   const std::function<void(const fs::path&)>& read) {
  std::vector<Unreadable> out;
  if (may_not_fork()) {
    for (std::size_t i = 0; i < files.size(); ++i) {
      try {
        read(files[i]);
      } catch (const std::exception& error) {
        out.push_back({i, error.what()});
      }
    }
    return out;
  }
  for (std::size_t next = 0; next < files.size();) {
    const ReadingLimits limits = reading_limits({files.begin() + static_cast<std::ptrdiff_t>(next), files.end()});
    const std::optional<ReaderEnd> end = go_on_in_child(limits);
    if (!end) read_in_child(files, next, read);
    if (WIFEXITED(end->status) && WEXITSTATUS(end->status) == 0) break;
    const std::size_t at = report->index;
    const bool died = !WIFEXITED(end->status) && died_of_reading(*end);
    std::string why = died ? death_text(*end, reading_limits({files[at]})) : report->message.data();
    if (why.empty()) {  // a library that ends its process, or a tool that watches over it
      why = fmt::format("{}: the process that read it ended with code {} and without a message", files[at].string(),
                        WEXITSTATUS(end->status));
    }
    out.push_back({at, std::move(why)});
    next = at + 1;
  }
  return out;
}

}  // namespace graze
