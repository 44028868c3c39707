#pragma once
// Files that appear whole or not at all: written under a temporary name, synced, renamed, the directory synced.

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "archive/files/directory.h"

namespace graze {

/// Writes everything at the descriptor's position. Returns 0 or errno.
int write_all(int descriptor, std::span<const std::byte> bytes);

/// How a command line says which file is to be written: by --output, or by one of its words.
enum class NamedBy { output, word };

/// Before a file is made of archives or other files: throws InputError if something of its name is there already that
/// is no file, or that must stay (unless `force`), or if it is one of those that it is made of, or lies within one.
void check_new_file(const std::filesystem::path& file, bool force, const std::vector<std::filesystem::path>& made_of,
                    NamedBy named = NamedBy::output);

/// ".h5" of "out/A.H5", ".h5" and "a.h5/": what kind of file the name of an output means, in small letters; "" if it
/// has no ending.
std::string ending_of(const std::filesystem::path& output);

/// Throws InputError if the name of an output ends as that of another kind of file: ".csv" where `right` (".h5", of
/// what `what` says: "a packed campaign is one HDF5 file") belongs; if it is such an ending and nothing else; or if a
/// slash behind it makes a directory of what is a file. Endings that no kind of file has are the user's business, and
/// so is a name without any, unless one is needed; `only`: no other ending will do.
enum class Endings { free, needed, only };
void check_ending(const std::filesystem::path& output, const std::string& what, const std::vector<std::string>& right,
                  Endings endings = Endings::free, NamedBy named = NamedBy::output);

/// Creates a directory, if it is not there; its parent must be. Returns whether it did. Throws MachineError.
bool make_directory(const std::filesystem::path& path);

/// Removes temporary files of `name` that nobody has locked: what processes that were killed have left.
void remove_abandoned(const Directory& folder, const std::string& name);

/// A new file under a temporary name of its own; removed again unless it is published.
class NewFile {
 public:
  /// Throws MachineError.
  NewFile(Directory folder, std::string name);
  /// Beside the user's files: removes what processes that were killed have left of the same name. What another process
  /// writes still is locked, and stays. Without `force` it takes no other file's place, not even one's that appears
  /// before publish().
  NewFile(const std::filesystem::path& path, bool force);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  int descriptor() const { return file_.number(); }
  /// Syncs and gives the file its name, replacing what had it, if it may. Throws MachineError, InputError if it may
  /// not.
  void publish();

 private:
  Directory folder_;
  std::string name_, temporary_;
  Descriptor file_;
  bool force_ = true;
  bool published_ = false;
};

}  // namespace graze
