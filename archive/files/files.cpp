#include "archive/files/files.h"

#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>

#include "engine/settings/settings.h"

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

void check_new_file(const std::filesystem::path& file, bool force, const std::vector<std::filesystem::path>& made_of,
                    NamedBy named) {
  namespace fs = std::filesystem;
  const char* const other_name = named == NamedBy::output ? "another --output" : "another name";
  std::error_code error;
  const fs::path full = fs::weakly_canonical(file, error);
  for (const fs::path& source : made_of) {
    const fs::path other = fs::weakly_canonical(source, error);
    if (std::mismatch(other.begin(), other.end(), full.begin(), full.end()).first != other.end()) continue;
    throw InputError(fmt::format("{}: {} {}, which is only read; choose {}", file.string(),
                                 full == other ? "is" : "lies within", source.string(), other_name));
  }
  if (!fs::exists(file, error)) {
    if (force || !fs::is_symlink(fs::symlink_status(file, error))) return;
    throw InputError(fmt::format(
        "{}: is a symbolic link that leads nowhere; choose {}, or give --force to put the file in its place",
        file.string(), other_name));
  }
  if (!fs::is_regular_file(file, error)) {
    throw InputError(fmt::format("{}: is a directory or a device; choose {}", file.string(), other_name));
  }
  if (!force) {
    throw InputError(fmt::format("{}: exists already; choose {} or give --force", file.string(), other_name));
  }
}

namespace {

/// "a.h5" of "a.h5/".
std::filesystem::path without_slashes(const std::filesystem::path& path) {
  std::string text = path.string();
  while (text.size() > 1 && text.back() == '/') text.pop_back();
  return text;
}

/// ".h5 or .hdf5" behind a name.
std::string with_endings(const std::filesystem::path& name, const std::vector<std::string>& endings) {
  std::string out;
  for (const std::string& one : endings) {
    out += (out.empty() ? "" : " or ") + std::filesystem::path(name).replace_extension(one).string();
  }
  return out;
}

}  // namespace

std::string ending_of(const std::filesystem::path& output) {
  const std::filesystem::path name = without_slashes(output).filename();
  // The library knows no ending of ".h5": to it that is a hidden file's name.
  std::string ending = (name.has_extension() || name == "." || name == ".." ? name.extension() : name).string();
  if (!ending.starts_with('.')) return "";
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

void check_ending(const std::filesystem::path& output, const std::string& what, const std::vector<std::string>& right,
                  Endings endings, NamedBy by) {
  static const std::vector<std::string> known = {
      ".graze", ".h5",  ".hdf5", ".hdf", ".csv", ".tsv", ".txt",     ".json", ".jsonl",  ".yaml", ".yml", ".xml",
      ".urdf",  ".obj", ".stl",  ".dae", ".ply", ".log", ".npy",     ".npz",  ".mat",    ".nc",   ".zip", ".tar",
      ".gz",    ".pdf", ".png",  ".md",  ".py",  ".sh",  ".parquet", ".xlsx", ".sbatch", ".html", ".htm"};
  const std::string ending = ending_of(output);
  const std::string name = (by == NamedBy::output ? "--output " : "") + output.string();
  const auto within = [&](const std::vector<std::string>& list) {
    return std::find(list.begin(), list.end(), ending) != list.end();
  };
  const std::filesystem::path named = without_slashes(output);
  const bool slash = named != output, folders = std::find(right.begin(), right.end(), ".graze") != right.end();
  if (!within(known)) {
    const bool foreign = endings == Endings::only && !slash && !within(right);
    const bool folder = named.filename() == "." || named.filename() == "..";
    if (!folder && (foreign || (endings != Endings::free && ending.empty() && !slash))) {
      const std::string found = ending.empty() ? "has no ending" : "ends in " + ending;
      // A name's last dot need not begin an ending: "p.1" is "p.1.h5".
      throw InputError(fmt::format("{}: {}, but {}; nearest right answer: {}", name, found, what,
                                   with_endings(named.string() + ".", right)));
    }
    if (!slash || folders) return;
    const std::string last = named.filename().string();
    throw InputError(fmt::format("{}: ends in a slash, but {}; nearest right answer: {}", name, what,
                                 with_endings(last == "." || last == ".." ? named / "campaign" : named, right)));
  }
  if (!named.has_extension()) {
    throw InputError(fmt::format("{}: is an ending without a name; nearest right answer: {}", name,
                                 with_endings(named.parent_path() / "campaign", right)));
  }
  if (!within(right)) {
    throw InputError(fmt::format("{}: ends in {}, but {}; nearest right answer: {}", name, ending, what,
                                 with_endings(named, right)));
  }
  if (slash && ending != ".graze") {
    throw InputError(fmt::format("{}: ends in a slash, but {} is a file's ending; nearest right answer: {}", name,
                                 ending, named.string()));
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

// Only names with the random digits count: others are the user's.
void remove_abandoned(const Directory& folder, const std::string& name) {
  try {
    for (const std::string& one : folder.names()) {
      if (final_name(one) != name || one == name + ".tmp" || !folder.has_file(one)) continue;
      const auto file = folder.find_file(one);
      if (file && flock(file->number(), LOCK_EX | LOCK_NB) == 0) folder.remove(one);
    }
  } catch (const InputError&) {
    // A folder that may be written and not listed: leftovers stay.
  }
}

NewFile::NewFile(Directory folder, std::string name)
    : folder_(std::move(folder)), name_(std::move(name)), file_(folder_.create_temporary(name_, temporary_)) {}

NewFile::NewFile(const std::filesystem::path& path, bool force)
    : NewFile(Directory::of_new(path), path.filename().string()) {
  force_ = force;
  // The lock ends with its process. Where there are no locks, what is left over stays.
  flock(file_.number(), LOCK_EX | LOCK_NB);
  remove_abandoned(folder_, name_);
}

NewFile::~NewFile() {
  if (!published_) folder_.remove(temporary_);
}

void NewFile::publish() {
  if (fsync(file_.number()) != 0) fail_writing(folder_ / name_, errno);
  const int error = force_ ? folder_.rename(temporary_, name_) : folder_.rename_new(temporary_, name_);
  if (error == EEXIST) {
    throw InputError(
        fmt::format("{}: has appeared while its content was being made, and stays as it is; choose another name or "
                    "give --force",
                    (folder_ / name_).string()));
  }
  if (error != 0) fail_writing(folder_ / name_, error);
  published_ = true;
  folder_.sync();
}

}  // namespace graze
