// Claim: the policy `network` shows a network what its settings say, in the order, axes and scales in which it was
// trained, and does with its outputs what they say; weights that are a known law give that law's commands; what does
// not fit is named.
#include <gmock/gmock.h>

#include <fstream>
#include <random>

#include "engine/network/observation_vector.h"
#include "engine/settings/warnings.h"
#include "tests/engine/control/support.h"
#include "tests/engine/network/evaluate.h"
#include "tests/engine/settings/spelled_out.h"

namespace graze {
namespace {

using ::testing::HasSubstr;
using testing::Numbers;
using testing::OnnxWriter;

constexpr int kJoints = 12;

class NetworkPolicyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder = ::testing::TempDir() + "network_" + ::testing::UnitTest::GetInstance()->current_test_info()->name() + "_";
    observation.joint_position = observation.joint_velocity = BlockArray(kJoints);
    observation.base_position = observation.base_rpy = observation.base_velocity = observation.base_rate =
        BlockArray(3);
    std::mt19937 random(3);
    const auto fill = [&](BlockArray& rows) {
      for (int k = 0; k < rows.rows(); ++k) {
        for (int lane = 0; lane < kLanes; ++lane) rows(k, lane) = std::ldexp(static_cast<double>(random()), -31) - 1;
      }
    };
    for (BlockArray* rows : {&observation.joint_position, &observation.joint_velocity, &observation.base_rpy,
                             &observation.base_velocity, &observation.base_rate}) {
      fill(*rows);
    }
  }
  std::string write(const std::string& bytes) const {
    std::ofstream(folder + "policy.onnx", std::ios::binary) << bytes;
    return folder + "policy.onnx";
  }
  Controller make(const std::string& bytes, const std::string& more, const std::string& control = "torque: {}") const {
    const std::string text = "{network: {file: " + write(bytes) + ", " + more + "}, control: {" + control + "}}";
    return Controller(scene.context(0.01), Settings::parse(text, "net.yaml"));
  }
  std::string refused(const std::string& bytes, const std::string& more, const std::string& control = "torque: {}") {
    return input_error([&] { make(bytes, more, control); });
  }
  static void start(Controller& controller) {
    for (int lane = 0; lane < kLanes; ++lane) controller.start(lane, 0, static_cast<std::uint32_t>(lane));
  }
  /// Position targets of joint 0 in a lane at the next steps, less the stance.
  std::vector<double> actions(Controller& controller, int steps, int lane = 0) {
    ActuatorCommand command(kJoints);
    std::vector<double> out;
    for (int i = 0; i < steps; ++i) {
      controller.act(observation, nullptr, LaneMask::all(), command);
      out.push_back(controller.targets().q(0, lane) - scene.initial.q[scene.model.bodies[scene.model.actuated[0]].q]);
    }
    return out;
  }

  Scene scene{links_world()};
  Observation observation;
  std::string folder;
};

/// tau = -20 (q - stance) - 0.1 v
std::string pd_law(Numbers type) {
  std::vector<double> weights(kJoints * 2 * kJoints);
  for (int k = 0; k < kJoints; ++k) {
    weights[k * 2 * kJoints + k] = -20;
    weights[k * 2 * kJoints + kJoints + k] = -0.1;
  }
  OnnxWriter out(type);
  out.input("obs", {0, 2 * kJoints}).output("tau").constant("w", {kJoints, 2 * kJoints}, weights);
  return out.node("Gemm", {"obs", "w"}, {"tau"}, {testing::whole("transB", 1)}).bytes();
}

TEST_F(NetworkPolicyTest, WeightsThatAreALawGiveItsTorques) {
  Controller law(scene.context(0.01),
                 Settings::parse("{hold: {}, control: {joint_pd: {kp: 20, kd: 0.1, implicit: false}}}", "pd.yaml"));
  ActuatorCommand wanted(kJoints), given(kJoints);
  start(law);
  law.act(observation, nullptr, LaneMask::all(), wanted);
  const std::string seen = "action: torque, inputs: [joint_position, joint_velocity]";
  for (const auto& [type, near] : {std::pair{Numbers::float64, 8e-15}, std::pair{Numbers::float32, 4e-6}}) {
    Controller network = make(pd_law(type), seen);
    EXPECT_EQ(network.reads(), kJointPosition | kJointVelocity);
    start(network);
    network.act(observation, nullptr, LaneMask::all(), given);
    for (int k = 0; k < kJoints; ++k) {
      for (int lane = 0; lane < kLanes; ++lane) EXPECT_NEAR(given.tau(k, lane), wanted.tau(k, lane), near);
    }
  }
}

