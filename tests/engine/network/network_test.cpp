// Claim: a network has the same bits for every instruction set and lane; one of floats has floats for results; a file
// that is damaged, hostile or of unknown operators ends in a message that says so.
#include "engine/network/network.h"

#include <gmock/gmock.h>

#include <random>

#include "tests/engine/network/evaluate.h"

namespace graze {
namespace {

using testing::evaluate;
using ::testing::HasSubstr;
using testing::Message;
using testing::Numbers;
using testing::OnnxWriter;
using testing::perceptron;
using testing::refusal;

/// Something of everything that computes.
std::string mixture(Numbers type) {
  OnnxWriter out(type);
  std::vector<double> w(6 * 11), one(11, 1.5);
  for (std::size_t i = 0; i < w.size(); ++i) w[i] = std::sin(0.61 * static_cast<double>(i));
  out.input("x", {0, 6}).output("y").output("z").constant("w", {6, 11}, w).constant("b", {11}, one);
  out.node("Gemm", {"x", "w", "b"}, {"s"});
  std::string from = "s";
  for (const char* type_of : {"Elu", "Tanh", "Sigmoid", "Softplus", "Selu", "Softsign", "Sin", "Cos", "Exp"}) {
    out.node(type_of, {from}, {from + "o"});
    out.node("Mul", {from + "o", "s"}, {from + "p"});
    from += "p";
  }
  out.node("LayerNormalization", {from, "b", "b"}, {"y"}).node("Softmax", {"s"}, {"z"});
  return out.bytes();
}

TEST(Networks, SameBitsForEveryInstructionSet) {
  for (const Numbers type : {Numbers::float64, Numbers::float32}) {
    const std::string bytes = mixture(type);
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::vector<double> portable = evaluate(bytes, lane, Isa::portable);
      for (const Isa isa : available_isas()) EXPECT_EQ(evaluate(bytes, lane, isa), portable) << isa_name(isa) << lane;
    }
  }
}

TEST(Networks, LanesDoNotSeeEachOther) {
  const Network network(mixture(Numbers::float32), testing::network_kernel());
  const auto run = [&](int lane, double others) {
    BlockArray memory = network.memory();
    for (const int row : network.inputs()[0].rows) {
      for (int l = 0; l < kLanes; ++l) memory(row, l) = l == lane ? 0.125 * row : others;
    }
    network.run(memory);
    std::vector<double> out;
    for (const int row : network.outputs()[0].rows) out.push_back(memory(row, lane));
    return out;
  };
  const std::vector<double> first = run(0, 0);
  for (const double others : {1.0, std::nan(""), 1e300}) {
    for (int lane = 0; lane < kLanes; ++lane) EXPECT_EQ(run(lane, others), first) << lane << " " << others;
  }
}

// Sums run in double precision and are rounded once: nearer to the real ones than a sum of floats.
TEST(Networks, FloatsAreRoundedAfterEachOperator) {
  const std::vector<double> single = evaluate(perceptron({48, 64, 12}, "Elu", Numbers::float32), 1);
  const std::vector<double> real = evaluate(perceptron({48, 64, 12}, "Elu", Numbers::float64), 1);
  testing::expect_near(single, real, 2e-6);
  EXPECT_NE(single, real);
  for (const double y : single) EXPECT_EQ(y, static_cast<double>(static_cast<float>(y)));
}

TEST(Networks, NameWhatTheyDoNotKnow) {
  const auto one = [](const std::string& type, const std::string& domain = "") {
    OnnxWriter out;
    return refusal(out.input("x", {1, 3}).output("y").node(type, {"x"}, {"y"}, {}, domain).bytes());
  };
  EXPECT_THAT(one("Conv"), HasSubstr("node '/y' (Conv) is of an operator that is not known; known are Abs, Add, "));
  EXPECT_THAT(one("Elu", "com.microsoft"), HasSubstr("not known (of com.microsoft)"));
  EXPECT_THAT(refusal(perceptron({3, 2}, "Elu", Numbers::float64)), "");
  OnnxWriter wide;
  wide.input("x", {1, 3}).output("y").constant("w", {4, 2}, std::vector<double>(8)).node("Gemm", {"x", "w"}, {"y"});
  EXPECT_THAT(refusal(wide.bytes()), HasSubstr("(Gemm) multiplies shapes [1, 3] and [4, 2], which do not fit"));
  OnnxWriter missing;
  missing.input("x", {1, 3}).output("y").node("Add", {"x", "gone"}, {"y"});
  EXPECT_THAT(refusal(missing.bytes()), HasSubstr("takes 'gone', which nothing before it makes"));
  OnnxWriter squared;
  squared.input("x", {1, 3}).output("y").node("Transpose", {"x"}, {"t"}).node("MatMul", {"x", "t"}, {"y"});
  EXPECT_THAT(refusal(squared.bytes()), HasSubstr("one of them must be constant weights"));
  EXPECT_THAT(refusal(OnnxWriter(Numbers::float64, 99).input("x", {1}).output("x").bytes()),
              HasSubstr("operator set 99 of ONNX; known are 7 to 22"));
}

TEST(Networks, RefuseWhatIsKeptElsewhere) {
  const std::string outside = Message().number(1, 4).number(2, 1).text(8, "w").number(14, 1).bytes();
  OnnxWriter out;
  EXPECT_THAT(refusal(out.input("x", {1}).output("x").field(5, outside).bytes()), HasSubstr("kept in another file"));
}

// Neither memory nor time goes with what a file claims to be.
TEST(Networks, RefuseWhatIsTooLarge) {
  const std::string huge = Message().number(1, 1u << 31).number(1, 1u << 31).number(2, 1).text(8, "w").bytes();
  OnnxWriter out;
  EXPECT_THAT(refusal(out.input("x", {1}).output("x").field(5, huge).bytes()), HasSubstr("at most 4194304 numbers"));
  EXPECT_THAT(refusal(OnnxWriter().input("x", {1 << 20}).output("x").bytes()), HasSubstr("computes more than"));
  OnnxWriter doubling;
  doubling.input("x0", {1, 1024}).output("x30");
  for (int i = 0; i < 30; ++i) {
    const std::string from = "x" + std::to_string(i);
    doubling.node("Concat", {from, from}, {"x" + std::to_string(i + 1)}, {testing::whole("axis", 1)});
  }
  EXPECT_THAT(refusal(doubling.bytes()), HasSubstr("at most 4194304 numbers"));
}

TEST(Networks, RefuseWhatIsNoFile) {
  EXPECT_THAT(refusal(""), HasSubstr("it has no graph"));
  EXPECT_THAT(refusal("<html>no network</html>"), HasSubstr("is no ONNX file, or a damaged one"));
  const std::string whole = mixture(Numbers::float32);
  for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_NE(refusal(whole.substr(0, size)), "") << size;
}

// Whatever a file says, the answer is a network or a message.
TEST(Networks, SurviveDamage) {
  const std::string whole = mixture(Numbers::float64);
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string bytes = whole;
    for (unsigned k = 0; k <= random() % 3; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
    refused += refusal(bytes).empty() ? 0 : 1;
  }
  EXPECT_GT(refused, 300);
}

}  // namespace
}  // namespace graze
