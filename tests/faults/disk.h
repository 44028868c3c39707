#pragma once
// A disk that loses its power. It is told every change that was made to a folder, and says what may be there after a
// power cut at that moment. What a program was promised by fsync is there, of all else anything:
//
// - Bytes of a file that it was not synced after may be lost, one write and not the other: then there is what was there
//   before, zeros where there was nothing, or no length at all.
// - A change of a directory (a name that comes, goes, or is given to another file) may be lost until the directory was
//   synced after it, in any order, whatever came later; a rename happens wholly or not at all, and is safe when the
//   directory that the new name lies in was synced.
//
// That is more than file systems do today (ext4, XFS and btrfs keep the order of changes of directories), and about
// what POSIX lets them.

#include <cstdint>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tests/faults/stage.h"

namespace graze::faults {

class Disk {
 public:
  /// All of `folder`, which is at `root`, safe on the disk. The inodes are those of the real files.
  explicit Disk(const fs::path& root);

  void apply(const Change& change);

  /// How much of what is not safe has got to the disk.
  enum class Luck {
    none,      // nothing
    all,       // everything, as if the power had not failed
    names,     // all changes of directories, but no bytes: files that have a name and are empty
    zeros,     // the same, but files have their lengths: zeros
    in_order,  // changes of directories up to some moment, and no bytes
    any        // any of it
  };
  /// What is there after a power cut now.
  Tree after_power_cut(Luck luck, std::mt19937& random) const;

 private:
  struct Node {
    bool directory = false;
    std::string safe;                              // content of a file
    std::vector<Change> unsafe;                    // writes and truncates since
    std::map<std::string, int> safe_names, names;  // of a directory: what is safe, and what programs see
  };
  /// A change of directories that is not safe yet: names that go and come.
  struct Step {
    int from = -1, to = -1;  // directories
    std::string old_name, new_name;
    int node = -1;  // that gets the new name
  };

  int node_at(const std::string& path) const;
  std::pair<int, std::string> place_of(const std::string& path) const;
  int node_of(std::uint64_t inode);
  int add(bool directory, std::uint64_t inode);
  void step(const std::string& from, const std::string& to, int node);
  void sync(int node);
  void load(const fs::path& folder, int node);
  void list(const std::vector<std::map<std::string, int>>& names, const std::vector<std::string>& contents, int node,
            const std::string& prefix, Tree& tree) const;
  static void apply(const Step& step, std::vector<std::map<std::string, int>>& names);

  std::string root_;
  std::vector<Node> nodes_;
  std::map<std::uint64_t, int> by_inode_;
  std::vector<Step> steps_;
};

}  // namespace graze::faults
