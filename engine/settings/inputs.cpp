#include "engine/settings/inputs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>

#include "engine/settings/nul.h"
#include "engine/settings/paths.h"
#include "engine/settings/regular_file.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

namespace fs = std::filesystem;

thread_local InputRecord* recording = nullptr;
const InputReplay* replaying = nullptr;

/// A file that is being read, for one message of each kind.
/// A name without an ending is a scenario's.
std::vector<std::string> kinds_meant(const std::string& path) {
  return fs::path(path).has_extension() ? std::vector<std::string>() : std::vector<std::string>{".yaml", ".yml"};
}

class InputFile {
 public:
  InputFile(const std::string& path, const std::string& where, std::size_t most)
      : path_(path), where_(where), most_(most) {
    if (has_nul(path))
      fail("the name of a file has no NUL character (\\0)");  // the system would take what is before it
    OpenedFile opened = open_regular(AT_FDCWD, path.c_str(), O_RDONLY, Links::followed);
    if (opened.error != 0) cannot_open(opened.error);
    if (opened.refused == kind_of(S_IFDIR)) fail("not a file, but a folder" + scenario_within());
    if (!opened.refused.empty()) fail("not a file: only regular files are read, no devices, pipes or sockets");
    struct stat status {};
    if (fstat(opened.file.number(), &status) != 0) cannot_open(errno);
    size_ = static_cast<std::size_t>(status.st_size);
    if (size_ > most_) fail(fmt::format("{} bytes; at most {} are read", size_, bytes_in_words(most_)));
    file_ = std::move(opened.file);
  }

  /// The scenario that a folder on the command line is named for, as `graze new` makes them.
  std::string scenario_within() const {
    const fs::path inside = fs::path(path_) / "scenario.yaml";
    std::error_code error;
    const bool meant = where_.empty() && fs::is_regular_file(inside, error);
    return meant ? fmt::format("; did you mean '{}'?", inside.string()) : "";
  }

  /// To its end, whatever its size says: files of the system have none, files that grow have another.
  std::string read_all() const {
    std::string bytes;
    bytes.reserve(size_);
    std::array<char, 1 << 16> piece;
    while (true) {
      const ssize_t got = read(file_.number(), piece.data(), piece.size());
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) fail(fmt::format("cannot be read: {}", std::strerror(errno)));
      if (got == 0) return bytes;
      bytes.append(piece.data(), static_cast<std::size_t>(got));
      if (bytes.size() > most_) fail(fmt::format("more than {}; no more are read", bytes_in_words(most_)));
    }
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    throw InputError(fmt::format("{}{}: {}", where_, path_, message));
  }

  [[noreturn]] void cannot_open(int error) const {
    if (const std::string why = why_no_file(path_); !why.empty()) fail(why);
    if (error == ENOENT || error == ENOTDIR) fail("there is no such file" + path_suggestion(path_, kinds_meant(path_)));
    fail(fmt::format("cannot be opened: {}", std::strerror(error)));
  }

  const std::string &path_, &where_;
  std::size_t most_, size_ = 0;
  Descriptor file_;
};

}  // namespace

std::string bytes_in_words(std::size_t bytes) {
  const bool whole = bytes >= (1u << 20) && bytes % (1u << 20) == 0;
  return whole ? fmt::format("{} MiB", bytes >> 20) : fmt::format("{} bytes", bytes);
}

std::string input_folder() {
  if (replaying) return replaying->folder_;
  std::error_code error;
  return fs::current_path(error).string();
}

std::string input_path(const std::string& path) {
  return (fs::path(input_folder()) / path).lexically_normal().string();
}

bool input_exists(const std::string& path) {
  if (replaying) return replaying->files_.count(input_path(path)) > 0;
  if (has_nul(path)) return false;
  std::error_code error;
  return fs::is_regular_file(path, error);
}

std::string input_identity(const std::string& path) {
  if (replaying) return input_path(path);
  if (has_nul(path)) return path;  // of no file
  std::error_code error;
  const fs::path real = fs::canonical(path, error);
  return error ? input_path(path) : real.string();
}

