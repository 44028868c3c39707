// The calls that concern files, in place of the C library's: they pass on what they are given, unless the plan says
// otherwise. System calls are made directly, so that nothing below them is intercepted twice.
#undef _FORTIFY_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "tests/faults/board.h"

namespace graze::faults {
namespace {

using Kind = Change::Kind;
using Path = std::array<char, Board::kPath>;

/// The absolute path of an open file or directory. Empty if it has none.
void path_of(int descriptor, Path& path) {
  std::array<char, 32> link{};
  snprintf(link.data(), link.size(), "/proc/self/fd/%d", descriptor);
  const long size = syscall(SYS_readlinkat, AT_FDCWD, link.data(), path.data(), path.size() - 1);
  path[size > 0 ? static_cast<std::size_t>(size) : 0] = 0;
}

/// The absolute path of a name below a directory; "." and ".." in it stay.
void path_at(int directory, const char* name, Path& path) {
  path[0] = 0;
  if (name == nullptr) return;
  if (name[0] != '/') {
    if (directory == AT_FDCWD) {
      if (syscall(SYS_getcwd, path.data(), path.size()) < 0) path[0] = 0;
    } else {
      path_of(directory, path);
    }
    while (name[0] == '.' && name[1] == '/') name += 2;
  }
  const std::size_t length = strlen(path.data());
  if (name[0] != 0) snprintf(path.data() + length, path.size() - length, "%s%s", name[0] == '/' ? "" : "/", name);
}

bool watched(const Path& path) {
  return strncmp(path.data(), board->under, board->under_length) == 0 &&
         (path[board->under_length] == '/' || path[board->under_length] == 0);
}

bool watching() { return board != nullptr && board->under[0] != 0; }
bool recording() { return watching() && board->what == What::record; }

/// Counts a call. True if it shall fail; errno is set then.
bool fails(const char* call, const Path& path, bool writes = false) {
  if (!watched(path)) return false;
  const long number = ++board->calls;
  const bool chosen = number == board->at || (board->for_good && board->at > 0 && number > board->at);
  const bool shrunk = board->what == What::shrink;
  if (!chosen && !(shrunk && number == board->at + 1 && board->failed)) return false;
  if (board->what == What::pass || board->what == What::record) return false;
  if (shrunk && number == board->at && !writes) return false;
  if (!board->failed.exchange(true)) {
    snprintf(board->failed_call, sizeof board->failed_call, "%s", call);
    snprintf(board->failed_path, sizeof board->failed_path, "%s", path.data());
  }
  if (board->what == What::kill) {
    kill(static_cast<pid_t>(syscall(SYS_getpid)), SIGKILL);
    pause();
  }
  if (shrunk && number == board->at) return false;  // it is the write itself that is cut short
  errno = board->error;
  return true;
}

bool fails_at(const char* call, int directory, const char* name) {
  if (!watching()) return false;
  Path path;
  path_at(directory, name, path);
  return fails(call, path);
}

bool fails_on(const char* call, int descriptor) {
  if (!watching()) return false;
  Path path;
  path_of(descriptor, path);
  return fails(call, path);
}

/// How much of `size` bytes a write may write; -1: it fails.
ssize_t allowed(const char* call, int descriptor, std::size_t size) {
  if (!watching()) return static_cast<ssize_t>(size);
  Path path;
  path_of(descriptor, path);
  if (fails(call, path, true)) return -1;
  const bool cut = board->what == What::shrink && watched(path) && board->calls == board->at && size > 1;
  return static_cast<ssize_t>(cut ? size / 2 : size);
}

std::uint64_t inode_of(int descriptor) {
  struct stat found {};
  return syscall(SYS_newfstatat, descriptor, "", &found, AT_EMPTY_PATH) == 0 ? found.st_ino : 0;
}

std::uint64_t inode_at(int directory, const char* name) {
  struct stat found {};
  return syscall(SYS_newfstatat, directory, name, &found, AT_SYMLINK_NOFOLLOW) == 0 ? found.st_ino : 0;
}

/// Makes a change and takes it down, so that the record has the order of the changes.
template <class Act, class Tell>
auto change(const Act& act, const Tell& tell) {
  if (!recording()) return act();
  while (board->recording.test_and_set()) {
  }
  const auto result = act();
  const int error = errno;
  if (result >= 0) tell();
  board->recording.clear();
  errno = error;
  return result;
}

int open_at(int directory, const char* name, int flags, mode_t mode) {
  if (fails_at("open", directory, name)) return -1;
  const auto act = [&] { return static_cast<int>(syscall(SYS_openat, directory, name, flags, mode)); };
  if (!recording() || (flags & O_ACCMODE) == O_RDONLY) return act();
  Path path;
  path_at(directory, name, path);
  const std::uint64_t before = inode_at(directory, name);
  int opened = -1;
  return change([&] { return opened = act(); },
                [&] {
                  if (!watched(path)) return;
                  const std::uint64_t inode = inode_of(opened);
                  if (before == 0) record(Kind::create, inode, 0, path.data(), "", nullptr, 0);
                  if (before != 0 && (flags & O_TRUNC)) record(Kind::truncate, inode, 0, "", "", nullptr, 0);
                });
}

ssize_t write_at(int descriptor, const void* data, std::size_t size, off_t offset, bool moves) {
  const ssize_t most = allowed("write", descriptor, size);
  if (most < 0) return -1;
  const auto act = [&]() -> ssize_t {
    if (moves) return syscall(SYS_write, descriptor, data, most);
    return syscall(SYS_pwrite64, descriptor, data, most, offset);
  };
  if (!recording()) return act();
  Path path;
  path_of(descriptor, path);
  ssize_t written = 0;
  return change([&] { return written = act(); },
                [&] {
                  if (!watched(path)) return;
                  const off_t at = moves ? syscall(SYS_lseek, descriptor, 0, SEEK_CUR) - written : offset;
                  record(Kind::write, inode_of(descriptor), static_cast<std::uint64_t>(at), "", "", data,
                         static_cast<std::size_t>(written));
                });
}

int cut(int descriptor, off_t length) {
  if (fails_on("truncate", descriptor)) return -1;
  Path path;
  if (recording()) path_of(descriptor, path);
  return change([&] { return static_cast<int>(syscall(SYS_ftruncate, descriptor, length)); },
                [&] {
                  if (!watched(path)) return;
                  record(Kind::truncate, inode_of(descriptor), static_cast<std::uint64_t>(length), "", "", nullptr, 0);
                });
}

int sync(const char* call, long number, int descriptor) {
  if (fails_on(call, descriptor)) return -1;
  Path path;
  if (recording()) path_of(descriptor, path);
  return change([&] { return static_cast<int>(syscall(number, descriptor)); },
                [&] {
                  if (watched(path)) record(Kind::sync, inode_of(descriptor), 0, "", "", nullptr, 0);
                });
}

int rename_at(int from_directory, const char* from, int to_directory, const char* to, unsigned flags) {
  if (fails_at("rename", from_directory, from)) return -1;
  Path old_path, new_path;
  if (recording()) {
    path_at(from_directory, from, old_path);
    path_at(to_directory, to, new_path);
  }
  return change([&] { return static_cast<int>(syscall(SYS_renameat2, from_directory, from, to_directory, to, flags)); },
                [&] {
                  if (watched(old_path)) record(Kind::rename, 0, 0, old_path.data(), new_path.data(), nullptr, 0);
                  if (flags & RENAME_EXCHANGE) board->lost = true;
                });
}

int unlink_at(int directory, const char* name, int flags) {
  if (fails_at(flags & AT_REMOVEDIR ? "rmdir" : "unlink", directory, name)) return -1;
  Path path;
  if (recording()) path_at(directory, name, path);
  return change([&] { return static_cast<int>(syscall(SYS_unlinkat, directory, name, flags)); },
                [&] {
                  if (watched(path)) record(Kind::unlink, 0, 0, path.data(), "", nullptr, 0);
                });
}

int mkdir_at(int directory, const char* name, mode_t mode) {
  if (fails_at("mkdir", directory, name)) return -1;
  Path path;
  if (recording()) path_at(directory, name, path);
  return change([&] { return static_cast<int>(syscall(SYS_mkdirat, directory, name, mode)); },
                [&] {
                  if (!watched(path)) return;
                  record(Kind::make_directory, inode_at(directory, name), 0, path.data(), "", nullptr, 0);
                });
}

int link_at(int from_directory, const char* from, int to_directory, const char* to, int flags) {
  if (fails_at("link", to_directory, to)) return -1;
  Path path;
  if (recording()) path_at(to_directory, to, path);
  return change([&] { return static_cast<int>(syscall(SYS_linkat, from_directory, from, to_directory, to, flags)); },
                [&] {
                  if (watched(path)) record(Kind::link, inode_at(to_directory, to), 0, path.data(), "", nullptr, 0);
                });
}

/// The C library's function of a name.
template <class F>
F next(const char* name) {
  return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

/// A change of another kind than those that are recorded.
int unrecorded() {
  if (recording()) board->lost = true;
  return 0;
}

}  // namespace
}  // namespace graze::faults

using namespace graze::faults;  // NOLINT

#define GRAZE_MODE(flags)                                 \
  mode_t mode = 0;                                        \
  if ((flags) & (O_CREAT | (O_TMPFILE & ~O_DIRECTORY))) { \
    va_list rest;                                         \
    va_start(rest, flags);                                \
    mode = va_arg(rest, mode_t);                          \
    va_end(rest);                                         \
  }

extern "C" {

int open(const char* name, int flags, ...) {
  GRAZE_MODE(flags)
  return open_at(AT_FDCWD, name, flags, mode);
}
int open64(const char* name, int flags, ...) {
  GRAZE_MODE(flags)
  return open_at(AT_FDCWD, name, flags, mode);
}
int openat(int directory, const char* name, int flags, ...) {
  GRAZE_MODE(flags)
  return open_at(directory, name, flags, mode);
}
int openat64(int directory, const char* name, int flags, ...) {
  GRAZE_MODE(flags)
  return open_at(directory, name, flags, mode);
}
int __open_2(const char* name, int flags) { return open_at(AT_FDCWD, name, flags, 0); }
int __open64_2(const char* name, int flags) { return open_at(AT_FDCWD, name, flags, 0); }
int __openat_2(int directory, const char* name, int flags) { return open_at(directory, name, flags, 0); }
int __openat64_2(int directory, const char* name, int flags) { return open_at(directory, name, flags, 0); }
int creat(const char* name, mode_t mode) { return open_at(AT_FDCWD, name, O_CREAT | O_WRONLY | O_TRUNC, mode); }
int creat64(const char* name, mode_t mode) { return open_at(AT_FDCWD, name, O_CREAT | O_WRONLY | O_TRUNC, mode); }

FILE* fopen(const char* name, const char* mode) {
  if (fails_at("open", AT_FDCWD, name)) return nullptr;
  if (mode[0] != 'r') unrecorded();
  return next<FILE* (*)(const char*, const char*)>("fopen")(name, mode);
}
FILE* fopen64(const char* name, const char* mode) { return fopen(name, mode); }

DIR* opendir(const char* name) {
  if (fails_at("opendir", AT_FDCWD, name)) return nullptr;
  return next<DIR* (*)(const char*)>("opendir")(name);
}
DIR* fdopendir(int descriptor) {
  if (fails_on("opendir", descriptor)) return nullptr;
  return next<DIR* (*)(int)>("fdopendir")(descriptor);
}
dirent* readdir(DIR* directory) {
  if (fails_on("readdir", dirfd(directory))) return nullptr;
  return next<dirent* (*)(DIR*)>("readdir")(directory);
}
dirent64* readdir64(DIR* directory) {
  if (fails_on("readdir", dirfd(directory))) return nullptr;
  return next<dirent64* (*)(DIR*)>("readdir64")(directory);
}

ssize_t read(int descriptor, void* to, size_t size) {
  return fails_on("read", descriptor) ? -1 : syscall(SYS_read, descriptor, to, size);
}
ssize_t __read_chk(int descriptor, void* to, size_t size, size_t) { return read(descriptor, to, size); }
ssize_t pread(int descriptor, void* to, size_t size, off_t offset) {
  return fails_on("read", descriptor) ? -1 : syscall(SYS_pread64, descriptor, to, size, offset);
}
ssize_t pread64(int descriptor, void* to, size_t size, off64_t offset) { return pread(descriptor, to, size, offset); }
ssize_t __pread_chk(int descriptor, void* to, size_t size, off_t offset, size_t) {
  return pread(descriptor, to, size, offset);
}
ssize_t __pread64_chk(int descriptor, void* to, size_t size, off64_t offset, size_t) {
  return pread(descriptor, to, size, offset);
}

ssize_t write(int descriptor, const void* data, size_t size) { return write_at(descriptor, data, size, 0, true); }
ssize_t pwrite(int descriptor, const void* data, size_t size, off_t offset) {
  return write_at(descriptor, data, size, offset, false);
}
ssize_t pwrite64(int descriptor, const void* data, size_t size, off64_t offset) {
  return write_at(descriptor, data, size, offset, false);
}
ssize_t writev(int descriptor, const iovec* pieces, int count) {
  ssize_t all = 0;
  for (int i = 0; i < count; ++i) {
    if (pieces[i].iov_len == 0) continue;
    const ssize_t written = write_at(descriptor, pieces[i].iov_base, pieces[i].iov_len, 0, true);
    if (written < 0) return all > 0 ? all : -1;
    all += written;
    if (static_cast<size_t>(written) < pieces[i].iov_len) break;
  }
  return all;
}

int fsync(int descriptor) { return sync("fsync", SYS_fsync, descriptor); }
int fdatasync(int descriptor) { return sync("fdatasync", SYS_fdatasync, descriptor); }

int rename(const char* from, const char* to) { return rename_at(AT_FDCWD, from, AT_FDCWD, to, 0); }
int renameat(int from_directory, const char* from, int to_directory, const char* to) {
  return rename_at(from_directory, from, to_directory, to, 0);
}
int renameat2(int from_directory, const char* from, int to_directory, const char* to, unsigned flags) {
  return rename_at(from_directory, from, to_directory, to, flags);
}
int unlink(const char* name) { return unlink_at(AT_FDCWD, name, 0); }
int unlinkat(int directory, const char* name, int flags) { return unlink_at(directory, name, flags); }
int rmdir(const char* name) { return unlink_at(AT_FDCWD, name, AT_REMOVEDIR); }
int remove(const char* name) {
  struct stat found {};
  const bool directory =
      syscall(SYS_newfstatat, AT_FDCWD, name, &found, AT_SYMLINK_NOFOLLOW) == 0 && S_ISDIR(found.st_mode);
  return unlink_at(AT_FDCWD, name, directory ? AT_REMOVEDIR : 0);
}
int mkdir(const char* name, mode_t mode) { return mkdir_at(AT_FDCWD, name, mode); }
int mkdirat(int directory, const char* name, mode_t mode) { return mkdir_at(directory, name, mode); }
int link(const char* from, const char* to) { return link_at(AT_FDCWD, from, AT_FDCWD, to, 0); }
int linkat(int from_directory, const char* from, int to_directory, const char* to, int flags) {
  return link_at(from_directory, from, to_directory, to, flags);
}

int ftruncate(int descriptor, off_t length) { return cut(descriptor, length); }
int ftruncate64(int descriptor, off64_t length) { return cut(descriptor, length); }
int truncate(const char* name, off_t length) {
  const int descriptor = open_at(AT_FDCWD, name, O_WRONLY | O_CLOEXEC, 0);
  if (descriptor < 0) return -1;
  const int result = cut(descriptor, length);
  close(descriptor);
  return result;
}
int truncate64(const char* name, off64_t length) { return truncate(name, length); }

void* mmap(void* at, size_t size, int protection, int flags, int descriptor, off_t offset) {
  if (descriptor >= 0 && fails_on("mmap", descriptor)) return MAP_FAILED;
  if (descriptor >= 0 && (protection & PROT_WRITE) && (flags & MAP_SHARED)) unrecorded();
  return reinterpret_cast<void*>(syscall(SYS_mmap, at, size, protection, flags, descriptor, offset));
}
void* mmap64(void* at, size_t size, int protection, int flags, int descriptor, off64_t offset) {
  return mmap(at, size, protection, flags, descriptor, offset);
}

// What looks at files.
int stat(const char* name, struct stat* found) {
  return fails_at("stat", AT_FDCWD, name) ? -1 : static_cast<int>(syscall(SYS_newfstatat, AT_FDCWD, name, found, 0));
}
int lstat(const char* name, struct stat* found) {
  return fails_at("stat", AT_FDCWD, name)
             ? -1
             : static_cast<int>(syscall(SYS_newfstatat, AT_FDCWD, name, found, AT_SYMLINK_NOFOLLOW));
}
int fstatat(int directory, const char* name, struct stat* found, int flags) {
  return fails_at("stat", directory, name) ? -1
                                           : static_cast<int>(syscall(SYS_newfstatat, directory, name, found, flags));
}
int fstat(int descriptor, struct stat* found) {
  return fails_on("stat", descriptor) ? -1
                                      : static_cast<int>(syscall(SYS_newfstatat, descriptor, "", found, AT_EMPTY_PATH));
}

int stat64(const char* name, struct stat64* found) { return stat(name, reinterpret_cast<struct stat*>(found)); }
int lstat64(const char* name, struct stat64* found) { return lstat(name, reinterpret_cast<struct stat*>(found)); }
int fstatat64(int directory, const char* name, struct stat64* found, int flags) {
  return fstatat(directory, name, reinterpret_cast<struct stat*>(found), flags);
}
int fstat64(int descriptor, struct stat64* found) { return fstat(descriptor, reinterpret_cast<struct stat*>(found)); }
int access(const char* name, int mode) {
  return fails_at("access", AT_FDCWD, name) ? -1 : static_cast<int>(syscall(SYS_faccessat, AT_FDCWD, name, mode));
}
int statvfs(const char* name, struct statvfs* found) {
  return fails_at("statvfs", AT_FDCWD, name) ? -1 : next<int (*)(const char*, struct statvfs*)>("statvfs")(name, found);
}
int statvfs64(const char* name, struct statvfs64* found) {
  return statvfs(name, reinterpret_cast<struct statvfs*>(found));
}

// Ways to change files that are not recorded: nothing in Graze takes them, and the test would say so.
ssize_t copy_file_range(int from, off64_t* from_offset, int to, off64_t* to_offset, size_t size, unsigned flags) {
  if (fails_on("write", to)) return -1;
  unrecorded();
  return syscall(SYS_copy_file_range, from, from_offset, to, to_offset, size, flags);
}
ssize_t sendfile(int to, int from, off_t* offset, size_t size) {
  if (fails_on("write", to)) return -1;
  unrecorded();
  return syscall(SYS_sendfile, to, from, offset, size);
}
ssize_t sendfile64(int to, int from, off64_t* offset, size_t size) { return sendfile(to, from, offset, size); }

// Locks; all else that fcntl does passes.
int fcntl(int descriptor, int command, ...) {
  va_list rest;
  va_start(rest, command);
  void* const argument = va_arg(rest, void*);
  va_end(rest);
  const bool locks = command == F_OFD_SETLK || command == F_OFD_SETLKW || command == F_SETLK || command == F_SETLKW;
  if (locks && fails_on("lock", descriptor)) return -1;
  return static_cast<int>(syscall(SYS_fcntl, descriptor, command, argument));
}
int fcntl64(int descriptor, int command, ...) {
  va_list rest;
  va_start(rest, command);
  void* const argument = va_arg(rest, void*);
  va_end(rest);
  return fcntl(descriptor, command, argument);
}

}  // extern "C"
