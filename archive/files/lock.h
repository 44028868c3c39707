#pragma once
// One writer per campaign directory: a process, or the ranks of one job. The locks are the operating system's (on the
// open file `lock`), so they end with the process that held them, however that died; a file that is left over locks
// nobody out.

#include <filesystem>
#include <optional>
#include <string>

#include "archive/files/directory.h"

namespace graze {

inline constexpr const char* kLockFile = "lock";

/// Held by the process that leads.
class DirectoryLock {
 public:
  /// Throws MachineError if another process or a rank that it has left behind writes there (its host, process and start
  /// are named), or the file cannot be made. A file system without locks leaves it to the user that only one writes.
  explicit DirectoryLock(Directory directory);
  /// Removes the file.
  ~DirectoryLock();
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;
  const Directory& directory() const { return directory_; }
  /// Whether the file that is locked still has its name: removing it lets a second writer in.
  bool held() const noexcept;
  /// Throws MachineError unless held().
  void check_held() const;

 private:
  Directory directory_;
  Descriptor file_;
};

/// Held by each of the other ranks, so that nobody takes a directory over while one of them still writes.
class MemberLock {
 public:
  /// Throws MachineError if nobody leads.
  explicit MemberLock(const Directory& directory);
  /// As DirectoryLock's: whether the file in which the leader and this rank have their locks still has its name.
  void check_held() const;

 private:
  Directory directory_;
  Descriptor file_;
};

/// The process that writes into a directory now ("process 4711 on node3 since 2026-01-01T12:00:00Z"), if any does.
/// Throws InputError.
std::optional<std::string> writer_of(const Directory& directory);

/// Tries locks in a directory, on a file that stays there: empty if the second of two that exclude each other is
/// refused, else why not: "this file system has no locks (No locks available)". Throws InputError, MachineError.
std::string why_no_locks(const Directory& directory);

}  // namespace graze
