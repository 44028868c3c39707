#include "archive/files/new_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include <string>

#include "archive/files/files.h"
#include "archive/files/parent_folders.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

/// Locked, if nobody else has it.
Descriptor take(const fs::path& folder) {
  Descriptor out(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  if (out && flock(out.number(), LOCK_EX | LOCK_NB) != 0) return Descriptor();
  return out;
}

void remove_abandoned_folders(const fs::path& folder) {
  std::error_code error;
  for (const fs::directory_entry& one : fs::directory_iterator(folder_of(folder), error)) {
    const std::string name = one.path().filename().string();
    if (final_name(name) != folder.filename().string() || name == folder.filename().string() + ".tmp") continue;
    if (take(one.path())) fs::remove_all(one.path(), error);
  }
}

}  // namespace

NewFolder::NewFolder(const fs::path& folder) : folder_(folder), temporary_(folder) {
  remove_abandoned_folders(folder);
  temporary_ += fmt::format(".{}.tmp", random_digits());
  // Another process may take it for left over before it is locked.
  constexpr int kAttempts = 5;
  std::error_code error;
  for (int i = 0; i < kAttempts && !fs::exists(temporary_, error); ++i) {
    make_directory(temporary_);
    lock_ = take(temporary_);
  }
}

NewFolder::~NewFolder() {
  std::error_code error;
  if (!published_) fs::remove_all(temporary_, error);
}

std::error_code NewFolder::publish() {
  std::error_code error;
  fs::rename(temporary_, folder_, error);
  published_ = !error;
  return error;
}

}  // namespace graze
