#pragma once
// The operators of ONNX that networks here may have. Each gets a node with its operands and makes steps of it. To add
// one, add a line to the table of one of the files …_operators.cpp.

#include <map>
#include <string>
#include <vector>

#include "engine/network/builder.h"
#include "engine/network/onnx_file.h"

namespace graze {

/// A node with its operands. All throw NetworkError.
class OperatorCall {
 public:
  OperatorCall(ProgramBuilder& to, const OnnxNode& what, std::int64_t operator_set, std::vector<const Tensor*> operands)
      : build(to), node(what), version(operator_set), operands_(std::move(operands)) {}

  ProgramBuilder& build;
  const OnnxNode& node;
  const std::int64_t version;

  bool has(std::size_t i) const { return i < operands_.size() && operands_[i] != nullptr; }
  const Tensor& operand(std::size_t i) const;
  /// Numbers of an operand that must be known from the file. `what` it is, for the message.
  std::vector<double> constants(std::size_t i, const char* what) const;
  std::vector<std::int64_t> integers(std::size_t i, const char* what) const;

  const OnnxAttribute* find(const std::string& name) const;
  double number(const std::string& name, double otherwise) const;
  std::int64_t integer(const std::string& name, std::int64_t otherwise) const;
  /// `axes` and the like, which are attributes in older files and operand i in newer ones; empty if there are none.
  std::vector<std::int64_t> list(const std::string& name, std::size_t i) const;
  /// Refuses an attribute that is written and has another value.
  void only(const std::string& name, std::int64_t value) const;

  /// A dimension, counted from the end if it is negative, of `rank` ones.
  static std::size_t axis_of(std::int64_t axis, std::size_t rank);

  std::vector<Tensor> results;

 private:
  std::vector<const Tensor*> operands_;
};

using OperatorFunction = void (*)(OperatorCall& call);
using OperatorTable = std::map<std::string, OperatorFunction>;

OperatorTable elementwise_operators();
OperatorTable shape_operators();
OperatorTable layer_operators();
OperatorTable recurrent_operators();

/// All of them, by the names of ONNX.
const OperatorTable& network_operators();

/// Elements at a position along one axis: out has `shape` with shape[axis] = picks.size().
Tensor pick(const Tensor& in, std::size_t axis, const std::vector<std::int64_t>& picks);

/// A tensor of constants, and the numbers of one.
Tensor constant_tensor(TensorShape shape, ElementType type, const std::vector<double>& numbers);
std::vector<double> numbers_of(const Tensor& tensor);

}  // namespace graze
