#pragma once
// Folders that appear whole or not at all, as NewFile's files do.

#include <filesystem>
#include <system_error>

#include "archive/files/directory.h"

namespace graze {

/// A folder under a temporary name beside its own, "NAME.0123456789abcdef.tmp"; removed again, with what is in it,
/// unless it is published.
class NewFolder {
 public:
  /// Removes what processes that were killed have left of the same name; what another one fills still is locked, and
  /// stays. Throws MachineError.
  explicit NewFolder(const std::filesystem::path& folder);
  ~NewFolder();
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;
  const std::filesystem::path& path() const { return temporary_; }
  /// Gives it its name, which nothing but an empty folder may have.
  std::error_code publish();

 private:
  std::filesystem::path folder_, temporary_;
  Descriptor lock_;
  bool published_ = false;
};

}  // namespace graze
