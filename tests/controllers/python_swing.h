#pragma once
// The ball with a swing of swing.h, moved by a controller in Python.

#include <gtest/gtest.h>

#include <string>

#include "tests/controllers/swing.h"
#include "tests/jobs/ball_campaign.h"

namespace graze::testing {

inline const std::string kInterpreter = "/usr/bin/python3";  // the distribution's, which has its NumPy

/// swing.yaml, swing.urdf and odd.py in a folder of their own; eight particles, one in each eighth of the heights.
struct PythonSwing {
  TemporaryFolder folder;

  PythonSwing() {
    write_file(folder / "swing.urdf", kSwingUrdf);
    const std::string source = std::string(GRAZE_SOURCE_DIR) + "/tests/controllers/odd_controller.py";
    write_file(folder / "odd.py", read_file(source));
  }
  /// `python`: what stands under `python` beside the interpreter.
  void write(const std::string& python, const std::string& interpreter = kInterpreter) const {
    std::string text = ball_scenario("sampling: {particles: 8, design: latin_hypercube}\n");
    const std::string still = "{hold: {}, control: {torque: {}}}";
    text.replace(text.find("ball.urdf"), 9, "swing.urdf");
    text.replace(text.find(still), still.size(),
                 "{python: {" + python + ", interpreter: " + interpreter + "}, control: {torque: {}}}");
    write_file(folder / "swing.yaml", text);
  }
  void odd(const std::string& does, const std::string& more = "") const {
    write("file: odd.py, class: Odd, settings: {does: " + does + "}" + more);
  }
  Result graze(const std::string& arguments) const { return testing::graze(folder.path(), arguments); }
  Outcomes run(const std::string& name, const std::string& more = "") const {
    const Result result = graze("run swing.yaml --trust --quiet -o " + name + ".graze " + more);
    EXPECT_EQ(result.code, 0) << result.err;
    return outcomes(folder / (name + ".graze"));
  }
};

}  // namespace graze::testing