/// A network that counts its calls: `h` goes in, h + 1 comes out, and that for all joints.
std::string counter() {
  OnnxWriter out;
  out.input("obs", {1, kJoints})
      .input("h", {1, 1})
      .output("y")
      .output("hn")
      .constant("zero", {}, {0})
      .constant("one", {}, {1});
  out.node("Add", {"h", "one"}, {"hn"}).node("Mul", {"obs", "zero"}, {"none"});
  return out.node("Add", {"none", "hn"}, {"y"}).bytes();
}

TEST_F(NetworkPolicyTest, RemembersAndIsCalledEverySoManySteps) {
  const std::string text = "inputs: [joint_position], memory: [[h, hn]], every: 3, scale: 0.5, clip: 2.5";
  Controller controller = make(counter(), text, "joint_pd: {kp: 20}");
  start(controller);
  const std::vector<double> want{0.5, 0.5, 0.5, 1, 1, 1, 1.25, 1.25};
  testing::expect_near(actions(controller, 8), want, 1e-15);
  controller.start(0, 0, 7);
  testing::expect_near(actions(controller, 4), {0.5, 0.5, 0.5, 1}, 1e-15);  // it has forgotten
  controller.start(2, 0, 8);
  testing::expect_near(actions(controller, 2, 0), {1, 1}, 1e-15);  // and the neighbour has not
}

TEST_F(NetworkPolicyTest, GoesOnFromWhatWasSaved) {
  const std::string text =
      "inputs: [{of: joint_position, scale: 0}, last_action], history: 2, joints: [LF_X_1], every: 2";
  OnnxWriter net;  // the sum of both actions that it sees, and one
  net.input("obs", {1, 4}).output("y").constant("w", {4, 1}, {0, 1, 0, 1}).constant("one", {1}, {1});
  net.node("Gemm", {"obs", "w", "one"}, {"y"});
  Controller first = make(net.bytes(), text, "joint_pd: {kp: 20}"),
             second = make(net.bytes(), text, "joint_pd: {kp: 20}");
  start(first);
  testing::expect_near(actions(first, 5), {1, 1, 2, 2, 4}, 1e-15);
  LaneTape out;
  first.carry(3, out);
  const LaneTape::Content saved = out.take();
  second.start(6, 0, 3);
  LaneTape in(saved);
  second.carry(6, in);
  in.end();
  const std::vector<double> went_on = actions(first, 4, 3);
  EXPECT_EQ(went_on, (std::vector<double>{4, 7, 7, 12}));
  EXPECT_EQ(actions(second, 4, 6), went_on);
}

TEST_F(NetworkPolicyTest, MovesTheJointsThatItNames) {
  OnnxWriter net;
  net.input("obs", {1, 2}).output("y").constant("b", {2}, {0.25, -0.5}).node("Add", {"obs", "b"}, {"y"});
  Controller controller =
      make(net.bytes(),
           "inputs: [{of: joint_position, scale: 0}], joints: [RH_Y_3, LF_Y_2], stance: {LF_*: 0.1}, scale: {LF_*: 2}",
           "joint_pd: {kp: 20}");
  start(controller);
  actions(controller, 1);
  const int first = scene.model.joint("RH_Y_3"), second = scene.model.joint("LF_Y_2"),
            third = scene.model.joint("LF_X_1");
  for (int k = 0; k < kJoints; ++k) {
    const int body = scene.model.actuated[k];
    const double initial = scene.initial.q[scene.model.bodies[body].q], q = controller.targets().q(k, 5);
    const double want = body == first ? initial + 0.25 : body == second ? 0.1 - 1.0 : body == third ? 0.1 : q;
    EXPECT_DOUBLE_EQ(q, want) << scene.model.bodies[body].joint;
  }
}

