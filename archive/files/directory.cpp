#include "archive/files/directory.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cstring>
#include <random>

#include "engine/settings/settings.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTemporary = ".tmp";
constexpr std::size_t kRandomDigits = 16;

int open_directory(int folder, const char* name, int more) {
  return openat(folder, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NONBLOCK | more);
}

/// Lists a directory; closes it.
struct Listing {
  explicit Listing(int descriptor) : stream(fdopendir(descriptor)) {
    if (stream == nullptr && descriptor >= 0) close(descriptor);
  }
  ~Listing() {
    if (stream != nullptr) closedir(stream);
  }
  Listing(const Listing&) = delete;
  Listing& operator=(const Listing&) = delete;
  DIR* stream;
};

}  // namespace

void fail_reading(const fs::path& path, int error) {
  throw UnreadableFile(fmt::format("{}: cannot be read: {}", path.string(), std::strerror(error)));
}

void fail_opening(const fs::path& path, int error, const char* how) {
  const std::string text = fmt::format("{}: cannot be {}: {}", path.string(), how, std::strerror(error));
  if (error == EMFILE || error == ENFILE || error == ENOMEM || error == EIO) throw MachineError(text);
  throw InputError(text);
}

void fail_writing(const fs::path& path, int error) {
  throw MachineError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(error)));
}

std::string random_digits() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", random(), random());
}

std::optional<std::string> final_name(const std::string& name) {
  if (!name.ends_with(kTemporary)) return std::nullopt;
  std::string out = name.substr(0, name.size() - std::strlen(kTemporary));
  const std::size_t dot = out.rfind('.');
  if (dot != std::string::npos && out.size() - dot - 1 == kRandomDigits &&
      out.find_first_not_of("0123456789abcdef", dot + 1) == std::string::npos) {
    out.resize(dot);
  }
  return out;
}

Directory::Directory(const fs::path& path) : path_(path) {
  Descriptor handle(open_directory(AT_FDCWD, path.c_str(), 0));
  if (!handle && errno == ENOTDIR) throw InputError(fmt::format("{}: is no directory", path.string()));
  if (!handle) fail_opening(path, errno);
  handle_ = std::make_shared<const Descriptor>(std::move(handle));
}

Directory Directory::of_new(const fs::path& path) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
  Descriptor handle(open_directory(AT_FDCWD, folder.c_str(), 0));
  if (!handle) fail_writing(path, errno);
  return Directory(folder, std::move(handle));
}

Directory::Directory(fs::path path, Descriptor handle)
    : path_(std::move(path)), handle_(std::make_shared<const Descriptor>(std::move(handle))) {}

void Directory::refuse(const std::string& name, const std::string& kind, const char* wanted) const {
  throw InputError(fmt::format(
      "{}: is {}; in a campaign directory only {} may have this name, so that nothing outside of it is read "
      "or changed",
      (path_ / name).string(), kind, wanted));
}

struct stat Directory::status(const std::string& name) const {
  struct stat found {};
  if (fstatat(number(), name.c_str(), &found, AT_SYMLINK_NOFOLLOW) == 0) return found;
  if (errno != ENOENT) fail_reading(path_ / name, errno);
  return {};
}

