#pragma once
// What an ONNX file says (onnx.proto3): a graph of operators with its constant numbers. Nothing is judged here but
// whether it can be read; what operators mean stands in operators.h.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "engine/network/tensor.h"

namespace graze {

struct OnnxAttribute {
  double number = 0;
  std::int64_t integer = 0;
  std::string text;
  std::vector<double> numbers;
  std::vector<std::int64_t> integers;
  std::vector<std::string> texts;
  std::vector<Tensor> tensors;  // one, or none
};

struct OnnxNode {
  std::string name, type, domain;
  std::vector<std::string> inputs, outputs;  // "": left out
  std::map<std::string, OnnxAttribute> attributes;
};

/// An input or output of the graph.
struct OnnxPort {
  std::string name;
  int element_type = 0;  // TensorProto.DataType
  TensorShape shape;     // a dimension that the file leaves open is 1: one robot
};

struct OnnxFile {
  std::string producer;
  std::int64_t version = 0;  // of the operator set ai.onnx
  std::vector<OnnxNode> nodes;
  std::map<std::string, Tensor> constants;
  std::vector<OnnxPort> inputs;  // without those that are constants
  std::vector<OnnxPort> outputs;
};

/// Throws NetworkError for what is no ONNX file, too large, or kept in other files.
OnnxFile read_onnx(std::string_view bytes);

/// Of a TensorProto.DataType; throws NetworkError for those that networks here cannot have. `what` has it.
ElementType element_type(int data_type, const std::string& what);

}  // namespace graze
