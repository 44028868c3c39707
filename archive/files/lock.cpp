#include "archive/files/lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <span>
#include <thread>

#include "archive/files/files.h"
#include "archive/files/shell_word.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

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

/// True if the lock's name still stands for the open file: its last holder may have removed it meanwhile.
bool names(const Directory& directory, int descriptor) {
  struct stat opened {};
  const struct stat named = directory.status(kLockFile);
  return fstat(descriptor, &opened) == 0 && named.st_ino == opened.st_ino && named.st_dev == opened.st_dev;
}

bool still_names(const Directory& directory, int descriptor) noexcept {
  try {
    return names(directory, descriptor);
  } catch (const std::exception&) {
    return true;  // nothing is known; a file that is left over locks nobody out
  }
}

/// Throws MachineError unless still_names().
void check_names(const Directory& directory, int descriptor) {
  if (still_names(directory, descriptor)) return;
  std::optional<std::string> other;
  try {
    other = writer_of(directory);
  } catch (const InputError&) {
    // What has the name by now is no file, so nobody's lock.
  }
  throw MachineError(fmt::format(
      "{}: was removed while this program held it, {}; this program writes nothing more, what it has written is kept, "
      "and 'graze resume {}' does the rest once nobody else writes here",
      (directory / kLockFile).string(), other ? *other + " is writing here by now" : "and another may begin to write",
      shell_path(directory.path().string())));
}

Descriptor open_locked(const Directory& directory) {
  constexpr std::chrono::milliseconds kPause{50};
  const auto begin = std::chrono::steady_clock::now();
  while (true) {
    Descriptor file = directory.open_to_change(kLockFile, O_RDWR);
    std::chrono::seconds patience{};
    const int error = try_lead(file.number(), patience);
    const bool locked = error == 0 || without_locks(error);
    if (locked && names(directory, file.number())) return file;
    if (locked) continue;
    if (error != EAGAIN) fail_writing(directory / kLockFile, error);
    if (std::chrono::steady_clock::now() < begin + patience) {
      std::this_thread::sleep_for(kPause);
      continue;
    }
    throw MachineError(fmt::format("{}: {} is writing here; wait for it, or end it first", directory.path().string(),
                                   content(file.number())));
  }
}

}  // namespace

DirectoryLock::DirectoryLock(Directory directory) : directory_(std::move(directory)), file_(open_locked(directory_)) {
  const std::string text = who_i_am();
  const int failed =
      ftruncate(file_.number(), 0) != 0 ? errno : write_all(file_.number(), std::as_bytes(std::span(text)));
  if (failed == 0) return;
  directory_.remove(kLockFile);
  fail_writing(directory_ / kLockFile, failed);
}

DirectoryLock::~DirectoryLock() {
  if (held()) directory_.remove(kLockFile);
}

bool DirectoryLock::held() const noexcept { return still_names(directory_, file_.number()); }

void DirectoryLock::check_held() const { check_names(directory_, file_.number()); }

MemberLock::MemberLock(const Directory& directory) : directory_(directory) {
  auto file = directory.find_file(kLockFile);
  if (!file) fail_writing(directory / kLockFile, ENOENT);
  file_ = std::move(*file);
  const int error = set_lock(file_.number(), F_RDLCK, kMembers);
  if (error != 0 && !without_locks(error)) fail_writing(directory / kLockFile, error);
}

void MemberLock::check_held() const { check_names(directory_, file_.number()); }

std::optional<std::string> writer_of(const Directory& directory) {
  const auto file = directory.find_file(kLockFile);
  if (!file) return std::nullopt;
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  if (fcntl(file->number(), F_OFD_GETLK, &lock) != 0 || lock.l_type == F_UNLCK) return std::nullopt;
  return content(file->number());
}

std::string why_no_locks(const Directory& directory) {
  const Descriptor one = directory.open_to_change(kLockFile, O_RDWR),
                   other = directory.open_to_change(kLockFile, O_RDWR);
  if (const int error = set_lock(one.number(), F_WRLCK, kLeader)) {
    if (!without_locks(error)) fail_writing(directory / kLockFile, error);
    return fmt::format("this file system has no locks ({})", std::strerror(error));
  }
  return set_lock(other.number(), F_WRLCK, kLeader) == EAGAIN
             ? ""
             : "locks exclude nobody: two programs can hold the same one";
}

}  // namespace graze