// Places that nobody goes to are told.
TEST_F(NetworkPolicyTest, WarnsOfPlacesThatNobodyFollows) {
  for (const std::string action : {"position", "torque"}) {
    Warnings warnings;
    make(counter(), "inputs: [joint_position], memory: [[h, hn]], action: " + action);
    EXPECT_EQ(warnings.texts().size(), action == "position" ? 1u : 0u) << action;
  }
  const std::string velocity = "inputs: [joint_position], memory: [[h, hn]], action: velocity";
  for (const auto& [control, text] : {std::pair{"torque: {}", "'network' wants velocities"},
                                      std::pair{"joint_pd: {kp: 60}", "count by kd, and that is 0"},
                                      std::pair{"joint_pd: {kp: 60, kd: 0}", "count by kd, and that is 0"},
                                      std::pair{"joint_pd: {kp: 60, kd: 1}", ""}}) {
    Warnings warnings;
    make(counter(), velocity, control);
    EXPECT_EQ(warnings.texts().size(), *text == '\0' ? 0u : 1u) << control;
    for (const std::string& one : warnings.texts()) EXPECT_THAT(one, HasSubstr(text));
  }
}

TEST_F(NetworkPolicyTest, WarnsOfAStanceBeyondTheLimits) {
  scene.model.bodies[static_cast<std::size_t>(scene.model.joint("LF_X_1"))].upper = 0.8;
  const std::string more = "inputs: [joint_position], memory: [[h, hn]], action: torque, stance: {LF_X_1: ";
  Warnings warnings;
  make(counter(), more + "0.7}");
  EXPECT_EQ(warnings.texts().size(), 0u);
  make(counter(), more + "3}");
  ASSERT_EQ(warnings.texts().size(), 1u);
  EXPECT_THAT(warnings.texts().front(), HasSubstr("of joint LF_X_1 is 3 rad, and its limits are "));
}

// A network that breaks down is the particle's fault, not the campaign's.
TEST_F(NetworkPolicyTest, ThrowsForWhatIsNoNumber) {
  OnnxWriter net;
  net.input("obs", {1, kJoints}).output("y").constant("zero", {}, {0}).node("Div", {"obs", "zero"}, {"y"});
  Controller controller = make(net.bytes(), "inputs: [joint_position]");
  start(controller);
  ActuatorCommand command(kJoints);
  try {
    controller.act(observation, nullptr, LaneMask::all(), command);
    FAIL() << "infinite torques";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("the network's output for joint "));
  }
}

