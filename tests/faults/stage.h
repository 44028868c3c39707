#pragma once
// Where trials are played: a folder in memory with the ball campaign, copied anew for each trial.

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/faults/faults.h"
#include "tests/jobs/ball_campaign.h"

namespace graze::faults {

namespace fs = std::filesystem;

/// tests/run --long
inline bool long_tests() { return std::getenv("GRAZE_LONG") != nullptr; }

/// What lies below a folder: files with their content, folders with "/".
using Tree = std::map<std::string, std::string>;

inline Tree tree_of(const fs::path& folder) {
  Tree out;
  if (!fs::exists(folder)) return out;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder).string();
    out[entry.is_directory() ? name + "/" : name] = entry.is_directory() ? "" : testing::read_file(entry.path());
  }
  return out;
}

inline void put(const Tree& tree, const fs::path& folder) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  for (const auto& [name, content] : tree) {
    if (name.back() == '/') {
      fs::create_directories(folder / name);
    } else {
      fs::create_directories((folder / name).parent_path());
      testing::write_file(folder / name, content);
    }
  }
}

/// Numbers from 1 to `count`: all of them, or so many, spread evenly.
inline std::vector<long> some_of(long count, long most) {
  std::vector<long> out;
  if (long_tests() || count <= most) {
    for (long i = 1; i <= count; ++i) out.push_back(i);
    return out;
  }
  for (long i = 0; i < most; ++i) out.push_back(1 + i * count / most + (i * 7919) % std::max(1L, count / most));
  return out;
}

class Stage {
 public:
  Stage() {
    testing::write_file(folder() / "ball.urdf", testing::kBallUrdf);
    testing::write_file(folder() / "ball.yaml", testing::ball_scenario());
    testing::write_file(folder() / "bystander.txt", "mine");
  }
  fs::path folder() const { return folder_.path(); }
  fs::path operator/(const std::string& name) const { return folder() / name; }
  /// Runs a verb that must succeed.
  Outcome must(const std::string& arguments) const {
    Outcome outcome = run(folder(), arguments);
    EXPECT_EQ(outcome.code, 0) << arguments << "\n" << outcome.err;
    return outcome;
  }
  /// The digests of a campaign that is whole and complete; nothing if it is not.
  testing::Digests whole(const std::string& name) const {
    try {
      if (!Archive(folder() / name).complete()) return {};
      return testing::digests(folder() / name);
    } catch (const std::exception&) {
      return {};
    }
  }

 private:
  /// In memory, where syncing costs nothing.
  struct InMemory {
    InMemory() {
      if (fs::exists("/dev/shm")) setenv("TMPDIR", "/dev/shm", 1);
    }
  };
  InMemory in_memory_;
  testing::TemporaryFolder folder_;
};

}  // namespace graze::faults