std::vector<std::string> Directory::names() const {
  const auto fail = [this](int error) { fail_opening(path_, error, "listed"); };
  const int handle = open_directory(number(), ".", 0);
  if (handle < 0) fail(errno);
  const Listing listing(handle);
  if (listing.stream == nullptr) fail(errno);
  std::vector<std::string> out;
  while (true) {
    errno = 0;
    const dirent* entry = readdir(listing.stream);
    if (entry == nullptr && errno != 0) fail(errno);
    if (entry == nullptr) break;
    const std::string name = static_cast<const char*>(entry->d_name);
    if (name != "." && name != "..") out.push_back(name);
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::optional<Directory> Directory::find(const std::string& name) const {
  const struct stat found = status(name);
  if (found.st_mode == 0) return std::nullopt;
  if (!S_ISDIR(found.st_mode)) refuse(name, kind_of(found.st_mode), "a directory");
  Descriptor handle(open_directory(number(), name.c_str(), O_NOFOLLOW));
  if (!handle && (errno == ELOOP || errno == ENOTDIR)) refuse(name, "no directory", "a directory");  // just exchanged
  if (!handle) fail_opening(path_ / name, errno);
  return Directory(path_ / name, std::move(handle));
}

Directory Directory::make(const std::string& name) const {
  if (mkdirat(number(), name.c_str(), 0777) == 0) {
    sync();
  } else if (errno != EEXIST) {
    fail_writing(path_ / name, errno);
  }
  if (auto made = find(name)) return std::move(*made);
  fail_writing(path_ / name, ENOENT);
}

std::optional<Descriptor> Directory::find_file(const std::string& name) const {
  OpenedFile opened = open_regular(number(), name.c_str(), O_RDONLY, Links::refused);
  if (!opened.refused.empty()) refuse(name, opened.refused, "a file");
  if (opened.error == ENOENT) return std::nullopt;
  if (opened.error == ELOOP) refuse(name, "a symbolic link", "a file");  // just exchanged
  if (opened.error != 0) fail_reading(path_ / name, opened.error);
  return std::move(opened.file);
}

Descriptor Directory::open(const std::string& name) const {
  auto found = find_file(name);
  if (!found) throw InputError(fmt::format("{}: is not there", (path_ / name).string()));
  return std::move(*found);
}

Descriptor Directory::open_to_change(const std::string& name, int flags) const {
  OpenedFile opened = open_regular(number(), name.c_str(), flags | O_CREAT, Links::refused);
  if (opened.error == ELOOP) opened.refused = "a symbolic link";  // just exchanged
  if (!opened.refused.empty()) refuse(name, opened.refused, "a file");
  if (opened.error != 0) fail_writing(path_ / name, opened.error);
  struct stat found {};
  if (fstat(opened.file.number(), &found) != 0) fail_writing(path_ / name, errno);
  if (found.st_nlink > 1) {
    throw InputError(fmt::format(
        "{}: has another name elsewhere (a hard link), and what is written here would change that; remove it",
        (path_ / name).string()));
  }
  return std::move(opened.file);
}

Descriptor Directory::create_temporary(const std::string& name, std::string& temporary) const {
  constexpr int kTries = 100;
  constexpr std::size_t kLongest = NAME_MAX - kRandomDigits - 5;  // two dots and "tmp"
  for (int i = 0; i < kTries; ++i) {
    temporary = fmt::format("{}.{}{}", name.substr(0, kLongest), random_digits(), kTemporary);
    Descriptor file(openat(number(), temporary.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666));
    if (file) return file;
    if (errno != EEXIST) break;
  }
  fail_writing(path_ / name, errno);
}

int Directory::rename(const std::string& name, const std::string& new_name) const noexcept {
  return renameat(number(), name.c_str(), number(), new_name.c_str()) == 0 ? 0 : errno;
}

int Directory::rename_new(const std::string& name, const std::string& new_name) const noexcept {
  if (renameat2(number(), name.c_str(), number(), new_name.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  if (linkat(number(), name.c_str(), number(), new_name.c_str(), 0) != 0) return errno;
  remove(name);
  return 0;
}

void Directory::move(const std::string& name, const Directory& to, const std::string& new_name) const {
  if (renameat(number(), name.c_str(), to.number(), new_name.c_str()) == 0) return;
  throw MachineError(fmt::format("{}: cannot be moved: {}", (path_ / name).string(), std::strerror(errno)));
}

int Directory::remove(const std::string& name) const noexcept {
  return unlinkat(number(), name.c_str(), 0) == 0 ? 0 : errno;
}

int Directory::remove_empty(const std::string& name) const noexcept {
  return unlinkat(number(), name.c_str(), AT_REMOVEDIR) == 0 ? 0 : errno;
}

void Directory::remove_all(const std::string& name) const noexcept {
  constexpr int kDeepest = 8;  // a campaign has three levels
  try {
    remove_all(name, kDeepest);
  } catch (const std::exception&) {
    // What cannot be listed stays.
  }
}

void Directory::remove_all(const std::string& name, int depth) const {
  if (remove(name) == 0 || depth == 0) return;
  struct statx found {};
  const bool known = statx(number(), name.c_str(), AT_SYMLINK_NOFOLLOW | AT_NO_AUTOMOUNT, STATX_TYPE, &found) == 0;
  if (!known || !S_ISDIR(found.stx_mode)) return;
  if ((found.stx_attributes & STATX_ATTR_MOUNT_ROOT) != 0) return;  // what is mounted there lies outside
  if (const auto folder = find(name)) {
    for (const std::string& entry : folder->names()) folder->remove_all(entry, depth - 1);
  }
  remove_empty(name);
}

void Directory::remove_temporary() const {
  for (const std::string& name : names()) {
    if (final_name(name)) remove(name);
  }
}

void Directory::sync() const {
  // Some network file systems cannot sync a directory (EINVAL); they order renames themselves.
  if (fsync(number()) != 0 && errno != EINVAL) fail_writing(path_, errno);
}

bool Directory::in_place() const {
  struct stat named {
  }, held{};
  if (fstat(number(), &held) != 0) return true;  // nothing is known
  if (stat(path_.c_str(), &named) != 0) return errno != ENOENT && errno != ENOTDIR && errno != ESTALE;
  return named.st_ino == held.st_ino && named.st_dev == held.st_dev;
}

std::string Directory::whereabouts() const {
  struct stat held {};
  std::array<char, PATH_MAX> now{};
  const ssize_t size = readlink(fmt::format("/proc/self/fd/{}", number()).c_str(), now.data(), now.size() - 1);
  const bool gone = fstat(number(), &held) != 0 || held.st_nlink == 0;
  return gone || size <= 0 ? "it was removed" : fmt::format("it is {} now", now.data());
}

Descriptor open_archive_file(const fs::path& path, int inner) {
  if (inner > 0) {
    fs::path outer = path;
    std::vector<std::string> names;
    for (int i = 0; i < inner; ++i, outer = outer.parent_path()) names.push_back(outer.filename().string());
    Directory folder(outer.empty() ? fs::path(".") : outer);
    for (; names.size() > 1; names.pop_back()) {
      auto next = folder.find(names.back());
      if (!next) throw InputError(fmt::format("{}: is not there", path.string()));
      folder = std::move(*next);
    }
    return folder.open(names.back());
  }
  OpenedFile opened = open_regular(AT_FDCWD, path.c_str(), O_RDONLY, Links::followed);
  if (!opened.refused.empty()) throw InputError(fmt::format("{}: is {}, not a file", path.string(), opened.refused));
  if (opened.error != 0) fail_reading(path, opened.error);
  return std::move(opened.file);
}

}  // namespace graze
