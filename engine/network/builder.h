#pragma once
// Makes the steps that a network computes in (kernel.h) out of tensors. What only moves numbers about (slices,
// concatenations, transposition) makes none: a tensor is a list of rows. What is known already is computed at once.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/lanes/block.h"
#include "engine/network/kernel.h"
#include "engine/network/tensor.h"
#include "engine/network/wire.h"

namespace graze {

/// The steps of a network and the arrays that they point into. Immutable once built; many memories may run it.
struct NetworkProgram {
  std::vector<NetworkStep> steps;
  std::vector<std::vector<int>> indices;
  std::vector<std::vector<double>> numbers;       // weights and biases
  std::vector<std::pair<int, double>> constants;  // rows that are the same in all lanes
  int rows = 0;
  double multiplications = 0;  // of one robot, in dense layers
  double operations = 0;       // of one robot, in all steps

  NetworkProgram() = default;
  NetworkProgram(NetworkProgram&&) = default;
  NetworkProgram& operator=(NetworkProgram&&) = default;
  NetworkProgram(const NetworkProgram&) = delete;
  NetworkProgram& operator=(const NetworkProgram&) = delete;
};

/// All throw NetworkError.
class ProgramBuilder {
 public:
  explicit ProgramBuilder(const NetworkKernel& kernel) : kernel_(kernel) {}

  /// Rows that somebody else fills.
  Tensor input(const TensorShape& shape, ElementType type);

  Tensor unary(UnaryOp op, const Tensor& in, double alpha = 0, double beta = 0);
  /// The type is that of `a`; shapes are broadcast.
  Tensor binary(BinaryOp op, const Tensor& a, const Tensor& b);
  /// One result for each `width` elements of `in`, which it has in groups; their shape is the caller's to set.
  std::vector<Element> reduce(ReduceOp op, const std::vector<Element>& in, int width, ElementType type);
  /// weight [count][x.size()], constant; bias [count] or empty.
  std::vector<Element> dense(const std::vector<Element>& x, const std::vector<double>& weight,
                             const std::vector<double>& bias, ElementType type);

  /// Counts numbers that are gone through while the file is read, which bounds the time that it takes.
  void handle(std::int64_t numbers);

  /// A row of the memory with this element.
  int row(const Element& element);
  /// `rows` new ones, one behind the other; the first.
  int add_rows(std::int64_t rows);

  NetworkProgram finish() { return std::move(program_); }

 private:
  void spend(std::size_t operations);
  const int* keep(const std::vector<Element>& elements);
  const double* keep(std::vector<double> numbers);
  std::vector<Element> add(NetworkStep step, ElementType type);
  std::vector<Element> fold(NetworkStep step, const std::vector<Element>& a, const std::vector<Element>& b,
                            ElementType type) const;

  const NetworkKernel& kernel_;
  NetworkProgram program_;
  std::int64_t handled_ = 0;
  std::map<std::uint64_t, int> constant_rows_;  // by the number's bits
};

}  // namespace graze
