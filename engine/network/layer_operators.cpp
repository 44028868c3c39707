// Operators that sum over many numbers: layers and normalisations. Sums run in double precision and are rounded once.

#include <fmt/format.h>

#include <algorithm>

#include "engine/network/operators.h"

namespace graze {

namespace {

/// [n][m] of [m][n].
std::vector<double> transposed(const std::vector<double>& in, std::int64_t m, std::int64_t n) {
  std::vector<double> out(in.size());
  for (std::int64_t i = 0; i < m; ++i) {
    for (std::int64_t j = 0; j < n; ++j) {
      out[static_cast<std::size_t>(j * m + i)] = in[static_cast<std::size_t>(i * n + j)];
    }
  }
  return out;
}

/// Shape of a product: [m][k] times [k][n].
struct ProductShape {
  std::int64_t m, k, n;
};

/// a [m][k] times weight [n][k], plus bias [m][n] if there is any: [m][n], of a size that was checked.
std::vector<Element> product(OperatorCall& call, const std::vector<Element>& a, const ProductShape& shape,
                             const std::vector<double>& weight, const std::vector<double>& bias, ElementType type) {
  const auto [m, k, n] = shape;
  std::vector<Element> out;
  if (k == 0 || n == 0) {  // an empty sum is 0
    out.resize(static_cast<std::size_t>(m * n), Element{-1, 0});
    for (std::size_t i = 0; i < out.size() && !bias.empty(); ++i) out[i].value = bias[i];
    return out;
  }
  for (std::int64_t i = 0; i < m; ++i) {
    const std::vector<Element> x(a.begin() + i * k, a.begin() + (i + 1) * k);
    std::vector<double> offset;
    if (!bias.empty()) offset.assign(bias.begin() + i * n, bias.begin() + (i + 1) * n);
    const std::vector<Element> row = call.build.dense(x, weight, offset, type);
    out.insert(out.end(), row.begin(), row.end());
  }
  return out;
}

[[noreturn]] void refuse_factors(const Tensor& a, const Tensor& b) {
  throw NetworkError(fmt::format("multiplies shapes {} and {}, which do not fit", text_of(a.shape), text_of(b.shape)));
}

void gemm(OperatorCall& call) {
  const Tensor &a = call.operand(0), &b = call.operand(1);
  if (a.shape.size() != 2 || b.shape.size() != 2) refuse_factors(a, b);
  std::vector<double> weight = call.constants(1, "weights");
  const bool by_columns = call.integer("transB", 0) != 0;  // [n][k] in the file
  const std::int64_t n = b.shape[by_columns ? 0 : 1], k = b.shape[by_columns ? 1 : 0];
  if (!by_columns) weight = transposed(weight, k, n);
  const double alpha = call.number("alpha", 1), beta = call.number("beta", 1);
  for (double& number : weight) number *= alpha;
  Tensor left = a;
  if (call.integer("transA", 0) != 0) {
    Tensor turned{{a.shape[1], a.shape[0]}, a.type, {}};
    for (std::int64_t j = 0; j < a.shape[1]; ++j) {
      for (std::int64_t i = 0; i < a.shape[0]; ++i) {
        turned.elements.push_back(a.elements[static_cast<std::size_t>(i * a.shape[1] + j)]);
      }
    }
    left = std::move(turned);
  }
  if (left.shape[1] != k) refuse_factors(a, b);
  const TensorShape shape{left.shape[0], n};
  size_of(shape);
  std::vector<double> bias;
  const bool fixed = call.has(2) && call.operand(2).constant();
  if (fixed) {
    for (const Element& element : broadcast(call.operand(2), shape)) bias.push_back(beta * element.value);
  }
  Tensor out{shape, a.type, product(call, left.elements, {left.shape[0], k, n}, weight, bias, a.type)};
  if (call.has(2) && !fixed) {
    const Tensor scaled = call.build.binary(BinaryOp::multiply, call.operand(2), constant_tensor({}, a.type, {beta}));
    out = call.build.binary(BinaryOp::add, out, scaled);
  }
  call.results = {std::move(out)};
}

/// Constant [m, k] times what is computed, [k] or [k, n].
Tensor constant_times(OperatorCall& call, const Tensor& a, const Tensor& b) {
  const bool vector = b.shape.size() == 1;
  if (a.shape.size() != 2 || b.shape.size() > 2 || b.shape.empty() || b.shape[0] != a.shape[1]) refuse_factors(a, b);
  const std::int64_t k = a.shape[1], n = vector ? 1 : b.shape[1], m = a.shape[0];
  Tensor out{vector ? TensorShape{m} : TensorShape{m, n}, b.type, {}};
  size_of(out.shape);
  std::vector<Element> columns;  // [n][k]
  for (std::int64_t j = 0; j < n; ++j) {
    for (std::int64_t i = 0; i < k; ++i) columns.push_back(b.elements[static_cast<std::size_t>(i * n + j)]);
  }
  const std::vector<Element> by_column = product(call, columns, {n, k, m}, numbers_of(a), {}, b.type);  // [n][m]
  for (std::int64_t i = 0; i < m; ++i) {
    for (std::int64_t j = 0; j < n; ++j) out.elements.push_back(by_column[static_cast<std::size_t>(j * m + i)]);
  }
  return out;
}

void matmul(OperatorCall& call) {
  const Tensor &a = call.operand(0), &b = call.operand(1);
  if (!a.constant() && !b.constant()) {
    throw NetworkError("multiplies two computed matrices; one of them must be constant weights");
  }
  if (!b.constant()) {
    call.results = {constant_times(call, a, b)};
    return;
  }
  TensorShape factor = b.shape;
  while (factor.size() > 2 && factor[0] == 1) factor.erase(factor.begin());
  if (a.shape.empty() || factor.empty() || factor.size() > 2 || factor[0] != a.shape.back()) refuse_factors(a, b);
  const std::int64_t k = factor[0], n = factor.size() == 1 ? 1 : factor[1];
  Tensor out{a.shape, a.type, {}};
  out.shape.pop_back();
  const std::int64_t m = size_of(out.shape);
  if (factor.size() == 2) out.shape.push_back(n);
  size_of(out.shape);
  out.elements = product(call, a.elements, {m, k, n}, transposed(numbers_of(b), k, n), {}, a.type);
  call.results = {std::move(out)};
}

/// 1 / sqrt(x + epsilon).
Tensor inverse_root(OperatorCall& call, const Tensor& x, double epsilon) {
  const Tensor sum = call.build.binary(BinaryOp::add, x, constant_tensor({}, x.type, {epsilon}));
  return call.build.unary(UnaryOp::inverse, call.build.unary(UnaryOp::root, sum));
}

void layer_normalization(OperatorCall& call) {
  const Tensor& x = call.operand(0);
  const std::size_t axis = OperatorCall::axis_of(call.integer("axis", -1), x.shape.size());
  std::int64_t width = 1;
  for (std::size_t d = axis; d < x.shape.size(); ++d) width *= x.shape[d];
  if (width == 0) throw NetworkError("is of no numbers at all");
  const TensorShape groups{x.size() / width, 1};
  Tensor flat{{groups[0], width}, x.type, x.elements};
  const auto mean_of = [&](const Tensor& in) {
    return Tensor{groups, x.type, call.build.reduce(ReduceOp::mean, in.elements, static_cast<int>(width), x.type)};
  };
  const Tensor off = call.build.binary(BinaryOp::subtract, flat, mean_of(flat));
  const Tensor variance = mean_of(call.build.binary(BinaryOp::multiply, off, off));
  Tensor out = call.build.binary(BinaryOp::multiply, off, inverse_root(call, variance, call.number("epsilon", 1e-5f)));
  out.shape = x.shape;
  out = call.build.binary(BinaryOp::multiply, out, call.operand(1));
  if (call.has(2)) out = call.build.binary(BinaryOp::add, out, call.operand(2));
  call.results = {std::move(out)};
}

void batch_normalization(OperatorCall& call) {
  call.only("training_mode", 0);
  call.only("spatial", 1);
  const Tensor& x = call.operand(0);
  if (x.shape.size() < 2) throw NetworkError("normalises a tensor of shape " + text_of(x.shape));
  const auto of_channels = [&](std::size_t i) {
    Tensor out = call.operand(i);
    if (out.shape != TensorShape{x.shape[1]}) {
      throw NetworkError(fmt::format("has shape {} beside {}", text_of(out.shape), text_of(x.shape)));
    }
    out.shape.resize(x.shape.size() - 1, 1);
    return out;
  };
  const Tensor factor = call.build.binary(BinaryOp::multiply, of_channels(1),
                                          inverse_root(call, of_channels(4), call.number("epsilon", 1e-5f)));
  const Tensor off = call.build.binary(BinaryOp::subtract, x, of_channels(3));
  call.results = {call.build.binary(BinaryOp::add, call.build.binary(BinaryOp::multiply, off, factor), of_channels(2))};
}

/// Elements in groups that are reduced to one, a group of `width` behind the other: those that differ along the axes
/// only.
std::vector<Element> by_groups(const Tensor& x, const std::vector<bool>& along, std::size_t width) {
  std::vector<Element> out(x.elements.size());
  std::vector<std::size_t> taken(x.elements.size() / width, 0);
  TensorShape at(x.shape.size(), 0);
  for (const Element& element : x.elements) {
    std::size_t group = 0;
    for (std::size_t d = 0; d < along.size(); ++d) {
      if (!along[d]) group = group * static_cast<std::size_t>(x.shape[d]) + static_cast<std::size_t>(at[d]);
    }
    out[group * width + taken[group]++] = element;
    for (std::size_t d = at.size(); d-- > 0 && ++at[d] == x.shape[d];) at[d] = 0;
  }
  return out;
}

Tensor reduced(OperatorCall& call, ReduceOp op, const Tensor& x, const std::vector<std::int64_t>& axes, bool keep) {
  std::vector<bool> along(x.shape.size(), axes.empty());
  for (const std::int64_t axis : axes) along[OperatorCall::axis_of(axis, along.size())] = true;
  if (x.elements.empty()) throw NetworkError("is of no numbers at all");
  TensorShape shape;
  std::size_t width = 1;
  for (std::size_t d = 0; d < along.size(); ++d) {
    if (!along[d] || keep) shape.push_back(along[d] ? 1 : x.shape[d]);
    if (along[d]) width *= static_cast<std::size_t>(x.shape[d]);
  }
  return {shape, x.type, call.build.reduce(op, by_groups(x, along, width), static_cast<int>(width), x.type)};
}

template <ReduceOp op>
void reduce(OperatorCall& call) {
  call.only("noop_with_empty_axes", 0);
  call.results = {reduced(call, op, call.operand(0), call.list("axes", 1), call.integer("keepdims", 1) != 0)};
}

void softmax(OperatorCall& call) {
  const Tensor& x = call.operand(0);
  const std::int64_t axis = call.integer("axis", call.version < 13 ? 1 : -1);
  if (OperatorCall::axis_of(axis, x.shape.size()) + 1 != x.shape.size()) {
    throw NetworkError(fmt::format("has axis {}; only the last is known", axis));
  }
  const Tensor off = call.build.binary(BinaryOp::subtract, x, reduced(call, ReduceOp::greatest, x, {-1}, true));
  const Tensor grown = call.build.unary(UnaryOp::exponential, off);
  call.results = {call.build.binary(BinaryOp::divide, grown, reduced(call, ReduceOp::sum, grown, {-1}, true))};
}

}  // namespace

OperatorTable layer_operators() {
  return {{"BatchNormalization", &batch_normalization}, {"Gemm", &gemm},
          {"LayerNormalization", &layer_normalization}, {"MatMul", &matmul},
          {"ReduceMax", &reduce<ReduceOp::greatest>},   {"ReduceMean", &reduce<ReduceOp::mean>},
          {"ReduceSum", &reduce<ReduceOp::sum>},        {"Softmax", &softmax}};
}

}  // namespace graze
