// Claim: each operator gives what the ONNX standard says, by formulas of their own here, and shapes are as NumPy has
// them.
#include <gmock/gmock.h>

#include <functional>

#include "tests/engine/network/evaluate.h"

namespace graze {
namespace {

using testing::Dims;
using testing::evaluate;
using testing::expect_near;
using testing::Names;
using testing::Numbers;
using testing::OnnxWriter;
using testing::spread;

/// One operator on an input of shape [1, 6], with constants k (one number) and v (six).
std::vector<double> of_one(const std::string& type, const Names& attributes = {}, const Names& more = {},
                           int lane = 0) {
  OnnxWriter out;
  Names inputs{"x"};
  inputs.insert(inputs.end(), more.begin(), more.end());
  out.input("x", {1, 6}).output("y").constant("k", {}, {0.75}).constant("low", {}, {-0.5});
  out.constant("v", {6}, {1, -2, 0.5, 3, -0.25, 0.125}).node(type, inputs, {"y"}, attributes);
  return evaluate(out.bytes(), lane);
}

std::vector<double> mapped(const std::function<double(double)>& f, int lane = 0) {
  std::vector<double> out;
  for (const double x : spread(6, lane)) out.push_back(f(x));
  return out;
}

TEST(NetworkOperators, OfOneNumber) {
  constexpr double kNear = 4e-15;
  const auto elu = [](double a) { return [a](double x) { return x < 0 ? a * std::expm1(x) : x; }; };
  for (const int lane : {0, 5}) {
    const auto same = [&](const std::string& type, const Names& attributes, const std::function<double(double)>& f) {
      SCOPED_TRACE(type);
      expect_near(of_one(type, attributes, {}, lane), mapped(f, lane), kNear);
    };
    same("Relu", {}, [](double x) { return std::fmax(x, 0); });
    same("LeakyRelu", {testing::real("alpha", 0.25f)}, [](double x) { return x < 0 ? 0.25 * x : x; });
    same("Elu", {}, elu(1));
    same("Elu", {testing::real("alpha", 0.5f)}, elu(0.5));
    same("Selu", {}, [&](double x) { return 1.05070102214813232421875 * elu(1.67326319217681884765625)(x); });
    same("Tanh", {}, [](double x) { return std::tanh(x); });
    same("Sigmoid", {}, [](double x) { return 1 / (1 + std::exp(-x)); });
    same("HardSigmoid", {}, [](double x) { return std::fmin(1, std::fmax(0, 0.2f * x + 0.5)); });
    same("Softplus", {}, [](double x) { return std::log1p(std::exp(x)); });
    same("Softsign", {}, [](double x) { return x / (1 + std::fabs(x)); });
    same("Exp", {}, [](double x) { return std::exp(x); });
    same("Sin", {}, [](double x) { return std::sin(x); });
    same("Cos", {}, [](double x) { return std::cos(x); });
    same("Abs", {}, [](double x) { return std::fabs(x); });
    same("Neg", {}, [](double x) { return -x; });
    same("Reciprocal", {}, [](double x) { return 1 / x; });
    same("Identity", {}, [](double x) { return x; });
    same("Cast", {testing::whole("to", 1)}, [](double x) { return static_cast<double>(static_cast<float>(x)); });
  }
  expect_near(of_one("Clip", {}, {"low", "k"}), mapped([](double x) { return std::fmin(0.75, std::fmax(-0.5, x)); }),
              0);
  expect_near(of_one("Clip", {}, {"", "k"}), mapped([](double x) { return std::fmin(0.75, x); }), 0);
}

TEST(NetworkOperators, OfTwoNumbers) {
  const std::vector<double> v{1, -2, 0.5, 3, -0.25, 0.125}, x = spread(6, 0);
  const auto same = [&](const std::string& type, const std::function<double(double, double)>& f) {
    SCOPED_TRACE(type);
    std::vector<double> by_each, by_one;
    for (std::size_t i = 0; i < 6; ++i) by_each.push_back(f(x[i], v[i])), by_one.push_back(f(x[i], 0.75));
    expect_near(of_one(type, {}, {"v"}), by_each, 0);
    expect_near(of_one(type, {}, {"k"}), by_one, 0);
  };
  same("Add", [](double a, double b) { return a + b; });
  same("Sub", [](double a, double b) { return a - b; });
  same("Mul", [](double a, double b) { return a * b; });
  same("Div", [](double a, double b) { return a / b; });
  same("Min", [](double a, double b) { return std::fmin(a, b); });
  same("Max", [](double a, double b) { return std::fmax(a, b); });
  same("PRelu", [](double a, double b) { return a < 0 ? b * a : a; });
}

TEST(NetworkOperators, OfManyNumbers) {
  const std::vector<double> v{1, -2, 0.5, 3, -0.25, 0.125}, x = spread(6, 0);
  std::vector<double> least, greatest, sum;
  for (std::size_t i = 0; i < 6; ++i) {
    least.push_back(std::fmin(std::fmin(x[i], v[i]), 0.75));
    greatest.push_back(std::fmax(std::fmax(x[i], v[i]), 0.75));
    sum.push_back(x[i] + v[i] + 0.75);
  }
  expect_near(of_one("Min", {}, {"v", "k"}), least, 0);
  expect_near(of_one("Max", {}, {"v", "k"}), greatest, 0);
  expect_near(of_one("Sum", {}, {"v", "k"}), sum, 0);
  expect_near(of_one("Max"), x, 0);
}

// What an attribute changes must not be passed over.
TEST(NetworkOperators, RefuseAttributesThatAreNotKnown) {
  const auto message = [](const std::string& type, const std::string& attribute) {
    OnnxWriter out;
    return testing::refusal(
        out.input("x", {1, 6}).output("y").wholes("s", {0, 6}).node(type, {"x", "s"}, {"y"}, {attribute}).bytes());
  };
  EXPECT_THAT(message("Reshape", testing::whole("allowzero", 1)),
              ::testing::HasSubstr("has allowzero = 1; only 0 is known"));
  EXPECT_THAT(message("ReduceMean", testing::whole("noop_with_empty_axes", 1)),
              ::testing::HasSubstr("only 0 is known"));
  EXPECT_THAT(message("Shape", testing::whole("end", 1)), ::testing::HasSubstr("only whole shapes are known"));
}

TEST(NetworkOperators, NanIsHandedOn) {
  for (const char* type : {"Relu", "Elu", "Tanh", "Sigmoid", "Softplus", "Exp", "LeakyRelu", "HardSigmoid"}) {
    OnnxWriter out;
    out.input("x", {1, 2}).output("y").constant("nan", {}, {std::nan("")});
    out.node("Mul", {"x", "nan"}, {"z"}).node(type, {"z"}, {"y"});
    for (const double y : evaluate(out.bytes())) EXPECT_TRUE(std::isnan(y)) << type;
  }
}

/// sum over k of a[i][k] b[k][j]
std::vector<double> times(const std::vector<double>& a, const std::vector<double>& b, std::size_t m, std::size_t k,
                          std::size_t n) {
  std::vector<double> out(m * n);
  for (std::size_t i = 0; i < m * n; ++i) {
    for (std::size_t l = 0; l < k; ++l) out[i] += a[i / n * k + l] * b[l * n + i % n];
  }
  return out;
}

TEST(NetworkOperators, Layers) {
  constexpr std::size_t kInputs = 7, kOutputs = 19;  // more than two tiles
  std::vector<double> w(kInputs * kOutputs), turned(w.size()), c(kOutputs);
  for (std::size_t i = 0; i < w.size(); ++i) w[i] = std::cos(0.37 * static_cast<double>(i));
  for (std::size_t i = 0; i < w.size(); ++i) turned[i % kOutputs * kInputs + i / kOutputs] = w[i];
  for (std::size_t j = 0; j < c.size(); ++j) c[j] = 0.1 * static_cast<double>(j);
  const std::vector<double> x = spread(kInputs, 3), product = times(x, w, 1, kInputs, kOutputs);
  const auto given = [&](const std::string& type, const Names& inputs, const Names& attributes) {
    OnnxWriter out;
    out.input("x", {0, kInputs}).output("y").constant("w", {kInputs, kOutputs}, w).constant("c", {kOutputs}, c);
    out.constant("wt", {kOutputs, kInputs}, turned)
        .node("Transpose", {"x"}, {"xt"})
        .node(type, inputs, {"y"}, attributes);
    return evaluate(out.bytes(), 3);
  };
  std::vector<double> with_bias = product, scaled = product;
  for (std::size_t j = 0; j < c.size(); ++j) with_bias[j] += c[j], scaled[j] = 2 * product[j] + 0.5 * c[j];
  expect_near(given("MatMul", {"x", "w"}, {}), product, 1e-14);
  expect_near(given("MatMul", {"wt", "xt"}, {}), product, 1e-14);
  expect_near(given("Gemm", {"x", "w"}, {}), product, 1e-14);
  expect_near(given("Gemm", {"x", "w", "c"}, {}), with_bias, 1e-14);
  expect_near(given("Gemm", {"x", "wt", "c"}, {testing::whole("transB", 1)}), with_bias, 1e-14);
  expect_near(given("Gemm", {"xt", "w", "c"},
                    {testing::whole("transA", 1), testing::real("alpha", 2), testing::real("beta", 0.5)}),
              scaled, 1e-14);
}

TEST(NetworkOperators, Normalisations) {
  const std::vector<double> x = spread(6, 2), v{1, -2, 0.5, 3, -0.25, 0.125}, u{0.5, 1, 2, 4, 1, 3};
  double mean = 0, variance = 0, sum = 0;
  for (const double a : x) mean += a / 6;
  for (const double a : x) variance += (a - mean) * (a - mean) / 6, sum += std::exp(a);
  std::vector<double> layer, batch, soft;
  for (std::size_t i = 0; i < 6; ++i) {
    layer.push_back((x[i] - mean) / std::sqrt(variance + 1e-5) * u[i] + v[i]);
    batch.push_back((x[i] - v[i]) / std::sqrt(u[i] + 1e-5) * u[i] + v[i]);
    soft.push_back(std::exp(x[i]) / sum);
  }
  const auto given = [&](const std::string& type, const Names& inputs, const Names& attributes = {}) {
    OnnxWriter out;
    out.input("x", {1, 6})
        .output("y")
        .constant("v", {6}, v)
        .constant("u", {6}, u)
        .node(type, inputs, {"y"}, attributes);
    return evaluate(out.bytes(), 2);
  };
  constexpr double kEpsilon = 1e-12;  // the standard's 1e-5 is a float
  expect_near(given("LayerNormalization", {"x", "u", "v"}), layer, kEpsilon);
  expect_near(given("BatchNormalization", {"x", "u", "v", "v", "u"}), batch, kEpsilon);
  expect_near(given("Softmax", {"x"}), soft, 1e-15);
  expect_near(given("ReduceMean", {"x"}, {testing::wholes("axes", {-1})}), {mean}, 1e-15);
  // As exporters wrote layer normalisation before it had an operator.
  OnnxWriter by_parts;
  by_parts.input("x", {1, 6}).output("y").constant("two", {}, {2}).constant("e", {}, {1e-5}).constant("u", {6}, u);
  by_parts.node("ReduceMean", {"x"}, {"m"}, {testing::wholes("axes", {-1})}).node("Sub", {"x", "m"}, {"d"});
  by_parts.node("Pow", {"d", "two"}, {"p"}).node("ReduceMean", {"p"}, {"q"}, {testing::wholes("axes", {-1})});
  by_parts.node("Add", {"q", "e"}, {"r"}).node("Sqrt", {"r"}, {"s"}).node("Div", {"d", "s"}, {"t"});
  by_parts.node("Mul", {"t", "u"}, {"y"});
  for (std::size_t i = 0; i < 6; ++i) layer[i] -= v[i];
  expect_near(evaluate(by_parts.bytes(), 2), layer, kEpsilon);
}

TEST(NetworkOperators, Shapes) {
  const std::vector<double> x = spread(6, 0);
  const auto given = [&](const std::string& type, const Names& more, const Names& outputs, const Names& attributes,
                         const Dims& shape = {2, 3}) {
    OnnxWriter out(Numbers::float64, type == "Split" ? 11 : 17);
    Names inputs{"x"};
    inputs.insert(inputs.end(), more.begin(), more.end());
    out.input("x", shape).wholes("m1", {-1}).wholes("zero", {0}).wholes("one", {1}).wholes("two", {2});
    out.wholes("far", {9e18}).wholes("odd", {2, 0}).wholes("three_two", {3, -1});
    for (const std::string& name : outputs) out.output(name);
    return evaluate(out.node(type, inputs, outputs, attributes).bytes());
  };
  const auto picked = [&](const std::vector<int>& places) {
    std::vector<double> out;
    for (const int i : places) out.push_back(x[static_cast<std::size_t>(i)]);
    return out;
  };
  const auto same = [&](const std::vector<double>& got, const std::vector<int>& places) {
    expect_near(got, picked(places), 0);
  };
  same(given("Transpose", {}, {"y"}, {}), {0, 3, 1, 4, 2, 5});
  same(given("Slice", {"one", "far", "one"}, {"y"}, {}), {1, 2, 4, 5});
  same(given("Slice", {"m1", "zero", "one", "m1"}, {"y"}, {}), {2, 1, 5, 4});
  same(given("Gather", {"odd"}, {"y"}, {testing::whole("axis", 1)}), {2, 0, 5, 3});
  same(given("Split", {}, {"a", "b"}, {testing::whole("axis", 1), testing::wholes("split", {1, 2})}),
       {0, 3, 1, 2, 4, 5});
  same(given("Concat", {"x"}, {"y"}, {testing::whole("axis", 1)}), {0, 1, 2, 0, 1, 2, 3, 4, 5, 3, 4, 5});
  same(given("Reshape", {"three_two"}, {"y"}, {}), {0, 1, 2, 3, 4, 5});
  same(given("Flatten", {}, {"y"}, {}), {0, 1, 2, 3, 4, 5});
  // Through shapes that are computed, as exporters write them: zeros of the shape of x, and their sum.
  OnnxWriter chain;
  chain.input("x", {0, 6}).output("y").wholes("zero", {0}).wholes("six", {6}).wholes("axis", {0});
  chain.node("Shape", {"x"}, {"s"})
      .node("Gather", {"s", "zero"}, {"n"})
      .node("Concat", {"n", "six"}, {"t"}, {testing::whole("axis", 0)});
  chain.node("Unsqueeze", {"x", "axis"}, {"u"}).node("Squeeze", {"u", "axis"}, {"v"}).node("Expand", {"v", "t"}, {"w"});
  chain.node("Reshape", {"w", "t"}, {"y"});
  same(evaluate(chain.bytes()), {0, 1, 2, 3, 4, 5});
}

}  // namespace
}  // namespace graze
