#pragma once
// A ball with a swing that a controller in a shared object moves, and the program run on it.

#include <map>
#include <set>
#include <string>

#include "archive/archive.h"
#include "tests/archive/tables.h"
#include "tests/jobs/program.h"

namespace graze::testing {

inline const char* kSwingUrdf = R"(<robot name="swing">
  <link name="ball">
    <inertial><mass value="1"/><inertia ixx="0.004" iyy="0.004" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <link name="rod"><inertial><origin xyz="0 0 -0.05"/><mass value="0.1"/>
    <inertia ixx="0.0002" iyy="0.0002" izz="0.0002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hinge" type="continuous"><parent link="ball"/><child link="rod"/><axis xyz="0 1 0"/></joint></robot>)";

/// swing.yaml, swing.urdf and odd.so in a folder of their own.
struct Swing {
  TemporaryFolder folder;

  Swing() {
    write_file(folder / "swing.urdf", kSwingUrdf);
    build("odd.so");
  }

  /// Compiles the controller of the tests.
  void build(const std::string& name, const std::string& flags = "") const {
    const std::string source = std::string(GRAZE_SOURCE_DIR) + "/tests/controllers/odd_controller.c";
    const Result made = shell(folder.path(), "cc -std=gnu99 -O1 -ffp-contract=off -fPIC -shared " + flags + " -I '" +
                                                 GRAZE_SOURCE_DIR + "' -o " + name + " '" + source + "' -lm");
    ASSERT_EQ(made.code, 0) << made.err;
  }

  /// `library`: what stands under `library` beside `file`.
  void write(const std::string& library, const std::string& control = "torque: {}") const {
    std::string text = ball_scenario("sampling: {particles: 24}\n");
    const std::string still = "{hold: {}, control: {torque: {}}}";
    text.replace(text.find("ball.urdf"), 9, "swing.urdf");
    text.replace(text.find(still), still.size(), "{library: {" + library + "}, control: {" + control + "}}");
    write_file(folder / "swing.yaml", text);
  }
  /// The controller does something, in robots that begin higher than 0.22 m if that is a fault.
  void odd(const std::string& does, const std::string& more = "") const {
    write("file: odd.so, settings: {does: " + does + ", above: 0.22}" + more);
  }

  Result graze(const std::string& arguments) const { return testing::graze(folder.path(), arguments); }
};

/// What a campaign has come to, by particle.
struct Outcomes {
  std::map<std::uint32_t, std::uint64_t> digest;  // of the valid
  std::map<std::uint32_t, std::string> invalid;   // and why
  std::set<std::uint32_t> high;                   // that began higher than 0.22 m
};

inline Outcomes outcomes(const fs::path& path) {
  const Archive archive(path);
  Outcomes out;
  const std::string policy = archive.info().policies.front();
  std::size_t height = 0;
  while (archive.info().parameters.at(height).name != "initial.base.z") ++height;
  for (std::uint32_t id = 0; id < archive.info().particles; ++id) {
    const auto trace = archive.trace(policy, id);
    if (!trace) continue;
    if (trace->outcome == Outcome::invalid) {
      out.invalid[id] = trace->invalid_reason;
    } else {
      out.digest[id] = trace->digest;
    }
    if (archive.particle_values(id).at(height) + 0.2 > 0.22) out.high.insert(id);
  }
  return out;
}

}  // namespace graze::testing
