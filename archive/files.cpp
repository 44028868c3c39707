#include "archive/files.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "archive/archive.h"

namespace graze {
int write_all(int descriptor, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return 0;
}

void check_new_file(const std::filesystem::path& file, bool force, const std::vector<std::filesystem::path>& made_of) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path full = fs::weakly_canonical(file, error);
  for (const fs::path& source : made_of) {
    const fs::path other = fs::weakly_canonical(source, error);
    if (std::mismatch(other.begin(), other.end(), full.begin(), full.end()).first != other.end()) continue;
    throw InputError(fmt::format("{}: {} {}, which is only read; choose another --output", file.string(),
                                 full == other ? "is" : "lies within", source.string()));
  }
  if (!fs::exists(file, error)) return;
  if (!fs::is_regular_file(file, error)) {
    throw InputError(fmt::format("{}: is a directory or a device; choose another --output", file.string()));
  }
  if (!force) {
    throw InputError(fmt::format("{}: exists already; choose another --output or give --force", file.string()));
  }
}

bool make_directory(const std::filesystem::path& path) {
  if (mkdir(path.c_str(), 0777) != 0) {
    const int error = errno;
    if (error == EEXIST && std::filesystem::is_directory(path)) return false;  // another rank was faster
    fail_writing(path, error);
  }
  Directory::of_new(path).sync();
  return true;
}

NewFile::NewFile(Directory folder, std::string name)
    : folder_(std::move(folder)), name_(std::move(name)), file_(folder_.create_temporary(name_, temporary_)) {}

NewFile::NewFile(const std::filesystem::path& path) : NewFile(Directory::of_new(path), path.filename().string()) {}

NewFile::~NewFile() {
  if (!published_) folder_.remove(temporary_);
}

void NewFile::publish() {
  if (fsync(file_.number()) != 0) fail_writing(folder_ / name_, errno);
  if (const int error = folder_.rename(temporary_, name_); error != 0) fail_writing(folder_ / name_, error);
  published_ = true;
  folder_.sync();
}

}  // namespace graze
