#include "archive/lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <ctime>
#include <span>
#include <thread>

#include "archive/archive.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

constexpr off_t kLeader = 0, kMembers = 1;  // what is locked: bytes of the file

/// Changes the lock of one byte, or says that somebody else has it. Returns 0, EAGAIN or another errno. Locks of the
/// open file (not of the process) work between threads of one process, too.
int set_lock(int descriptor, short type, off_t byte) {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  lock.l_start = byte;
  lock.l_len = 1;
  if (fcntl(descriptor, F_OFD_SETLK, &lock) == 0) return 0;
  return errno == EACCES ? EAGAIN : errno;
}

/// A file system without locks, such as Lustre mounted without them, says one of these (the last is NFS's own).
bool without_locks(int error) {
  constexpr int kNotSupportedByNfs = 524;
  return error == ENOLCK || error == EINVAL || error == ENOSYS || error == EOPNOTSUPP || error == kNotSupportedByNfs;
}

// A process that was killed holds its lock until its last write to the disk is through; ranks that have lost their
// leader live until their launcher has noticed.
constexpr std::chrono::seconds kPatience{3}, kPatienceWithRanks{30};

/// Takes the leader's lock, and makes sure that no member is left of a leader before. As set_lock(); `patience`: how
/// long it is worth to try again.
int try_lead(int descriptor, std::chrono::seconds& patience) {
  patience = kPatience;
  const int error = set_lock(descriptor, F_WRLCK, kLeader);
  if (error != 0) return error;
  patience = kPatienceWithRanks;
  const int members = set_lock(descriptor, F_WRLCK, kMembers);
  if (members == 0) set_lock(descriptor, F_UNLCK, kMembers);
  return members;
}

std::string content(int descriptor) {
  std::array<char, 256> text{};
  const ssize_t size = pread(descriptor, text.data(), text.size(), 0);
  return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : "an unknown process";
}

std::string who_i_am() {
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host[0] = '?';
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  std::array<char, 32> time{};
  std::strftime(time.data(), time.size(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  return fmt::format("process {} on {} since {}", getpid(), host.data(), time.data());
}

/// True if `path` still names the open file: whoever held the lock before may have removed it meanwhile.
bool names(const fs::path& path, int descriptor) {
  struct stat named {
  }, opened{};
  return stat(path.c_str(), &named) == 0 && fstat(descriptor, &opened) == 0 && named.st_ino == opened.st_ino &&
         named.st_dev == opened.st_dev;
}

int open_locked(const fs::path& path) {
  constexpr std::chrono::milliseconds kPause{50};
  const auto begin = std::chrono::steady_clock::now();
  while (true) {
    const int descriptor = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor < 0) fail_writing(path, errno);
    std::chrono::seconds patience{};
    const int error = try_lead(descriptor, patience);
    const bool locked = error == 0 || without_locks(error);
    if (locked && names(path, descriptor)) return descriptor;
    const std::string holder = content(descriptor);
    close(descriptor);
    if (locked) continue;
    if (error != EAGAIN) fail_writing(path, error);
    if (std::chrono::steady_clock::now() < begin + patience) {
      std::this_thread::sleep_for(kPause);
      continue;
    }
    throw MachineError(
        fmt::format("{}: {} is writing here; wait for it, or end it first", path.parent_path().string(), holder));
  }
}

}  // namespace

DirectoryLock::DirectoryLock(const fs::path& directory) : path_(directory / kLockFile), file_(open_locked(path_)) {
  const std::string text = who_i_am();
  if (ftruncate(file_.number(), 0) != 0) fail_writing(path_, errno);
  if (const int failed = write_all(file_.number(), std::as_bytes(std::span(text)))) fail_writing(path_, failed);
}

DirectoryLock::~DirectoryLock() { unlink(path_.c_str()); }

MemberLock::MemberLock(const fs::path& directory) : file_(open((directory / kLockFile).c_str(), O_RDWR | O_CLOEXEC)) {
  if (file_.number() < 0) fail_writing(directory / kLockFile, errno);
  const int error = set_lock(file_.number(), F_RDLCK, kMembers);
  if (error != 0 && !without_locks(error)) fail_writing(directory / kLockFile, error);
}

std::optional<std::string> writer_of(const fs::path& directory) {
  const Descriptor file(open((directory / kLockFile).c_str(), O_RDONLY | O_CLOEXEC));
  if (file.number() < 0) return std::nullopt;
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  if (fcntl(file.number(), F_OFD_GETLK, &lock) != 0 || lock.l_type == F_UNLCK) return std::nullopt;
  return content(file.number());
}

}  // namespace graze
