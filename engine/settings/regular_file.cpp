#include "engine/settings/regular_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

namespace graze {

Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

Descriptor::Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}

std::string kind_of(mode_t mode) {
  switch (mode & S_IFMT) {
    case S_IFREG:
      return "a file";
    case S_IFDIR:
      return "a directory";
    case S_IFLNK:
      return "a symbolic link";
    case S_IFIFO:
      return "a named pipe";
    case S_IFSOCK:
      return "a socket";
    default:
      return "a device";
  }
}

OpenedFile open_regular(int folder, const char* name, int flags, Links links) {
  const bool follow = links == Links::followed;
  struct stat status {};
  // Looked at first: to open a device may do something already.
  if (fstatat(folder, name, &status, follow ? 0 : AT_SYMLINK_NOFOLLOW) == 0) {
    if (!S_ISREG(status.st_mode)) return {Descriptor(), 0, kind_of(status.st_mode)};
  } else if (errno != ENOENT || (flags & O_CREAT) == 0) {
    return {Descriptor(), errno};
  }
  const int always = O_NONBLOCK | O_NOCTTY | O_CLOEXEC;
  Descriptor file(openat(folder, name, flags | always | (follow ? 0 : O_NOFOLLOW), 0666));
  if (!file) return {Descriptor(), errno};
  if (fstat(file.number(), &status) != 0) return {Descriptor(), errno};
  if (!S_ISREG(status.st_mode)) return {Descriptor(), 0, kind_of(status.st_mode)};  // it was exchanged meanwhile
  return {std::move(file)};
}

}  // namespace graze
