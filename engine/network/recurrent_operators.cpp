// LSTM and GRU, step by step in time, of one robot's sequence (of one step, for policies). What they keep from call to
// call goes in and out of the network as tensors (`memory` of the policy).

#include <fmt/format.h>

#include <algorithm>

#include "engine/network/operators.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

/// A recurrent layer's operands, as both kinds have them.
struct Recurrent {
  std::int64_t times = 0, batch = 0, inputs = 0, width = 0;
  std::vector<double> w, r;    // [gates width][inputs] and [gates width][width]
  std::vector<double> bw, br;  // [gates width] each
};

Recurrent recurrent_operands(const OperatorCall& call, std::int64_t gates) {
  const OnnxAttribute* const direction = call.find("direction");
  if (direction && direction->text != "forward")
    throw NetworkError("runs " + clipped(direction->text, 80) + "; only forward is known");
  call.only("layout", 0);
  call.only("input_forget", 0);
  std::vector<std::string> usual{"Sigmoid", "Tanh"};
  if (gates == 4) usual.emplace_back("Tanh");
  const OnnxAttribute* const activations = call.find("activations");
  if (activations && activations->texts != usual) throw NetworkError("has 'activations' other than the usual ones");
  for (const char* refused : {"activation_alpha", "activation_beta", "clip"}) {
    if (call.find(refused))
      throw NetworkError(fmt::format("has '{}' of its own; only what is usual is known", refused));
  }
  if (call.has(4)) throw NetworkError("has lengths of sequences; only whole ones are known");
  if (call.has(7)) throw NetworkError("has peepholes, which are not known");
  const TensorShape &x = call.operand(0).shape, &w = call.operand(1).shape, &r = call.operand(2).shape;
  const bool fits = x.size() == 3 && w.size() == 3 && r.size() == 3 && w[0] == 1 && r[0] == 1 && r[2] > 0 &&
                    r[1] == gates * r[2] && w[1] == r[1] && w[2] == x[2];
  if (!fits) {
    throw NetworkError(fmt::format("has an input of shape {}, weights of {} and recurrent ones of {}, which do not fit",
                                   text_of(x), text_of(w), text_of(r)));
  }
  if (const std::int64_t written = call.integer("hidden_size", r[2]); written != r[2]) {
    throw NetworkError(fmt::format("has hidden_size {}, and recurrent weights of {}", written, text_of(r)));
  }
  Recurrent out{x[0], x[1], x[2], r[2], call.constants(1, "weights"), call.constants(2, "recurrent weights"), {}, {}};
  const auto size = static_cast<std::size_t>(w[1]);
  std::vector<double> bias(2 * size, 0.0);
  if (call.has(3)) bias = call.constants(3, "biases");
  if (bias.size() != 2 * size) throw NetworkError(fmt::format("has {} biases, and needs {}", bias.size(), 2 * size));
  out.bw.assign(bias.begin(), bias.begin() + w[1]);
  out.br.assign(bias.begin() + w[1], bias.end());
  return out;
}

/// What the layer remembers of one sequence of the batch when it begins: operand i, or zeros.
std::vector<Element> beginning(const OperatorCall& call, std::size_t i, const Recurrent& layer, std::int64_t which) {
  if (!call.has(i)) return std::vector<Element>(static_cast<std::size_t>(layer.width));
  const Tensor& all = call.operand(i);
  if (all.shape != TensorShape{1, layer.batch, layer.width}) {
    throw NetworkError(
        fmt::format("begins with shape {} where [1, {}, {}] must stand", text_of(all.shape), layer.batch, layer.width));
  }
  const auto first = all.elements.begin() + which * layer.width;
  return {first, first + layer.width};
}

/// Weights of rows [first, first + count) on the input and what is remembered, side by side.
std::vector<double> joint_weights(const Recurrent& layer, std::int64_t first, std::int64_t count) {
  std::vector<double> out;
  for (std::int64_t i = first; i < first + count; ++i) {
    out.insert(out.end(), layer.w.begin() + i * layer.inputs, layer.w.begin() + (i + 1) * layer.inputs);
    out.insert(out.end(), layer.r.begin() + i * layer.width, layer.r.begin() + (i + 1) * layer.width);
  }
  return out;
}

std::vector<double> joint_biases(const Recurrent& layer, std::int64_t first, std::int64_t count) {
  std::vector<double> out;
  for (std::int64_t i = first; i < first + count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    out.push_back(layer.bw[at] + layer.br[at]);
  }
  return out;
}

