#pragma once
// One writer per campaign directory. The lock is one of the operating system (on the open file `lock`), so it ends with
// the process that held it, however that died; a file that is left over locks nobody out.

#include <filesystem>
#include <optional>
#include <string>

#include "archive/files.h"

namespace graze {

inline constexpr const char* kLockFile = "lock";

class DirectoryLock {
 public:
  /// Throws MachineError if another process writes there (its host, process and start are named), or the file cannot be
  /// made.
  explicit DirectoryLock(const std::filesystem::path& directory);
  /// Removes the file.
  ~DirectoryLock();
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;

 private:
  std::filesystem::path path_;
  Descriptor file_;
};

/// Who writes into a directory now ("process 4711 on node3 since 2026-01-01T12:00:00Z"), if anybody does.
std::optional<std::string> writer_of(const std::filesystem::path& directory);

}  // namespace graze
