#pragma once
// The files that a scenario is made of. Everything that reads one reads it here, so that a campaign can keep all of
// them (InputRecord) and be read again from what it kept, on any machine (InputReplay).

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/settings/limits.h"

namespace graze {

/// Contents by path. Paths are absolute and normal, as on the machine where they were read.
using InputFiles = std::map<std::string, std::string>;

/// Where relative paths begin: the working directory, or the recorded one while an InputReplay is alive.
std::string input_folder();
/// `path` made absolute from input_folder(), and normal.
std::string input_path(const std::string& path);

/// Whether there is such a regular file.
bool input_exists(const std::string& path);
/// One name for all the names of a file: two paths lead to the same file if and only if these are equal.
std::string input_identity(const std::string& path);
/// The file's bytes, at most `most` of them. Only regular files are read, and none is waited for. `where` begins the
/// message ("scenario.yaml:3:9: "). Throws InputError: no such file, links in a circle, not a file, too large, cannot
/// be read.
std::string read_input(const std::string& path, const std::string& where = "", std::size_t most = kMaxInputBytes);

/// A variable of the environment, or "": kept and replayed as a file under the name "$NAME".
std::string input_variable(const std::string& name);

/// What this machine makes of a file by `make`, kept and replayed as a file under the name `name`; nothing where `make`
/// gives nothing. A replay never calls it.
std::optional<std::string> derived_input(const std::string& name,
                                         const std::function<std::optional<std::string>()>& make);

/// What a name in `include` means where no file of that name is: the path of one, or nothing. For the whole process; at
/// first no name means anything.
using IncludeMeaning = std::function<std::optional<std::string>(const std::string& name)>;
void mean_includes(IncludeMeaning meaning);
/// The same, kept and replayed as derived_input() does beside `path`, which is not there.
std::optional<std::string> meant_include(const std::string& name, const std::string& path);
/// Whether an input is a note of meant_include().
bool is_meant_include(const std::string& input);

/// The names in a folder, but those of folders, that are `wanted`, in order; none if there is no such folder. Hidden
/// ones are left out. Of more than `most` the rest may be missing. A replay knows of those that were read. Throws
/// InputError if the folder cannot be looked into.
std::vector<std::string> input_files_in(const std::string& folder,
                                        const std::function<bool(const std::string&)>& wanted, std::size_t most);

/// The file name that stands for standard input.
inline constexpr const char* kStandardInput = "-";
/// All of standard input, kept and replayed under that name as a file. Throws InputError: too large.
std::string read_standard_input();

/// Keeps what this thread reads while it is alive, up to kMaxAllInputBytes. They do not nest.
class InputRecord {
 public:
  InputRecord();
  ~InputRecord();
  InputRecord(const InputRecord&) = delete;
  InputRecord& operator=(const InputRecord&) = delete;
  const InputFiles& files() const { return files_; }

 private:
  friend std::string read_input(const std::string& path, const std::string& where, std::size_t most);
  /// Throws InputError when they become too many bytes.
  void keep(const std::string& path, const std::string& bytes, const std::string& where);
  friend std::string read_standard_input();
  friend std::string input_variable(const std::string& name);
  friend std::optional<std::string> derived_input(const std::string& name,
                                                  const std::function<std::optional<std::string>()>& make);
  InputFiles files_;
  std::size_t bytes_ = 0;
};

/// While it is alive all threads read from `files` and from nowhere else. They do not nest; no other thread reads while
/// one begins or ends.
class InputReplay {
 public:
  InputReplay(InputFiles files, std::string folder);
  ~InputReplay();
  InputReplay(const InputReplay&) = delete;
  InputReplay& operator=(const InputReplay&) = delete;

 private:
  friend std::string input_folder();
  friend bool input_exists(const std::string& path);
  friend std::string input_identity(const std::string& path);
  friend std::string read_input(const std::string& path, const std::string& where, std::size_t most);
  friend std::string input_variable(const std::string& name);
  friend std::optional<std::string> derived_input(const std::string& name,
                                                  const std::function<std::optional<std::string>()>& make);
  friend std::vector<std::string> input_files_in(const std::string& folder,
                                                 const std::function<bool(const std::string&)>& wanted,
                                                 std::size_t most);
  InputFiles files_;
  std::string folder_;
};

}  // namespace graze
