#pragma once
// The folders that lead to an output.

#include <filesystem>
#include <string>
#include <vector>

namespace graze {

/// The folder that an output is to lie in.
std::filesystem::path folder_of(const std::filesystem::path& output);

/// Why no file or directory can be made at `output`, even if missing folders are made first: what is there on the way
/// is no folder, or may not be written. Empty: it can.
std::string cannot_make(const std::filesystem::path& output);

/// Makes the folders that are missing on the way to `output`. Those that it has made and that are empty when it goes
/// are removed again: nothing was kept there.
class ParentFolders {
 public:
  /// Throws MachineError.
  explicit ParentFolders(const std::filesystem::path& output);
  ~ParentFolders();
  ParentFolders(const ParentFolders&) = delete;
  ParentFolders& operator=(const ParentFolders&) = delete;

 private:
  void remove_empty() noexcept;
  std::vector<std::filesystem::path> made_;  // outermost first
};

}  // namespace graze
