#include "engine/settings/inputs.h"

#include <fmt/format.h>

#include <cassert>
#include <filesystem>
#include <fstream>

#include "engine/settings/paths.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 30;  // 1 GiB; meshes are the largest inputs

thread_local InputRecord* recording = nullptr;
const InputReplay* replaying = nullptr;

std::string read_file(const std::string& path, const std::string& where) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status))
    throw InputError(fmt::format("{}{}: there is no such file{}", where, path, path_suggestion(path)));
  if (!fs::is_regular_file(status)) throw InputError(fmt::format("{}{}: not a file", where, path));
  const std::uintmax_t size = fs::file_size(path, error);
  if (!error && size > kMostBytes) {
    throw InputError(fmt::format("{}{}: {} bytes; at most {} are read", where, path, size, kMostBytes));
  }
  std::ifstream stream(path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  if (!stream) throw InputError(fmt::format("{}{}: cannot be read", where, path));
  return bytes;
}

}  // namespace

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
  std::error_code error;
  return fs::is_regular_file(path, error);
}

std::string read_input(const std::string& path, const std::string& where) {
  if (replaying) {
    const auto found = replaying->files_.find(input_path(path));
    if (found == replaying->files_.end()) {
      throw InputError(fmt::format("{}{}: is not among the files that the archive kept", where, path));
    }
    return found->second;
  }
  std::string bytes = read_file(path, where);
  if (recording) recording->files_[input_path(path)] = bytes;
  return bytes;
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
