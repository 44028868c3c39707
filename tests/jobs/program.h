#pragma once
// Runs the program as a user would, and small files for it to read.

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/sanitized.h"
#include "tests/temporary_folder.h"

namespace graze::testing {

namespace fs = std::filesystem;

struct Result {
  int code;  // exit code; 128 + signal if it was killed
  std::string out, err;
  long peak_kb;  // largest resident set of any child so far
};

/// Words in front of a command line: programs under the address sanitizer that the tests start neither look for leaks
/// when they end nor remember who allocated what, which is more than half of the time of starting one. The test
/// programs, which run the same libraries, do both; and so do all with GRAZE_LONG.
inline std::string sanitizer_options() {
  if (GRAZE_SANITIZED == 0 || std::getenv("GRAZE_LONG") != nullptr) return "";
  return "export ASAN_OPTIONS=\"${ASAN_OPTIONS:-}:detect_leaks=0:malloc_context_size=1\" && ";
}

/// Runs a shell command line in a folder; "graze" in its first place is the program under test.
inline Result shell(const fs::path& folder, const std::string& command) {
  const fs::path out = folder / ".out", err = folder / ".err";
  const std::string line = sanitizer_options() + "cd '" + folder.string() + "' && ( " + command + " ) >'" +
                           out.string() + "' 2>'" + err.string() + "'";
  const int status = std::system(line.c_str());
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return {code, read_file(out), read_file(err), usage.ru_maxrss};
}

inline Result graze(const fs::path& folder, const std::string& arguments) {
  return shell(folder, std::string("'") + GRAZE_PROGRAM + "' " + arguments);
}

inline std::string data(const std::string& file) { return std::string(GRAZE_SOURCE_DIR) + "/data/" + file; }

/// A ball that is dropped on a plane: the smallest campaign that has everything. `extra` is appended.
inline std::string ball_scenario(const std::string& extra = "") {
  return R"(graze: 1
name: Ball
robot:
  urdf: ball.urdf
  initial: {position: [0, 0, 0.2]}
environment:
  ground: {plane: z}
time: {end: 50 ms, step: 1 ms, control: 1 ms}
uncertain:
  initial.base.z: {uniform: [-5 cm, 5 cm]}
  robot.link.ball.density: {normal: {std: 2%}}
policies:
  still: {hold: {}, control: {torque: {}}}
task:
  requirements:
    high: {height: {link: ball, above: 0.05}}
  objective:
    low: {height: {link: ball, below: 0.2}}
)" + extra;
}

inline const char* kBallUrdf = R"(<robot name="ball"><link name="ball">
  <inertial><mass value="1"/><inertia ixx="0.004" iyy="0.004" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>)";

/// Writes ball.urdf and ball.yaml into a folder.
inline void write_ball(const TemporaryFolder& folder, const std::string& extra = "") {
  write_file(folder / "ball.urdf", kBallUrdf);
  write_file(folder / "ball.yaml", ball_scenario(extra));
}

}  // namespace graze::testing
