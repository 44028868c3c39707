// Claim: a network whose arithmetic is a known law gives that law's traces, bit for bit; a campaign of a recurrent one
// has the same bits for any number of threads and instruction set, is replayed and resumed from what its archive keeps,
// and needs no --trust; one that breaks down costs its particle alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/lanes/isa.h"
#include "tests/controllers/swing.h"
#include "tests/engine/network/onnx_bytes.h"

namespace graze {
namespace {

using ::testing::HasSubstr;
using testing::OnnxWriter;
using testing::outcomes;
using testing::Result;

namespace fs = std::filesystem;

/// swing.yaml and net.onnx in a folder of their own.
struct SwingingNetwork {
  testing::TemporaryFolder folder;

  explicit SwingingNetwork(const std::string& bytes) {
    testing::write_file(folder / "swing.urdf", testing::kSwingUrdf);
    testing::write_file(folder / "net.onnx", bytes);
  }
  /// `policy`: what stands for the policy that shall be judged.
  void write(const std::string& policy) const {
    std::string text = testing::ball_scenario("sampling: {particles: 24}\n");
    const std::string still = "{hold: {}, control: {torque: {}}}";
    text.replace(text.find("ball.urdf"), 9, "swing.urdf");
    text.replace(text.find(still), still.size(), policy);
    text.replace(text.find("uncertain:\n"), 11, "uncertain:\n  initial.joint.hinge.position: {uniform: [-1, 1]}\n");
    testing::write_file(folder / "swing.yaml", text);
  }
  Result graze(const std::string& arguments) const { return testing::graze(folder.path(), arguments); }
};

TEST(NetworkCampaigns, OfALawHaveItsBits) {
  OnnxWriter law;  // -3 (q - stance) - 0.05 v, rounded after each operation as the tracker does
  law.input("obs", {0, 2})
      .output("tau")
      .constant("w", {2}, {-3, -0.05})
      .wholes("n0", {0})
      .wholes("n1", {1})
      .wholes("n2", {2});
  law.node("Mul", {"obs", "w"}, {"m"})
      .node("Slice", {"m", "n0", "n1", "n1"}, {"a"})
      .node("Slice", {"m", "n1", "n2", "n1"}, {"b"});
  const SwingingNetwork swing(law.node("Add", {"a", "b"}, {"tau"}).bytes());
  swing.write("{hold: {}, control: {joint_pd: {kp: 3, kd: 0.05, implicit: false}}}");
  ASSERT_EQ(swing.graze("run swing.yaml --quiet -o native.graze").code, 0);
  swing.write(
      "{network: {file: net.onnx, inputs: [joint_position, joint_velocity], action: torque}, control: {torque: {}}}");
  const Result run = swing.graze("run swing.yaml --quiet -o network.graze");
  ASSERT_EQ(run.code, 0) << run.err;
  const auto native = outcomes(swing.folder / "native.graze"), network = outcomes(swing.folder / "network.graze");
  EXPECT_EQ(native.digest.size(), 24u);
  EXPECT_EQ(native.digest, network.digest);
}

/// A GRU that sees the joint, gravity and its last action.
std::string recurrent() {
  std::vector<double> w(3 * 4 * 6), r(3 * 4 * 4), out(4);
  for (std::size_t i = 0; i < w.size(); ++i) w[i] = std::sin(0.9 * static_cast<double>(i));
  for (std::size_t i = 0; i < r.size(); ++i) r[i] = std::cos(0.4 * static_cast<double>(i));
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = 0.5 - static_cast<double>(i % 2);
  OnnxWriter net(testing::Numbers::float32);
  net.input("obs", {1, 6}).input("h", {1, 1, 4}).output("y").output("hn").wholes("zero", {0});
  net.constant("W", {1, 12, 6}, w).constant("R", {1, 12, 4}, r).constant("v", {4, 1}, out);
  net.node("Unsqueeze", {"obs", "zero"}, {"x"}).node("GRU", {"x", "W", "R", "", "", "h"}, {"", "hn"});
  return net.node("Squeeze", {"hn", "zero"}, {"s"}).node("MatMul", {"s", "v"}, {"y"}).bytes();
}

TEST(NetworkCampaigns, SameBitsEverywhereAndAgain) {
  const SwingingNetwork swing(recurrent());
  swing.write(
      "{network: {file: net.onnx, inputs: [joint_position, {of: joint_velocity, scale: 0.1}, gravity, last_action], "
      "memory: [[h, hn]], every: 2, action: torque}, control: {torque: {}}}");
  ASSERT_EQ(swing.graze("run swing.yaml --quiet --threads 1 -o one.graze").code, 0);
  ASSERT_EQ(swing.graze("run swing.yaml --quiet --threads 2 -n 8 -o part.graze").code, 0);
  const auto one = outcomes(swing.folder / "one.graze");
  EXPECT_EQ(one.digest.size(), 24u);
  for (const Isa isa : available_isas()) {
    setenv("GRAZE_ISA", isa_name(isa).c_str(), 1);
    ASSERT_EQ(swing.graze("run swing.yaml --quiet --threads 2 --force -o other.graze").code, 0);
    EXPECT_EQ(outcomes(swing.folder / "other.graze").digest, one.digest) << isa_name(isa);
  }
  unsetenv("GRAZE_ISA");
  EXPECT_EQ(swing.graze("check swing.yaml --determinism").code, 0);
  // The archives keep the network, and go on with that one whatever becomes of the file.
  testing::write_file(swing.folder / "net.onnx", "another");
  const Result replay = swing.graze("replay one.graze --particle 3 -o three.csv");
  EXPECT_EQ(replay.code, 0) << replay.err;
  EXPECT_THAT(testing::read_file(swing.folder / "three.csv"), HasSubstr("action.hinge"));
  fs::remove(swing.folder / "net.onnx");
  const Result resumed = swing.graze("resume part.graze -n 24 --quiet");
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_EQ(outcomes(swing.folder / "part.graze").digest, one.digest);
}

TEST(NetworkCampaigns, ThatBreakDownCostTheirParticle) {
  OnnxWriter net;  // the root of a joint angle
  net.input("obs", {1, 1}).output("y").node("Sqrt", {"obs"}, {"y"});
  const SwingingNetwork swing(net.bytes());
  swing.write(
      "{network: {file: net.onnx, inputs: [joint_position], stance: -0.9, action: torque}, control: {torque: {}}}");
  const Result run = swing.graze("run swing.yaml --quiet -o out.graze");
  ASSERT_EQ(run.code, 0) << run.err;
  const auto out = outcomes(swing.folder / "out.graze");
  EXPECT_GT(out.invalid.size(), 0u);
  EXPECT_GT(out.digest.size(), 15u);
  for (const auto& [id, reason] : out.invalid) {
    EXPECT_THAT(reason, HasSubstr("net.onnx: the network's output for joint hinge at ")) << id;
  }
}

// What fails in every trace is told by check, and by run where the table has no room for it.
TEST(NetworkCampaigns, ThatBreakDownInEveryTraceAreTold) {
  OnnxWriter net;  // the root of an angle that is negative
  net.input("obs", {1, 1}).output("y").node("Sqrt", {"obs"}, {"y"});
  const SwingingNetwork swing(net.bytes());
  swing.write(
      "{network: {file: net.onnx, inputs: [joint_position], stance: 3, action: torque}, control: {torque: {}}}");
  const Result check = swing.graze("check swing.yaml");
  EXPECT_EQ(check.code, 1);
  EXPECT_THAT(check.err, HasSubstr("policy still, particle 0: net.onnx: the network's output for joint hinge at 0 s"));
  EXPECT_THAT(check.err, HasSubstr("its trace would be invalid"));
  const Result run = swing.graze("run swing.yaml --quiet -o out.graze");
  EXPECT_EQ(run.code, 0);
  EXPECT_THAT(run.err, HasSubstr("policy still: no trace of 24 is valid, so there is no rate; the first: net.onnx: the "
                                 "network's output for joint hinge at 0 s"));
}

}  // namespace
}  // namespace graze
