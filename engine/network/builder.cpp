#include "engine/network/builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace graze {

namespace {

/// Rows that a network computes in: 16 MiB for each thread. Policies of legged robots have some 1000.
constexpr std::int64_t kMostRows = 1 << 18;
/// Products of all dense layers, per robot and call: 80 MB of weights. Policies of legged robots have 100,000.
constexpr double kMostMultiplications = 1e7;

std::vector<Element> rows_from(int first, std::int64_t count) {
  std::vector<Element> out(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < out.size(); ++i) out[i].row = first + static_cast<int>(i);
  return out;
}

bool all_constant(const std::vector<Element>& elements) {
  return std::all_of(elements.begin(), elements.end(), [](const Element& one) { return one.constant(); });
}

}  // namespace

int ProgramBuilder::add_rows(std::int64_t rows) {
  if (rows > kMostRows - program_.rows) {
    throw NetworkError(fmt::format("computes more than {} numbers", kMostRows));
  }
  const int first = program_.rows;
  program_.rows += static_cast<int>(rows);
  return first;
}

int ProgramBuilder::row(const Element& element) {
  if (!element.constant()) return element.row;
  const auto [found, fresh] = constant_rows_.try_emplace(std::bit_cast<std::uint64_t>(element.value), 0);
  if (fresh) {
    found->second = add_rows(1);
    program_.constants.emplace_back(found->second, element.value);
  }
  return found->second;
}

Tensor ProgramBuilder::input(const TensorShape& shape, ElementType type) {
  const std::int64_t size = size_of(shape);
  return {shape, type, rows_from(add_rows(size), size)};
}

const int* ProgramBuilder::keep(const std::vector<Element>& elements) {
  std::vector<int>& rows = program_.indices.emplace_back();
  for (const Element& element : elements) rows.push_back(row(element));
  return rows.data();
}

const double* ProgramBuilder::keep(std::vector<double> numbers) {
  return program_.numbers.emplace_back(std::move(numbers)).data();
}

/// The step's rows, whose operands are kept already.
std::vector<Element> ProgramBuilder::add(NetworkStep step, ElementType type) {
  step.single = type == ElementType::single;
  step.out = add_rows(step.count);
  program_.steps.push_back(step);
  return rows_from(step.out, step.count);
}

/// What a unary or binary step makes of constants, by the kernel itself, some at a time.
std::vector<Element> ProgramBuilder::fold(NetworkStep step, const std::vector<Element>& a,
                                          const std::vector<Element>& b, ElementType type) const {
  constexpr std::size_t kAtOnce = 1024;
  BlockArray memory(3 * kAtOnce);
  std::vector<int> rows(2 * kAtOnce);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<int>(i);
  step.a = rows.data();
  step.b = rows.data() + kAtOnce;
  step.out = 2 * kAtOnce;
  step.single = type == ElementType::single;
  std::vector<Element> out;
  for (std::size_t first = 0; first < a.size(); first += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, a.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
      memory(rows[i], 0) = a[first + i].value;
      if (!b.empty()) memory(rows[kAtOnce + i], 0) = b[first + i].value;
    }
    step.count = static_cast<int>(count);
    kernel_.run(&step, 1, memory.row(0));
    for (std::size_t i = 0; i < count; ++i) {
      const double value = memory(step.out + static_cast<int>(i), 0);
      out.push_back({-1, type == ElementType::integer ? std::trunc(value) : value});
    }
  }
  return out;
}

Tensor ProgramBuilder::unary(UnaryOp op, const Tensor& in, double alpha, double beta) {
  NetworkStep step;
  step.kind = StepKind::unary;
  step.op = static_cast<int>(op);
  step.alpha = alpha;
  step.beta = beta;
  step.count = static_cast<int>(in.size());
  if (in.constant()) return {in.shape, in.type, fold(step, in.elements, {}, in.type)};
  step.a = keep(in.elements);
  return {in.shape, in.type, add(step, in.type)};
}

Tensor ProgramBuilder::binary(BinaryOp op, const Tensor& a, const Tensor& b) {
  const TensorShape shape = common_shape(a.shape, b.shape);
  const std::vector<Element> first = broadcast(a, shape), second = broadcast(b, shape);
  NetworkStep step;
  step.kind = StepKind::binary;
  step.op = static_cast<int>(op);
  step.count = static_cast<int>(first.size());
  if (all_constant(first) && all_constant(second)) return {shape, a.type, fold(step, first, second, a.type)};
  step.a = keep(first);
  step.b = keep(second);
  return {shape, a.type, add(step, a.type)};
}

std::vector<Element> ProgramBuilder::reduce(ReduceOp op, const std::vector<Element>& in, int width, ElementType type) {
  if (width == 0 || in.empty()) throw NetworkError("is of no numbers at all");
  NetworkStep step;
  step.kind = StepKind::reduce;
  step.op = static_cast<int>(op);
  step.width = width;
  step.count = static_cast<int>(in.size()) / width;
  step.a = keep(in);
  return add(step, type);
}

std::vector<Element> ProgramBuilder::dense(const std::vector<Element>& x, const std::vector<double>& weight,
                                           const std::vector<double>& bias, ElementType type) {
  if (x.empty() || weight.empty()) throw NetworkError("is of no numbers at all");
  const std::size_t inputs = x.size(), count = weight.size() / inputs;
  const std::size_t tiles = (count + kTile - 1) / kTile;
  program_.multiplications += static_cast<double>(weight.size());
  if (program_.multiplications > kMostMultiplications) {
    throw NetworkError(fmt::format("has layers of more than {:g} products", kMostMultiplications));
  }
  std::vector<double> tiled(tiles * inputs * kTile), offsets(tiles * kTile);
  for (std::size_t j = 0; j < count; ++j) {
    double* const column = tiled.data() + j / kTile * inputs * kTile + j % kTile;
    for (std::size_t k = 0; k < inputs; ++k) column[k * kTile] = weight[j * inputs + k];
    if (!bias.empty()) offsets[j] = bias[j];
  }
  NetworkStep step;
  step.kind = StepKind::dense;
  step.width = static_cast<int>(inputs);
  step.count = static_cast<int>(count);
  step.a = keep(x);
  step.weight = keep(std::move(tiled));
  step.bias = keep(std::move(offsets));
  return add(step, type);
}

}  // namespace graze
