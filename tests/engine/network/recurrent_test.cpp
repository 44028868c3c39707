// Claim: LSTM and GRU are those of the ONNX standard, by formulas of their own here, over several times, from what was
// remembered before.
#include "tests/engine/network/evaluate.h"

namespace graze {
namespace {

using testing::evaluate;
using testing::expect_near;
using testing::Names;
using testing::OnnxWriter;
using testing::spread;

constexpr int kIn = 3, kWide = 4, kTimes = 2, kLane = 6;

struct Weights {
  std::vector<double> w, r, b;
  explicit Weights(int gates) : w(gates * kWide * kIn), r(gates * kWide * kWide), b(2 * gates * kWide) {
    for (std::size_t i = 0; i < w.size(); ++i) w[i] = std::sin(0.7 * static_cast<double>(i));
    for (std::size_t i = 0; i < r.size(); ++i) r[i] = std::cos(1.1 * static_cast<double>(i));
    for (std::size_t i = 0; i < b.size(); ++i) b[i] = 0.3 * std::sin(2.3 * static_cast<double>(i));
  }
  double of_input(int row, const double* x) const {
    double out = b[row];
    for (int k = 0; k < kIn; ++k) out += w[row * kIn + k] * x[k];
    return out;
  }
  double of_old(int gates, int row, const std::vector<double>& h) const {
    double out = b[gates * kWide + row];
    for (int k = 0; k < kWide; ++k) out += r[row * kWide + k] * h[k];
    return out;
  }
};

double logistic(double x) { return 1 / (1 + std::exp(-x)); }

std::string layer(const std::string& type, int gates, bool cell, const Names& attributes) {
  const Weights weights(gates);
  OnnxWriter out;
  out.input("x", {kTimes, 1, kIn}).input("h", {1, 1, kWide});
  if (cell) out.input("c", {1, 1, kWide});
  out.constant("W", {1, gates * kWide, kIn}, weights.w).constant("R", {1, gates * kWide, kWide}, weights.r);
  out.constant("B", {1, 2 * gates * kWide}, weights.b);
  Names inputs{"x", "W", "R", "B", "", "h"}, outputs{"y", "hn"};
  if (cell) inputs.push_back("c"), outputs.push_back("cn");
  for (const std::string& name : outputs) out.output(name);
  return out.node(type, inputs, outputs, attributes).bytes();
}

TEST(RecurrentNetworks, Lstm) {
  const Weights weights(4);
  const std::vector<double> x = spread(kTimes * kIn, kLane);
  std::vector<double> h = spread(kWide, kLane, 100), c = spread(kWide, kLane, 200), want;
  for (int t = 0; t < kTimes; ++t) {
    const std::vector<double> old = h;
    for (int k = 0; k < kWide; ++k) {
      const auto sum = [&](int gate) {
        return weights.of_input(gate * kWide + k, &x[t * kIn]) + weights.of_old(4, gate * kWide + k, old);
      };
      c[k] = logistic(sum(2)) * c[k] + logistic(sum(0)) * std::tanh(sum(3));  // gates: input, output, forget, cell
      h[k] = logistic(sum(1)) * std::tanh(c[k]);
    }
    want.insert(want.end(), h.begin(), h.end());
  }
  want.insert(want.end(), h.begin(), h.end());
  want.insert(want.end(), c.begin(), c.end());
  expect_near(evaluate(layer("LSTM", 4, true, {testing::whole("hidden_size", kWide)}), kLane), want, 1e-14);
}

TEST(RecurrentNetworks, Gru) {
  const Weights weights(3);
  for (const bool reset_after : {false, true}) {
    const std::vector<double> x = spread(kTimes * kIn, kLane);
    std::vector<double> h = spread(kWide, kLane, 100), want;
    for (int t = 0; t < kTimes; ++t) {
      const std::vector<double> old = h;
      std::vector<double> z(kWide), r(kWide), reset(kWide);
      for (int k = 0; k < kWide; ++k) {
        z[k] = logistic(weights.of_input(k, &x[t * kIn]) + weights.of_old(3, k, old));
        r[k] = logistic(weights.of_input(kWide + k, &x[t * kIn]) + weights.of_old(3, kWide + k, old));
        reset[k] = r[k] * old[k];
      }
      for (int k = 0; k < kWide; ++k) {
        const int row = 2 * kWide + k;
        const double past = reset_after ? r[k] * weights.of_old(3, row, old) : weights.of_old(3, row, reset);
        h[k] = (1 - z[k]) * std::tanh(weights.of_input(row, &x[t * kIn]) + past) + z[k] * old[k];
      }
      want.insert(want.end(), h.begin(), h.end());
    }
    want.insert(want.end(), h.begin(), h.end());
    expect_near(evaluate(layer("GRU", 3, false, {testing::whole("linear_before_reset", reset_after ? 1 : 0)}), kLane),
                want, 1e-14);
  }
}

TEST(RecurrentNetworks, RefuseWhatIsNotKnown) {
  const auto message = [](const Names& attributes) { return testing::refusal(layer("LSTM", 4, true, attributes)); };
  EXPECT_NE(message({testing::word("direction", "reverse")}).find("runs reverse; only forward is known"),
            std::string::npos);
  EXPECT_NE(message({testing::real("clip", 3)}).find("has 'clip' of its own"), std::string::npos);
  EXPECT_EQ(message({}), "");
  EXPECT_NE(message({testing::whole("hidden_size", kWide + 1)}).find("has hidden_size"), std::string::npos);
  const auto activations = [](const Names& names) {
    testing::Message out;
    out.text(1, "activations");
    for (const std::string& name : names) out.text(9, name);
    return out.bytes();
  };
  EXPECT_EQ(message({activations({"Sigmoid", "Tanh", "Tanh"})}), "");
  EXPECT_NE(message({activations({"Sigmoid", "Relu", "Tanh"})}).find("other than the usual ones"), std::string::npos);
  EXPECT_NE(testing::refusal(layer("LSTM", 3, true, {})).find("which do not fit"), std::string::npos);
}

}  // namespace
}  // namespace graze
