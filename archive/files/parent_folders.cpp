#include "archive/files/parent_folders.h"

#include <fmt/format.h>
#include <unistd.h>

#include "archive/files/files.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

/// The folders on the way that are not there, innermost first; `there` becomes what comes before them.
std::vector<fs::path> missing_folders(const fs::path& output, fs::path& there) {
  std::error_code error;
  std::vector<fs::path> missing;
  there = folder_of(output);
  while (!fs::exists(fs::symlink_status(there, error)) && there != folder_of(there)) {
    missing.push_back(there);
    there = folder_of(there);
  }
  return missing;
}

}  // namespace

fs::path folder_of(const fs::path& output) {
  const fs::path path = output.has_filename() ? output : output.parent_path();  // "out/curb.graze/"
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

std::string cannot_make(const fs::path& output) {
  fs::path there;
  missing_folders(output, there);
  std::error_code error;
  if (!fs::is_directory(there, error)) return fmt::format("{} is no folder", there.string());
  return access(there.c_str(), W_OK | X_OK) == 0 ? "" : fmt::format("{} may not be written", there.string());
}

ParentFolders::ParentFolders(const fs::path& output) {
  fs::path there;
  std::vector<fs::path> missing = missing_folders(output, there);
  try {
    for (; !missing.empty(); missing.pop_back()) {
      make_directory(missing.back());
      made_.push_back(missing.back());
    }
  } catch (...) {
    remove_empty();
    throw;
  }
}

ParentFolders::~ParentFolders() { remove_empty(); }

void ParentFolders::remove_empty() noexcept {
  for (; !made_.empty(); made_.pop_back()) rmdir(made_.back().c_str());  // fails where something was kept
}

}  // namespace graze
