#pragma once
// Opening files that may be anybody's: only regular files are opened, so that no pipe is waited for and no device is
// touched.

#include <sys/types.h>

#include <string>

namespace graze {

/// Owns a POSIX file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept;
  Descriptor& operator=(Descriptor&& other) noexcept;
  int number() const { return number_; }
  explicit operator bool() const { return number_ >= 0; }

 private:
  int number_;
};

/// What a mode of stat(2) is: "a symbolic link", "a named pipe", "a device", "a socket", "a directory", "a file".
std::string kind_of(mode_t mode);

/// Whether a link in the place of a file leads to it. Links are followed where a user names a file.
enum class Links { followed, refused };

struct OpenedFile {
  Descriptor file;
  int error = 0;             // errno, if the system has refused
  std::string refused = {};  // what it is, if that is no regular file: "a named pipe"
};

/// Opens the file `name` in the directory behind the descriptor `folder` (or AT_FDCWD) if it is a regular one. `flags`
/// as for open(2); new files get mode 0666. Never waits.
OpenedFile open_regular(int folder, const char* name, int flags, Links links);

}  // namespace graze