TEST_F(NetworkPolicyTest, SaysWhatDoesNotFit) {
  const std::string net = testing::perceptron({48, 8, kJoints}, "Elu", Numbers::float32);
  EXPECT_THAT(refused(net, "inputs: [base_rate, gravity, {of: joint_position}, joint_velocity, last_action]"),
              HasSubstr("the network's input 'obs' of shape [1, 48] takes 48 numbers, and these are 42: base_rate 3, "
                        "gravity 3, joint_position 12, joint_velocity 12, last_action 12; 6 are missing"));
  EXPECT_THAT(refused(net,
                      "inputs: [base_rate, gravity, command, joint_position, joint_velocity, last_action], "
                      "velocity: [0.5, 0, 0]"),
              HasSubstr("3 are missing, as many as there are of base_velocity, base_rpy"));
  EXPECT_THAT(refused(net, "inputs: [{of: joint_position, scale: 2}], history: 4, joints: [LF_X_1]"),
              HasSubstr("48 numbers, and these are 4: joint_position 1; 4 frames of 1; 44 are missing"));
  const std::string four = "inputs: [joint_position], history: 4";
  EXPECT_THAT(refused(net, "inputs: [joint_positon], history: 4"), HasSubstr("did you mean 'joint_position'?"));
  EXPECT_THAT(refused(net, "inputs: [command], history: 16"), HasSubstr("has a command, which lacks its value"));
  EXPECT_THAT(refused(net, four + ", velocity: [1, 0, 0]"), HasSubstr("is not among the inputs; add 'command'"));
  EXPECT_THAT(refused(net, "inputs: [{of: joint_position, scale: [1, 2]}], history: 4"),
              HasSubstr("has 2 numbers; there must be 12, or one for all"));
  EXPECT_THAT(refused(net, "inputs: [{of: joint_position, period: 1}], history: 4"),
              HasSubstr("goes with 'of: phase'"));
  EXPECT_THAT(refused(net, four + ", joints: [LF_X_1, LF_X_2]"),
              HasSubstr("'LF_X_2' is no driven joint of the robot; did you mean"));
  EXPECT_THAT(refused(net, four + ", memory: [[h, hn]]"), HasSubstr("'h' is no input of the network; there are: obs"));
  EXPECT_THAT(refused(net, four + ", every: 1e9"),
              HasSubstr("every: 1e9: must be from 1 to 1000000 control steps; nearest right answer: 1000000"));
  EXPECT_THAT(refused(net, four + ", every: 0"), HasSubstr("; nearest right answer: 1"));
  EXPECT_THAT(refused(net, four + ", every: 1e6"), HasSubstr("in digits; nearest right answer: 1000000"));
  EXPECT_NO_THROW(make(net, four + ", every: 1000000"));
  EXPECT_THAT(refused(net, "inputs: [joint_position], history: 1e9"),
              HasSubstr("history: 1e9: must be from 1 to 1000 frames; nearest right answer: 1000"));
  EXPECT_THAT(refused(net, four, "operational_pd: {kp: 1, kd: 1}"), HasSubstr("network gives joint targets"));
  EXPECT_THAT(refused(counter(), "inputs: [joint_position]"),
              HasSubstr("the network has the inputs obs [1, 12], h [1, 1]; one is for what is observed"));
  EXPECT_THAT(refused(counter(), "inputs: [joint_position], memory: [[h, hn], [h, hn]]"),
              HasSubstr("'h' stands twice"));
  OnnxWriter two;
  two.input("obs", {1, 12}).input("h", {1, 1}).input("c", {1, 1}).output("y").output("hn");
  two.node("Mul", {"obs", "c"}, {"y"}).node("Neg", {"h"}, {"hn"});
  EXPECT_THAT(refused(two.bytes(), "inputs: [joint_position], memory: [[h, hn], [c, hn]]"),
              HasSubstr("'hn' stands twice; it goes into one input"));
  const std::string first = testing::perceptron({1, 1}, "Elu", Numbers::float32);
  EXPECT_THAT(refused(first, "inputs: [joint_position], joints: [LF_X_1], scale: {LF_X_1: 2, RH_X_1: 3}"),
              HasSubstr("the network does not move 'RH_X_1'; it moves LF_X_1"));
  OnnxWriter batch;
  batch.input("obs", {4, 12}).output("y").node("Neg", {"obs"}, {"y"});
  EXPECT_THAT(refused(batch.bytes(), "inputs: [joint_position]"),
              HasSubstr("of shape [4, 12] is a batch of 4 robots; export it with a batch of 1"));
  OnnxWriter strange;
  strange.input("obs", {1, 12}).output("y").node("No\nsuch\x1b", {"obs"}, {"y"});
  EXPECT_THAT(refused(strange.bytes(), "inputs: [joint_position]"),
              HasSubstr("node '/y' (No\\nsuch\\x1b) is of an operator that is not known"));
  EXPECT_THAT(input_error([&] {
                Controller(scene.context(0.01), Settings::parse("{network: {file: ., inputs: [joint_position]}, "
                                                                "control: {torque: {}}}",
                                                                "net.yaml"));
              }),
              HasSubstr("not a file, but a folder"));
  EXPECT_THAT(refused("rubbish", four), HasSubstr("policy.onnx: is no ONNX file, or a damaged one"));
  EXPECT_THAT(refused(testing::perceptron({48, 13}, "Elu", Numbers::float32), four),
              HasSubstr("output 'actions' of shape [1, 13] has 13 numbers, and there are 12 joints: LF_X_1"));
  EXPECT_EQ(refused(net, "inputs: [joint_position], histroy: 4").find("net.yaml:1:"), 0u);
}

TEST_F(NetworkPolicyTest, TellsTheDefaultsThatAreUsed) {
  const std::string net = write(testing::perceptron({48, 8, kJoints}, "Elu", Numbers::float32));
  const Settings least = Settings::parse(
      "{network: {file: " + net + ", inputs: [joint_position], history: 4}, control: {joint_pd: {kp: 20}}}",
      "net.yaml");
  int count = 0;
  const Settings whole = spelled_out(least, "network", policy_text("network"), count);
  EXPECT_GE(count, 5);
  Controller short_one(scene.context(0.01), least), long_one(scene.context(0.01), whole);
  start(short_one);
  start(long_one);
  EXPECT_EQ(actions(short_one, 5, 3), actions(long_one, 5, 3));
}

// ---- what it sees

