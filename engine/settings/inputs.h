#pragma once
// The files that a scenario is made of. Everything that reads one reads it here, so that a campaign can keep all of
// them (InputRecord) and be read again from what it kept, on any machine (InputReplay).

#include <map>
#include <string>

namespace graze {

/// Contents by path. Paths are absolute and normal, as on the machine where they were read.
using InputFiles = std::map<std::string, std::string>;

/// Where relative paths begin: the working directory, or the recorded one while an InputReplay is alive.
std::string input_folder();
/// `path` made absolute from input_folder(), and normal.
std::string input_path(const std::string& path);

/// Whether there is such a regular file.
bool input_exists(const std::string& path);
/// The file's bytes. `where` begins the message ("scenario.yaml:3:9: "). Throws InputError: no such file, not a file,
/// too large, cannot be read.
std::string read_input(const std::string& path, const std::string& where = "");

/// Keeps what this thread reads while it is alive. They do not nest.
class InputRecord {
 public:
  InputRecord();
  ~InputRecord();
  InputRecord(const InputRecord&) = delete;
  InputRecord& operator=(const InputRecord&) = delete;
  const InputFiles& files() const { return files_; }

 private:
  friend std::string read_input(const std::string& path, const std::string& where);
  InputFiles files_;
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
  friend std::string read_input(const std::string& path, const std::string& where);
  InputFiles files_;
  std::string folder_;
};

}  // namespace graze
