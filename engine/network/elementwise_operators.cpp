// Operators on one or two numbers at a time.

#include <fmt/format.h>

#include <limits>

#include "engine/network/operators.h"

namespace graze {

namespace {

template <UnaryOp op>
void one(OperatorCall& call) {
  call.results = {call.build.unary(op, call.operand(0))};
}

template <BinaryOp op>
void two(OperatorCall& call) {
  call.results = {call.build.binary(op, call.operand(0), call.operand(1))};
}

/// Of as many operands as there are, from the first on.
template <BinaryOp op>
void several(OperatorCall& call) {
  Tensor out = call.operand(0);
  for (std::size_t i = 1; i < call.node.inputs.size(); ++i) out = call.build.binary(op, out, call.operand(i));
  call.results = {std::move(out)};
}

void same(OperatorCall& call) { call.results = {call.operand(0)}; }

void leaky_relu(OperatorCall& call) {
  call.results = {call.build.unary(UnaryOp::leaky_relu, call.operand(0), call.number("alpha", 0.01f))};
}

void elu(OperatorCall& call) {
  call.results = {call.build.unary(UnaryOp::elu, call.operand(0), call.number("alpha", 1))};
}

void selu(OperatorCall& call) {  // defaults of the ONNX standard
  call.results = {call.build.unary(UnaryOp::selu, call.operand(0), call.number("alpha", 1.67326319217681884765625),
                                   call.number("gamma", 1.05070102214813232421875))};
}

void hard_sigmoid(OperatorCall& call) {
  call.results = {
      call.build.unary(UnaryOp::hard_sigmoid, call.operand(0), call.number("alpha", 0.2f), call.number("beta", 0.5))};
}

/// A bound of Clip: an attribute before version 11, and an operand since.
double bound(const OperatorCall& call, const char* name, std::size_t i, double otherwise) {
  if (!call.has(i)) return call.number(name, otherwise);
  const std::vector<double> written = call.constants(i, "bounds");
  if (written.size() != 1) throw NetworkError(fmt::format("has {} bounds where one must stand", written.size()));
  return written[0];
}

void clip(OperatorCall& call) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  call.results = {call.build.unary(UnaryOp::clip, call.operand(0), bound(call, "min", 1, -kInfinite),
                                   bound(call, "max", 2, kInfinite))};
}

void power(OperatorCall& call) {
  const Tensor& x = call.operand(0);
  const std::vector<double> exponent = call.constants(1, "exponents");
  if (exponent.size() == 1 && exponent[0] == 0.5) {
    call.results = {call.build.unary(UnaryOp::root, x)};
  } else if (exponent.size() == 1 && (exponent[0] == 2 || exponent[0] == 3)) {
    Tensor out = call.build.binary(BinaryOp::multiply, x, x);
    if (exponent[0] == 3) out = call.build.binary(BinaryOp::multiply, out, x);
    call.results = {std::move(out)};
  } else {
    throw NetworkError("has another exponent than 0.5, 2 or 3");
  }
}

void cast(OperatorCall& call) {
  const Tensor& in = call.operand(0);
  const ElementType type = element_type(static_cast<int>(call.integer("to", 0)), "its result");
  if (type == ElementType::integer && !in.constant()) {
    throw NetworkError("makes whole numbers of what is computed; only constants may become whole");
  }
  Tensor out = in;
  out.type = type;
  if (in.type != type && type != ElementType::real) out = call.build.unary(UnaryOp::copy, out);
  call.results = {std::move(out)};
}

}  // namespace

OperatorTable elementwise_operators() {
  return {{"Abs", &one<UnaryOp::magnitude>},
          {"Add", &two<BinaryOp::add>},
          {"Cast", &cast},
          {"Clip", &clip},
          {"Cos", &one<UnaryOp::cosine>},
          {"Div", &two<BinaryOp::divide>},
          {"Dropout", &same},
          {"Elu", &elu},
          {"Exp", &one<UnaryOp::exponential>},
          {"HardSigmoid", &hard_sigmoid},
          {"Identity", &same},
          {"LeakyRelu", &leaky_relu},
          {"Max", &several<BinaryOp::greatest>},
          {"Min", &several<BinaryOp::least>},
          {"Mul", &two<BinaryOp::multiply>},
          {"Neg", &one<UnaryOp::negative>},
          {"PRelu", &two<BinaryOp::prelu>},
          {"Pow", &power},
          {"Reciprocal", &one<UnaryOp::inverse>},
          {"Relu", &one<UnaryOp::relu>},
          {"Selu", &selu},
          {"Sigmoid", &one<UnaryOp::sigmoid>},
          {"Sin", &one<UnaryOp::sine>},
          {"Softplus", &one<UnaryOp::softplus>},
          {"Softsign", &one<UnaryOp::softsign>},
          {"Sqrt", &one<UnaryOp::root>},
          {"Sub", &two<BinaryOp::subtract>},
          {"Sum", &several<BinaryOp::add>},
          {"Tanh", &one<UnaryOp::hyperbolic_tangent>}};
}

}  // namespace graze
