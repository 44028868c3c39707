#include "engine/network/builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace graze {

namespace {

/// Rows that a network computes in: 16 MiB for each thread. Policies of legged robots have some 1000.
constexpr std::int64_t kMostRows = 1 << 18;
/// Operations of all steps, per robot and call: products of dense layers, with those that fill up their tiles (80 MB of
/// weights), and operands of the rest. Policies of legged robots have 100,000.
constexpr double kMostOperations = 1e7;
/// Numbers that all nodes together go through while the file is read, which takes some seconds: four operators on each
/// of the most weights that a file may have, with their operands and results.
constexpr std::int64_t kMostHandled = 16 * kMostNumbers;
/// What making a step or folding one counts for beside its numbers: it takes about as long as so many of them.
constexpr std::int64_t kHandledByStep = 100;

std::vector<Element> rows_from(int first, std::int64_t count) {
  std::vector<Element> out(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < out.size(); ++i) out[i].row = first + static_cast<int>(i);
  return out;
}

bool all_constant(const std::vector<Element>& elements) {
  return std::all_of(elements.begin(), elements.end(), [](const Element& one) { return one.constant(); });
}

/// As a step's results are kept.
double rounded(double value, ElementType type) {
  if (type == ElementType::real) return value;
  return type == ElementType::integer ? std::trunc(value) : static_cast<double>(static_cast<float>(value));
}

/// What the kernel makes of groups of constants: the same operations in the same order.
std::vector<Element> fold_reduce(ReduceOp op, const std::vector<Element>& in, std::size_t width, ElementType type) {
  std::vector<Element> out;
  for (std::size_t first = 0; first + width <= in.size(); first += width) {
    double value = in[first].value;
    for (std::size_t k = first + 1; k < first + width; ++k) {
      const double x = in[k].value;
      if (op != ReduceOp::greatest) value += x;
      if (op == ReduceOp::greatest && (x > value || x != x)) value = x;
    }
    if (op == ReduceOp::mean) value /= static_cast<double>(width);
    out.push_back({-1, rounded(value, type)});
  }
  return out;
}

std::vector<Element> fold_dense(const std::vector<Element>& x, const std::vector<double>& weight,
                                const std::vector<double>& bias, ElementType type) {
  std::vector<Element> out;
  for (std::size_t j = 0; j < weight.size() / x.size(); ++j) {
    double sum = bias.empty() ? 0 : bias[j];
    for (std::size_t k = 0; k < x.size(); ++k) sum = std::fma(weight[j * x.size() + k], x[k].value, sum);
    out.push_back({-1, rounded(sum, type)});
  }
  return out;
}

}  // namespace

void ProgramBuilder::handle(std::int64_t numbers) {
  handled_ += numbers;
  if (handled_ > kMostHandled) {
    throw NetworkError(fmt::format("goes through {} numbers on top of the {} of the nodes before; at most {} together",
                                   numbers, handled_ - numbers, kMostHandled));
  }
}

/// Before anything is kept for a step.
void ProgramBuilder::spend(std::size_t operations) {
  const auto more = static_cast<double>(operations);
  program_.operations += more;
  if (program_.operations > kMostOperations) {
    throw NetworkError(
        fmt::format("takes {:.0f} operations in each call on top of {:.0f} before it; at most {:.0f} "
                    "together",
                    more, program_.operations - more, kMostOperations));
  }
}

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
  const std::size_t at_once = std::min(kAtOnce, a.size());
  BlockArray memory(static_cast<int>(3 * at_once));
  std::vector<int> rows(2 * at_once);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<int>(i);
  step.a = rows.data();
  step.b = rows.data() + at_once;
  step.out = static_cast<int>(2 * at_once);
  step.single = type == ElementType::single;
  std::vector<Element> out;
  for (std::size_t first = 0; first < a.size(); first += at_once) {
    const std::size_t count = std::min(at_once, a.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
      memory(rows[i], 0) = a[first + i].value;
      if (!b.empty()) memory(rows[at_once + i], 0) = b[first + i].value;
    }
    step.count = static_cast<int>(count);
    kernel_.run(&step, 1, memory.row(0));
    for (std::size_t i = 0; i < count; ++i) {
      out.push_back({-1, rounded(memory(step.out + static_cast<int>(i), 0), type)});
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
  handle(in.size() + kHandledByStep);
  if (in.constant()) return {in.shape, in.type, fold(step, in.elements, {}, in.type)};
  spend(in.elements.size());
  step.a = keep(in.elements);
  return {in.shape, in.type, add(step, in.type)};
}

Tensor ProgramBuilder::binary(BinaryOp op, const Tensor& a, const Tensor& b) {
  const TensorShape shape = common_shape(a.shape, b.shape);
  handle(span_of(shape) + kHandledByStep);
  const std::vector<Element> first = broadcast(a, shape), second = broadcast(b, shape);
  NetworkStep step;
  step.kind = StepKind::binary;
  step.op = static_cast<int>(op);
  step.count = static_cast<int>(first.size());
  if (all_constant(first) && all_constant(second)) return {shape, a.type, fold(step, first, second, a.type)};
  spend(first.size());
  step.a = keep(first);
  step.b = keep(second);
  return {shape, a.type, add(step, a.type)};
}

std::vector<Element> ProgramBuilder::reduce(ReduceOp op, const std::vector<Element>& in, int width, ElementType type) {
  if (width == 0 || in.empty()) throw NetworkError("is of no numbers at all");
  handle(static_cast<std::int64_t>(in.size()) + kHandledByStep);
  if (all_constant(in)) return fold_reduce(op, in, static_cast<std::size_t>(width), type);
  spend(in.size());
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
  handle(static_cast<std::int64_t>(weight.size()) + kHandledByStep);
  if (all_constant(x)) return fold_dense(x, weight, bias, type);
  spend(tiles * inputs * kTile);
  program_.multiplications += static_cast<double>(weight.size());
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