class ObservationVectorTest : public NetworkPolicyTest {
 protected:
  /// Of LF_X_1 and the base.
  ObservationVector vector(const std::string& text) {
    static const Description keys("what is seen", observation_keys());
    const int joint = 0;
    return {scene.context(0.01), Described(Settings::parse("{" + text + "}", "seen.yaml"), keys),
            NetworkJoints{{joint}, {"LF_X_1"}, {0.5}}, testing::network_kernel()};
  }
  static std::vector<double> column(const ObservationVector& seen, int lane) {
    std::vector<double> out;
    for (int i = 0; i < seen.size(); ++i) out.push_back(seen.row(i)[lane]);
    return out;
  }
};

TEST_F(ObservationVectorTest, TurnsWhatIsSensedIntoTheBase) {
  ObservationVector seen = vector("inputs: [gravity, base_rate, base_velocity, base_rpy]");
  EXPECT_EQ(seen.reads(), kBaseRpy | kBaseRate | kBaseVelocity);
  const BlockArray none(1);
  for (int lane = 0; lane < kLanes; ++lane) seen.start(lane);
  seen.see(observation, LaneMask::all(), none);
  for (int lane = 0; lane < kLanes; ++lane) {
    const Eigen::Vector3d rpy = observation.base_rpy.vec3(0, lane);
    const auto about = [](int axis, double angle) {
      Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
      const int i = (axis + 1) % 3, j = (axis + 2) % 3;
      R(i, i) = R(j, j) = std::cos(angle);
      R(j, i) = std::sin(angle), R(i, j) = -R(j, i);
      return R;
    };
    const Eigen::Matrix3d R_WB = about(2, rpy[2]) * about(1, rpy[1]) * about(0, rpy[0]);
    Eigen::Matrix<double, 12, 1> want;
    want << R_WB.transpose() * Eigen::Vector3d(0, 0, -1), R_WB.transpose() * observation.base_rate.vec3(0, lane),
        R_WB.transpose() * observation.base_velocity.vec3(0, lane), rpy;
    testing::expect_near(column(seen, lane), {want.data(), want.data() + 12}, 1e-15);
  }
  EXPECT_EQ(vector("inputs: [gravity]").reads(), kBaseTilt);
}

TEST_F(ObservationVectorTest, ScalesCutsAndCounts) {
  ObservationVector seen = vector(
      "inputs: [{of: joint_position, mean: 0.25, scale: 2}, {of: command, scale: [2, 2, 0.5]}, {of: phase, period: 0.4 "
      "s, "
      "offset: 0.25}, time, {of: last_action, clip: 1.5}], velocity: [0.5, -0.25, 1]");
  observation.time.fill(0.1);
  observation.joint_position(0, 2) = 1.75;
  BlockArray action(1);
  action(0, 2) = -3;
  seen.start(2);
  seen.see(observation, LaneMask(4u), action);
  testing::expect_near(column(seen, 2), {2, 1, -0.5, 0.5, 0, -1, 0.1, -1.5}, 1e-15);
}

TEST_F(ObservationVectorTest, StacksFrames) {
  // Frames are (position - 0.5, time).
  const auto stacked = [&](const std::string& more) {
    ObservationVector seen = vector("inputs: [joint_position, time], history: 3" + more);
    for (const int lane : {1, 4}) seen.start(lane);
    for (int step = 0; step < 5; ++step) {
      for (int lane = 0; lane < kLanes; ++lane) {
        observation.time[lane] = 10 * lane + step;
        observation.joint_position(0, lane) = 0.5 - step;
      }
      // Lane 4 sees the last two steps only.
      seen.see(observation, step < 3 ? LaneMask(2u) : LaneMask(18u), BlockArray(1));
    }
    return std::pair(column(seen, 1), column(seen, 4));
  };
  using List = std::vector<double>;
  EXPECT_EQ(stacked(""), std::pair(List({-2, 12, -3, 13, -4, 14}), List({-3, 43, -3, 43, -4, 44})));
  EXPECT_EQ(stacked(", newest: first"), std::pair(List({-4, 14, -3, 13, -2, 12}), List({-4, 44, -3, 43, -3, 43})));
  EXPECT_EQ(stacked(", stacked: inputs"), std::pair(List({-2, -3, -4, 12, 13, 14}), List({-3, -3, -4, 43, 43, 44})));
}

}  // namespace
}  // namespace graze