std::vector<Element> joined(std::vector<Element> a, const std::vector<Element>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// Arithmetic on vectors of one type.
struct VectorAlgebra {
  ProgramBuilder& build;
  ElementType type;
  Tensor of(const std::vector<Element>& elements) const {
    return {{static_cast<std::int64_t>(elements.size())}, type, elements};
  }
  std::vector<Element> map(UnaryOp op, const std::vector<Element>& a) const { return build.unary(op, of(a)).elements; }
  std::vector<Element> two(BinaryOp op, const std::vector<Element>& a, const std::vector<Element>& b) const {
    return build.binary(op, of(a), of(b)).elements;
  }
};

std::vector<Element> part(const std::vector<Element>& in, std::int64_t i, std::int64_t width) {
  return {in.begin() + i * width, in.begin() + (i + 1) * width};
}

struct CellState {
  std::vector<Element> h, c;
};

/// One step of an LSTM; gates in the order input, output, forget, cell.
CellState lstm_step(const VectorAlgebra& on, const Recurrent& layer, const std::vector<Element>& x,
                    const CellState& old) {
  const std::int64_t n = layer.width;
  const std::vector<Element> sums =
      on.build.dense(joined(x, old.h), joint_weights(layer, 0, 4 * n), joint_biases(layer, 0, 4 * n), on.type);
  const std::vector<Element> gates = on.map(UnaryOp::sigmoid, {sums.begin(), sums.begin() + 3 * n});
  const std::vector<Element> fresh = on.map(UnaryOp::hyperbolic_tangent, part(sums, 3, n));
  CellState out;
  out.c = on.two(BinaryOp::add, on.two(BinaryOp::multiply, part(gates, 2, n), old.c),
                 on.two(BinaryOp::multiply, part(gates, 0, n), fresh));
  out.h = on.two(BinaryOp::multiply, part(gates, 1, n), on.map(UnaryOp::hyperbolic_tangent, out.c));
  return out;
}

/// One step of a GRU; gates in the order update, reset, hidden.
CellState gru_step(const VectorAlgebra& on, const Recurrent& layer, bool reset_after, const std::vector<Element>& x,
                   const CellState& old) {
  const std::int64_t n = layer.width;
  const std::vector<Element> gates =
      on.map(UnaryOp::sigmoid,
             on.build.dense(joined(x, old.h), joint_weights(layer, 0, 2 * n), joint_biases(layer, 0, 2 * n), on.type));
  const std::vector<Element> update = part(gates, 0, n), reset = part(gates, 1, n);
  std::vector<Element> sums;
  if (reset_after) {
    const std::vector<double> w(layer.w.begin() + 2 * n * layer.inputs, layer.w.end());
    const std::vector<double> r(layer.r.begin() + 2 * n * n, layer.r.end());
    const std::vector<Element> of_input = on.build.dense(x, w, {layer.bw.begin() + 2 * n, layer.bw.end()}, on.type);
    const std::vector<Element> of_old = on.build.dense(old.h, r, {layer.br.begin() + 2 * n, layer.br.end()}, on.type);
    sums = on.two(BinaryOp::add, of_input, on.two(BinaryOp::multiply, reset, of_old));
  } else {
    sums = on.build.dense(joined(x, on.two(BinaryOp::multiply, reset, old.h)), joint_weights(layer, 2 * n, n),
                          joint_biases(layer, 2 * n, n), on.type);
  }
  const std::vector<Element> fresh = on.map(UnaryOp::hyperbolic_tangent, sums);
  const std::vector<Element> ones(static_cast<std::size_t>(n), Element{-1, 1.0});
  CellState out;
  out.h = on.two(BinaryOp::add, on.two(BinaryOp::multiply, on.two(BinaryOp::subtract, ones, update), fresh),
                 on.two(BinaryOp::multiply, update, old.h));
  return out;
}

/// Runs a layer along its sequences. `step(x, old)` gives what it remembers after one time.
template <class Step>
void run_layer(OperatorCall& call, const Recurrent& layer, bool cell, const Step& step) {
  const Tensor& x = call.operand(0);
  const std::int64_t n = layer.width;
  Tensor all{{layer.times, 1, layer.batch, n}, x.type, {}}, last{{1, layer.batch, n}, x.type, {}}, cells = last;
  // The size of `last` is bounded with it, also where there are no times.
  all.elements.resize(static_cast<std::size_t>(size_of(all.shape)));
  for (std::int64_t b = 0; b < layer.batch; ++b) {
    CellState state{beginning(call, 5, layer, b), cell ? beginning(call, 6, layer, b) : std::vector<Element>{}};
    for (std::int64_t t = 0; t < layer.times; ++t) {
      state = step(part(x.elements, t * layer.batch + b, layer.inputs), state);
      std::copy(state.h.begin(), state.h.end(), all.elements.begin() + (t * layer.batch + b) * n);
    }
    last.elements.insert(last.elements.end(), state.h.begin(), state.h.end());
    cells.elements.insert(cells.elements.end(), state.c.begin(), state.c.end());
  }
  call.results = {std::move(all), std::move(last)};
  if (cell) call.results.push_back(std::move(cells));
}

void lstm(OperatorCall& call) {
  const Recurrent layer = recurrent_operands(call, 4);
  const VectorAlgebra on{call.build, call.operand(0).type};
  run_layer(call, layer, true,
            [&](const std::vector<Element>& x, const CellState& old) { return lstm_step(on, layer, x, old); });
}

void gru(OperatorCall& call) {
  const Recurrent layer = recurrent_operands(call, 3);
  const VectorAlgebra on{call.build, call.operand(0).type};
  const bool reset_after = call.integer("linear_before_reset", 0) != 0;
  run_layer(call, layer, false, [&](const std::vector<Element>& x, const CellState& old) {
    return gru_step(on, layer, reset_after, x, old);
  });
}

}  // namespace

OperatorTable recurrent_operators() { return {{"GRU", &gru}, {"LSTM", &lstm}}; }

}  // namespace graze
