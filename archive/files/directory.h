#pragma once
// A directory that is held by a descriptor. Everything in a campaign directory is opened, made, moved and removed from
// here, by one name at a time that is never a link: whatever somebody has put there, nothing outside is read or
// changed, and no pipe or device is waited for.

#include <sys/stat.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/settings/regular_file.h"
#include "engine/settings/settings.h"

namespace graze {

/// A file that the system does not give, and that may be whole all the same: the disk fails, there is no permission.
struct UnreadableFile : InputError {
  using InputError::InputError;
};
/// Throws UnreadableFile("path: cannot be read: reason of the system").
[[noreturn]] void fail_reading(const std::filesystem::path& path, int error);
/// Throws MachineError if the machine is what is short of something (descriptors, memory, its disk), else InputError:
/// "path: cannot be opened: reason of the system".
[[noreturn]] void fail_opening(const std::filesystem::path& path, int error, const char* how = "opened");
/// Throws MachineError("path: cannot be written: reason of the system").
[[noreturn]] void fail_writing(const std::filesystem::path& path, int error);

/// "000001.h5" for "000001.h5.0123456789abcdef.tmp" and for "000001.h5.tmp"; nothing for names that are not temporary.
std::optional<std::string> final_name(const std::string& name);
/// Sixteen hexadecimal digits, as such names have.
std::string random_digits();

/// Copies share the descriptor.
class Directory {
 public:
  /// The path is the user's word: links in it are followed. Throws InputError if it is no directory or may not be read.
  /// Not explicit: what works on a directory may be given a path.
  Directory(const std::filesystem::path& path);
  /// The directory that something new is to lie in. Throws MachineError, which names the new.
  static Directory of_new(const std::filesystem::path& path);

  /// As it was opened, for messages.
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

  /// What has a name here, and is no link: its status (mode 0: nothing). Throws InputError.
  struct stat status(const std::string& name) const;
  bool has(const std::string& name) const { return status(name).st_mode != 0; }
  bool has_file(const std::string& name) const { return S_ISREG(status(name).st_mode); }
  /// All names but . and .., sorted. Throws InputError.
  std::vector<std::string> names() const;

  /// A directory in this one; nothing if it is not there. Throws InputError if it is anything else.
  std::optional<Directory> find(const std::string& name) const;
  /// The same, made if it is not there; lasts through a power cut. Throws MachineError, too.
  Directory make(const std::string& name) const;

  /// Opens a file for reading; nothing if it is not there. Throws InputError if it is no regular file or may not be
  /// read.
  std::optional<Descriptor> find_file(const std::string& name) const;
  /// The same of a file that must be there.
  Descriptor open(const std::string& name) const;
  /// Opens a file to change it, made if it is not there. Throws InputError if it is no regular file, or has another
  /// name elsewhere (a hard link); MachineError.
  Descriptor open_to_change(const std::string& name, int flags) const;
  /// A new file under a temporary name that nobody could foresee. Throws MachineError, which names `name`.
  Descriptor create_temporary(const std::string& name, std::string& temporary) const;

  /// Renames within this directory, replacing what had the new name. Returns 0 or errno.
  int rename(const std::string& name, const std::string& new_name) const noexcept;
  /// The same, but EEXIST if something has the new name. Where the file system cannot rename so, a file's second name
  /// is made and the first removed; it is for files only.
  int rename_new(const std::string& name, const std::string& new_name) const noexcept;
  /// Moves whatever has the name, a link itself too. Throws MachineError.
  void move(const std::string& name, const Directory& to, const std::string& new_name) const;
  /// Removes a name that is no directory. Returns 0 or errno.
  int remove(const std::string& name) const noexcept;
  /// Removes an empty directory. Returns 0 or errno.
  int remove_empty(const std::string& name) const noexcept;
  /// Removes whatever has the name and all that is in it, as far as it is possible; links are not followed.
  void remove_all(const std::string& name) const noexcept;
  /// Removes the files here that have temporary names, as far as it is possible: leftovers, for the only
  /// writer.
  void remove_temporary() const;
  /// Makes new names here last through a power cut. Throws MachineError.
  void sync() const;

  /// Whether the path leads here still: somebody may have moved or removed the directory.
  bool in_place() const;
  /// Where it is now, if in_place() is false: "it is /x/y now" or "it was removed".
  std::string whereabouts() const;

 private:
  Directory(std::filesystem::path path, Descriptor handle);
  [[noreturn]] void refuse(const std::string& name, const std::string& kind, const char* wanted) const;
  void remove_all(const std::string& name, int depth) const;
  int number() const { return handle_->number(); }

  std::filesystem::path path_;
  std::shared_ptr<const Descriptor> handle_;
};

/// Opens a file for reading. Its last `inner` names are within a campaign directory and must be no links; those before
/// are the user's word. Throws InputError.
Descriptor open_archive_file(const std::filesystem::path& path, int inner = 0);

}  // namespace graze