std::string read_input(const std::string& path, const std::string& where, std::size_t most) {
  if (replaying) {
    const auto found = replaying->files_.find(input_path(path));
    if (found == replaying->files_.end()) {
      throw InputError(fmt::format("{}{}: is not among the files that the archive kept", where, path));
    }
    if (found->second.size() > most) {
      throw InputError(
          fmt::format("{}{}: {} bytes; at most {} are read", where, path, found->second.size(), bytes_in_words(most)));
    }
    return found->second;
  }
  std::string bytes = InputFile(path, where, most).read_all();
  if (recording) recording->keep(path, bytes, where);
  return bytes;
}

void InputRecord::keep(const std::string& path, const std::string& bytes, const std::string& where) {
  const auto [place, fresh] = files_.try_emplace(input_path(path));
  bytes_ += bytes.size() - place->second.size();
  if (bytes_ > kMaxAllInputBytes) {
    throw InputError(fmt::format("{}{}: with it, the files that the scenario names have {} bytes; at most {} in all",
                                 where, path, bytes_, bytes_in_words(kMaxAllInputBytes)));
  }
  place->second = bytes;
}

std::string read_standard_input() {
  if (replaying) return read_input(kStandardInput);
  std::string bytes;
  for (char buffer[1 << 14]; std::cin.read(buffer, sizeof buffer) || std::cin.gcount() > 0;) {
    bytes.append(buffer, static_cast<std::size_t>(std::cin.gcount()));
    if (bytes.size() > kMaxBytes) {
      throw InputError(fmt::format("standard input: more than {} bytes; at most that many are read", kMaxBytes));
    }
  }
  if (recording) recording->keep(kStandardInput, bytes, "");
  return bytes;
}

std::string input_variable(const std::string& name) {
  const std::string key = "$" + name;
  if (replaying) {
    const auto found = replaying->files_.find(input_path(key));
    return found == replaying->files_.end() ? "" : found->second;
  }
  const char* const value = std::getenv(name.c_str());
  if (value && recording) recording->keep(key, value, "");
  return value ? value : "";
}

std::optional<std::string> derived_input(const std::string& name,
                                         const std::function<std::optional<std::string>()>& make) {
  if (replaying) {
    const auto found = replaying->files_.find(input_path(name));
    return found == replaying->files_.end() ? std::nullopt : std::optional(found->second);
  }
  auto made = make();
  if (made && recording) recording->keep(name, *made, "");
  return made;
}

namespace {

constexpr const char* kMeant = ".meant";  // behind the name of an include that is no file

IncludeMeaning& meaning_of_includes() {
  static IncludeMeaning meaning;
  return meaning;
}

}  // namespace

void mean_includes(IncludeMeaning meaning) { meaning_of_includes() = std::move(meaning); }

std::optional<std::string> meant_include(const std::string& name, const std::string& path) {
  return derived_input(path + kMeant, [&]() -> std::optional<std::string> {
    const IncludeMeaning& meaning = meaning_of_includes();
    return meaning ? meaning(name) : std::nullopt;
  });
}

bool is_meant_include(const std::string& input) { return input.ends_with(kMeant); }

std::vector<std::string> input_files_in(const std::string& folder,
                                        const std::function<bool(const std::string&)>& wanted, std::size_t most) {
  std::vector<std::string> out;
  const auto take = [&](const fs::path& file) {
    const std::string name = file.filename().string();
    if (!name.starts_with('.') && wanted(name)) out.push_back(name);
  };
  if (replaying) {
    for (const auto& [path, bytes] : replaying->files_) {
      if (fs::path(path).parent_path() == input_path(folder)) take(path);
    }
  } else if (!has_nul(folder)) {
    std::error_code error;
    for (fs::directory_iterator at(folder, error), end; !error && at != end && out.size() <= most;
         at.increment(error)) {
      std::error_code unknown;
      if (!at->is_directory(unknown)) take(at->path());  // whoever reads what is no file tells so
    }
    if (error && error != std::errc::no_such_file_or_directory && error != std::errc::not_a_directory) {
      throw InputError(fmt::format("{}: cannot be looked into: {}", folder, error.message()));
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

InputRecord::InputRecord() {
  assert(!recording);
  recording = this;
}
InputRecord::~InputRecord() { recording = nullptr; }

InputReplay::InputReplay(InputFiles files, std::string folder) : files_(std::move(files)), folder_(std::move(folder)) {
  assert(!replaying);
  replaying = this;
}
InputReplay::~InputReplay() { replaying = nullptr; }

}  // namespace graze
