#pragma once
// What the tests of engine/model share: robots to load, folders to write in, messages to catch.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "engine/model/model.h"
#include "engine/model/urdf.h"
#include "engine/settings/settings.h"
#include "tests/reference_kinematics.h"

namespace graze {

inline std::string shipped_robot(const std::string& file) {
  return std::string(GRAZE_SOURCE_DIR) + "/data/robots/" + file;
}

/// Third-party robots are not part of this repository; empty if they are not at hand.
inline std::string third_party_robot(const std::string& file) {
  const char* folder = std::getenv("GRAZE_TEST_ROBOTS");
  const std::filesystem::path path =
      (folder ? std::filesystem::path(folder)
              : std::filesystem::path(GRAZE_SOURCE_DIR).parent_path() / "shared/robots") /
      file;
  return std::filesystem::exists(path) ? path.string() : "";
}

#define GRAZE_THIRD_PARTY(variable, file)               \
  const std::string variable = third_party_robot(file); \
  if (variable.empty()) GTEST_SKIP() << "no third-party robots here; set GRAZE_TEST_ROBOTS"

/// A tetrahedron with legs of 1, 2 and 3 m.
inline const char* const kTetrahedronObj = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

/// The message of the InputError that `action` throws; a failed test if it throws none.
template <typename Action>
std::string input_error(Action action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  ADD_FAILURE() << "no InputError";
  return "";
}

/// A folder of this test's own, empty at first, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() /
            (std::string("graze_") + test->test_suite_name() + "_" + test->name() + "_" + std::to_string(::getpid()));
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  std::string write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = path_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
    return file.string();
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Joint angles of links/init.xml (facts of the published configurations).
inline InitialState links_initial_state() {
  InitialState initial;
  initial.on_ground = true;
  const std::pair<const char*, double> legs[] = {{"LF", 1}, {"RF", -1}, {"LH", -1}, {"RH", 1}};
  for (const auto& [leg, sign] : legs) {
    initial.joint_position[std::string(leg) + "_X_1"] = sign * 0.2;
    initial.joint_position[std::string(leg) + "_Y_2"] = sign * 0.8;
    initial.joint_position[std::string(leg) + "_Y_3"] = sign * 1.2;
  }
  return initial;
}

inline World links_world() {
  World world;
  world.robot = load_urdf(shipped_robot("links.urdf"));
  world.initial = links_initial_state();
  Object ground;
  ground.name = "ground";
  ground.shape.kind = ShapeKind::plane;
  world.objects.push_back(ground);
  return world;
}

}  // namespace graze
