// Claim: a file that is small and hostile is refused with a message of one line, before it costs much time or memory:
// large dimensions behind a 0, more work than a call or a reader has time for, lists that say a thing twice. What is
// empty by right is computed as the ONNX standard says.
#include <gmock/gmock.h>

#include "tests/engine/network/evaluate.h"

namespace graze {
namespace {

using testing::Dims;
using testing::evaluate;
using ::testing::HasSubstr;
using testing::Names;
using testing::Numbers;
using testing::OnnxWriter;
using testing::refusal;
using testing::spread;
using testing::whole;

constexpr std::int64_t kHuge = std::int64_t{1} << 40;

OnnxWriter& node_of_empty(OnnxWriter& out, const std::string& type, const Names& inputs, const Names& attributes = {}) {
  out.input("x", {1, 12}).output("y").constant("A", {1, 0}, {}).constant("B", {0, 12}, {}).constant("At", {0, 1}, {});
  out.constant("C", {12}, std::vector<double>(12, 0.25));
  return out.node(type, inputs, {"z"}, attributes);
}

TEST(HostileNetworks, AnEmptySumIsZero) {
  const std::vector<double> x = spread(12, 0);
  const auto given = [](const std::string& type, const Names& inputs, const Names& attributes = {}) {
    OnnxWriter out;
    return evaluate(node_of_empty(out, type, inputs, attributes).node("Add", {"x", "z"}, {"y"}).bytes());
  };
  std::vector<double> with_bias = x;
  for (double& number : with_bias) number += 0.25;
  EXPECT_EQ(given("MatMul", {"A", "B"}), x);
  EXPECT_EQ(given("Gemm", {"A", "B"}), x);
  EXPECT_EQ(given("Gemm", {"A", "B", "C"}), with_bias);
  EXPECT_EQ(given("Gemm", {"At", "B", "C"}, {whole("transA", 1)}), with_bias);
  OnnxWriter turned;
  node_of_empty(turned, "MatMul", {"A", "B"}).node("Transpose", {"z"}, {"zt"}).node("Transpose", {"zt"}, {"zz"});
  EXPECT_EQ(evaluate(turned.node("Add", {"x", "zz"}, {"y"}).bytes()), x);
  OnnxWriter of_nothing;  // [0, 12], and as the answer nothing at all
  node_of_empty(of_nothing, "MatMul", {"At", "A"}).node("MatMul", {"B", "C"}, {"y"});
  EXPECT_EQ(evaluate(of_nothing.bytes()), std::vector<double>());
}

/// A recurrent layer of constants of no times.
std::string without_times(const std::string& type, int gates, std::int64_t batch) {
  OnnxWriter out;
  out.input("x", {1, 3}).output("y").constant("X", {0, batch, 1}, {});
  const std::vector<double> w(static_cast<std::size_t>(gates), 0.5);
  out.constant("W", {1, gates, 1}, w).constant("R", {1, gates, 1}, w);
  out.node(type, {"X", "W", "R"}, {"", "h"}, {whole("hidden_size", 1)});
  return out.node("ReduceSum", {"h"}, {"s"}, {whole("keepdims", 0)}).node("Add", {"x", "s"}, {"y"}).bytes();
}

TEST(HostileNetworks, NoDimensionHidesBehindAZero) {
  const auto hidden = HasSubstr("at most 4194304 numbers, also without its dimension of 0");
  EXPECT_THAT(refusal(without_times("LSTM", 4, kHuge)), hidden);
  EXPECT_THAT(refusal(without_times("GRU", 3, kHuge)), hidden);
  // What fits is computed, in time that goes with the batch and not with its square.
  EXPECT_EQ(evaluate(without_times("LSTM", 4, 100000)), spread(3, 0));
  EXPECT_EQ(evaluate(without_times("GRU", 3, 100000)), spread(3, 0));
  const auto shaped = [](const std::string& type, const Names& inputs, const Names& attributes = {}) {
    OnnxWriter out;
    out.input("x", {1, 3}).output("y").constant("none", {0, 3000000}, {}).constant("many", {3000000, 0}, {});
    out.wholes("s", {0, 1LL << 40}).wholes("e", {});
    out.field(5, testing::tensor("i", {0, 3000000}, {}, Numbers::int64));
    return refusal(out.node(type, inputs, {"y"}, attributes).bytes());
  };
  EXPECT_THAT(shaped("ConstantOfShape", {"s"}), hidden);
  EXPECT_THAT(shaped("Expand", {"x", "s"}), HasSubstr("do not fit each other"));
  EXPECT_THAT(shaped("Reshape", {"e", "s"}), HasSubstr("at most 4194304 numbers"));
  EXPECT_THAT(shaped("Gather", {"none", "i"}), hidden);
  EXPECT_THAT(shaped("Add", {"none", "many"}), HasSubstr("do not fit each other"));
  EXPECT_THAT(shaped("MatMul", {"many", "none"}), HasSubstr("at most 4194304 numbers"));
}

// Neither indices nor time grow beyond what one call may take.
TEST(HostileNetworks, ACallHasABound) {
  OnnxWriter out;
  out.input("x", {1, 12}).wholes("s", {100000, 12}).node("Expand", {"x", "s"}, {"c"});
  for (int i = 0; i < 9; ++i) {
    const std::string name = "r" + std::to_string(i);
    out.output(name).node("ReduceSum", {"c"}, {name});
  }
  EXPECT_EQ(refusal(out.bytes()),
            "node '/r8' (ReduceSum) takes 1200000 operations in each call on top of 9600000 before it; at most "
            "10000000 together");
  // One output of a dense layer costs as much as a whole tile.
  OnnxWriter narrow;
  narrow.input("x", {1, 12}).output("y").wholes("s", {1, 2000000, 12}).wholes("t", {2000000, 1}).wholes("u", {1, -1});
  narrow.wholes("v", {1, 2000000}).node("Gather", {"x", "zero"}, {"g"}, {whole("axis", 1)}).wholes("zero", {0});
  narrow.node("Expand", {"g", "v"}, {"w"}).node("ConstantOfShape", {"t"}, {"k"}).node("MatMul", {"w", "k"}, {"y"});
  EXPECT_THAT(refusal(narrow.bytes()), HasSubstr("(MatMul) takes 16000000 operations in each call on top of 0"));
}

TEST(HostileNetworks, ReadingHasABound) {
  const auto joined = [](int count) {
    OnnxWriter out;
    out.input("x", {1}).output("y").wholes("s", {1 << 20, 0}).node("ConstantOfShape", {"s"}, {"c"});
    return refusal(out.node("Concat", Names(static_cast<std::size_t>(count), "c"), {"y"}, {whole("axis", 1)}).bytes());
  };
  EXPECT_EQ(joined(10), "");
  EXPECT_THAT(joined(80), HasSubstr("(Concat) goes through 1048576 numbers on top of the "));
  EXPECT_THAT(joined(80), HasSubstr("; at most 67108864 together"));
}

/// What y is if a node takes constants c [2, 3] and k [3, 2] of the file, and if it takes c from an input.
std::vector<double> of_known(const std::string& type, const Names& more, Numbers numbers, bool known,
                             double* products) {
  OnnxWriter out(numbers);
  out.input("x", {1}).output("y").constant("c", {2, 3}, {0.1, 1.7, -2.3, 4.9, 0.7, 1e-3}).constant("zero", {}, {0});
  out.constant("k", {3, 2}, {0.3, -1.1, 0.9, 2.2, -0.4, 0.8}).node("Mul", {"x", "zero"}, {"n"});
  out.node("Add", {"c", "n"}, {"computed"});
  Names inputs{known ? "c" : "computed"};
  inputs.insert(inputs.end(), more.begin(), more.end());
  const std::string bytes = out.node(type, inputs, {"y"}, {}).bytes();
  *products = Network(bytes, testing::network_kernel()).multiplications();
  return evaluate(bytes);
}

// What is known when the file is read has the bits that it would have if it were computed in each call.
TEST(HostileNetworks, ConstantsAreComputedOnce) {
  for (const Numbers numbers : {Numbers::float32, Numbers::float64}) {
    for (const char* type : {"ReduceSum", "ReduceMean", "ReduceMax", "MatMul", "Gemm"}) {
      const Names more = type[0] == 'R' ? Names{} : Names{"k"};
      double known = 0, computed = 0;
      EXPECT_EQ(of_known(type, more, numbers, true, &known), of_known(type, more, numbers, false, &computed)) << type;
      EXPECT_EQ(known, 0) << type;
      EXPECT_EQ(computed, more.empty() ? 0 : 12) << type;
    }
  }
}

TEST(HostileNetworks, ListsSayAThingOnce) {
  const auto message = [](const std::string& type, const Names& more, const Names& attributes = {},
                          int operator_set = 17) {
    OnnxWriter out(Numbers::float64, operator_set);
    Names inputs{"x"};
    inputs.insert(inputs.end(), more.begin(), more.end());
    out.input("x", {2, 3}).output("y").wholes("zz", {0, 0}).wholes("one", {1}).wholes("ones", {1, 1});
    out.wholes("long", std::vector<double>(5000, 1)).wholes("seven", {0, 1, 2, 3, 4, 5, 6});
    return refusal(out.node(type, inputs, {"y"}, attributes).bytes());
  };
  EXPECT_THAT(message("Slice", {"zz", "ones", "zz"}), HasSubstr("(Slice) has axis 0 twice"));
  EXPECT_THAT(message("Split", {"ones"}), HasSubstr("(Split) has 2 lengths and 1 outputs"));
  EXPECT_THAT(message("Squeeze", {"one"}), HasSubstr("(Squeeze) drops dimension 1 of shape [2, 3], which is not 1"));
  EXPECT_THAT(message("Unsqueeze", {"seven"}), HasSubstr("has a tensor of 9 dimensions; at most 8"));
  for (const char* type : {"Reshape", "Expand"}) {
    EXPECT_THAT(message(type, {"long"}), HasSubstr("has a tensor of 5000 dimensions; at most 8")) << type;
  }
  // A port costs a line of the file, and its rows are as many as the tensor's.
  EXPECT_EQ(refusal(OnnxWriter().input("x", {1, 3}).output("x").output("x").bytes()), "has two outputs 'x'");
  EXPECT_EQ(
      refusal(OnnxWriter().input("x", {1, 1}).constant("w", {1}, {1}).constant("w", {1}, {2}).output("x").bytes()),
      "has two constants 'w'");
  EXPECT_THAT(refusal(OnnxWriter().input("x", Dims(9, 1)).output("x").bytes()),
              HasSubstr("has 9 dimensions; at most 8"));
  OnnxWriter wide;
  for (int i = 0; i < 101; ++i) wide.input("x" + std::to_string(i), {1});
  EXPECT_EQ(refusal(wide.output("x0").bytes()), "has 101 inputs; at most 100");
  EXPECT_THAT(refusal(OnnxWriter().input(std::string(100000, 'x'), {1}).output("x").bytes()),
              HasSubstr("…' of 100000 bytes; names have at most 256"));
  OnnxWriter deep;
  deep.input("x", {1}).output("x").constant("w", Dims(9, 1), {1});
  EXPECT_THAT(refusal(deep.bytes()), HasSubstr("the constant 'w' has a tensor of 9 dimensions; at most 8"));
}

}  // namespace
}  // namespace graze
