#pragma once
// Files that appear whole or not at all: written under a temporary name, synced, renamed, the directory synced.

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace graze {

/// Owns a POSIX file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor();
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

/// Writes everything at the descriptor's position. Returns 0 or errno.
int write_all(int descriptor, std::span<const std::byte> bytes);

/// Throws MachineError("path: cannot be written: reason of the system").
[[noreturn]] void fail_writing(const std::filesystem::path& path, int error);

/// Creates a directory, if it is not there; its parent must be. Throws MachineError.
void make_directory(const std::filesystem::path& path);

/// A new file under its temporary name, `path` + ".tmp"; removed again unless it is published.
class NewFile {
 public:
  /// Throws MachineError.
  explicit NewFile(std::filesystem::path path);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  int descriptor() const { return file_.number(); }
  /// Syncs and gives the file its name, replacing what had it. Throws MachineError.
  void publish();

 private:
  std::filesystem::path path_, temporary_;
  Descriptor file_;
  bool published_ = false;
};

}  // namespace graze
