#include "archive/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "archive/archive.h"

namespace graze {
namespace {

/// Makes a rename or a new name in a directory last through a power cut.
void sync_directory_of(const std::filesystem::path& path) {
  const std::filesystem::path parent = path.has_parent_path() ? path.parent_path() : ".";
  const Descriptor directory(open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  // Some network file systems cannot sync a directory (EINVAL); they order renames themselves.
  if (directory.number() < 0 || (fsync(directory.number()) != 0 && errno != EINVAL)) fail_writing(parent, errno);
}

}  // namespace

Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

int write_all(int descriptor, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return 0;
}

void fail_writing(const std::filesystem::path& path, int error) {
  throw MachineError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(error)));
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
  sync_directory_of(path);
  return true;
}

NewFile::NewFile(std::filesystem::path path)
    : path_(std::move(path)),
      temporary_(path_.string() + ".tmp"),
      file_(open(temporary_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)) {
  if (file_.number() < 0) fail_writing(path_, errno);
}

NewFile::~NewFile() {
  if (!published_) unlink(temporary_.c_str());
}

void NewFile::publish() {
  if (fsync(file_.number()) != 0 || rename(temporary_.c_str(), path_.c_str()) != 0) fail_writing(path_, errno);
  published_ = true;
  sync_directory_of(path_);
}

}  // namespace graze
