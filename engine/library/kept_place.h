#pragma once
// The working directory of this process, which a library may change as it likes: what is written afterwards by a
// relative name must not land where it leads.

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace graze {

/// Puts the working directory, and the mask of new files' rights, back when it ends.
class KeptPlace {
 public:
  KeptPlace() : folder_(::open(".", O_PATH | O_DIRECTORY | O_CLOEXEC)), mask_(::umask(022)) { ::umask(mask_); }
  ~KeptPlace() {
    ::umask(mask_);
    if (folder_ < 0) return;
    [[maybe_unused]] const int back = ::fchdir(folder_);
    ::close(folder_);
  }
  KeptPlace(const KeptPlace&) = delete;
  KeptPlace& operator=(const KeptPlace&) = delete;

 private:
  int folder_;
  mode_t mask_;
};

}  // namespace graze
