#pragma once
// A network from an ONNX file, evaluated for eight robots at once: weights are shared, numbers are [row][lane]. In: the
// bytes of the file. Out: rows to fill, a call, rows to read.

#include <string>
#include <string_view>
#include <vector>

#include "engine/network/builder.h"
#include "engine/network/tensor.h"

namespace graze {

/// An input or output: where its numbers stand in the memory.
struct NetworkPort {
  std::string name;
  TensorShape shape;
  bool single = false;  // numbers are floats
  std::vector<int> rows;
};

class Network {
 public:
  /// Throws NetworkError that says what is wrong with the file: damaged, an operator that is not known, shapes that do
  /// not fit.
  Network(std::string_view bytes, const NetworkKernel& kernel);

  const std::vector<NetworkPort>& inputs() const { return inputs_; }
  const std::vector<NetworkPort>& outputs() const { return outputs_; }
  /// Products in dense layers per robot and call, which the time goes with.
  double multiplications() const { return program_.multiplications; }
  const std::string& producer() const { return producer_; }

  /// Memory to run in: one for each thread.
  BlockArray memory() const;
  /// From the rows of the inputs to those of the outputs, all lanes; lanes do not see each other.
  void run(BlockArray& memory) const {
    kernel_->run(program_.steps.data(), static_cast<int>(program_.steps.size()), memory.row(0));
  }

 private:
  const NetworkKernel* kernel_;
  NetworkProgram program_;
  std::vector<NetworkPort> inputs_, outputs_;
  std::string producer_;
};

}  // namespace graze
