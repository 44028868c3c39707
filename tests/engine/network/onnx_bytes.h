#pragma once
// Writes ONNX files for tests and benchmarks, field by field as onnx.proto3 has them.

#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace graze::testing {

/// A message of protocol buffers.
class Message {
 public:
  Message& number(int field, std::uint64_t value) {
    varint(static_cast<std::uint64_t>(field) << 3);
    varint(value);
    return *this;
  }
  Message& text(int field, const std::string& bytes) {
    varint(static_cast<std::uint64_t>(field) << 3 | 2u);
    varint(bytes.size());
    bytes_ += bytes;
    return *this;
  }
  Message& real(int field, float value) {
    varint(static_cast<std::uint64_t>(field) << 3 | 5u);
    raw(value);
    return *this;
  }
  template <class T>
  Message& raw(T value) {
    char buffer[sizeof value];
    std::memcpy(buffer, &value, sizeof value);
    bytes_.append(buffer, sizeof value);
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  void varint(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes_ += static_cast<char>((value & 0x7fu) | 0x80u);
    bytes_ += static_cast<char>(value);
  }
  std::string bytes_;
};

using Dims = std::vector<std::int64_t>;
using Names = std::vector<std::string>;
enum class Numbers { float32 = 1, int64 = 7, float64 = 11 };

inline std::string tensor(const std::string& name, const Dims& dims, const std::vector<double>& values, Numbers type) {
  Message out, data;
  for (const std::int64_t d : dims) out.number(1, static_cast<std::uint64_t>(d));
  out.number(2, static_cast<std::uint64_t>(type)).text(8, name);
  for (const double value : values) {
    if (type == Numbers::float32) data.raw(static_cast<float>(value));
    if (type == Numbers::float64) data.raw(value);
    if (type == Numbers::int64) data.raw(static_cast<std::int64_t>(value));
  }
  return out.text(9, data.bytes()).bytes();
}

// Attributes of a node.
inline std::string whole(const std::string& name, std::int64_t value) {
  return Message().text(1, name).number(3, static_cast<std::uint64_t>(value)).number(20, 2).bytes();
}
inline std::string real(const std::string& name, float value) {
  return Message().text(1, name).real(2, value).number(20, 1).bytes();
}
inline std::string wholes(const std::string& name, const Dims& values) {
  Message out;
  out.text(1, name);
  for (const std::int64_t value : values) out.number(8, static_cast<std::uint64_t>(value));
  return out.number(20, 7).bytes();
}
inline std::string word(const std::string& name, const std::string& value) {
  return Message().text(1, name).text(4, value).number(20, 3).bytes();
}

/// A file in the making.
class OnnxWriter {
 public:
  explicit OnnxWriter(Numbers type = Numbers::float64, int operator_set = 17) : type_(type), set_(operator_set) {}

  OnnxWriter& input(const std::string& name, const Dims& dims) { return port(11, name, dims); }
  OnnxWriter& output(const std::string& name, const Dims& dims = {}) { return port(12, name, dims); }
  OnnxWriter& constant(const std::string& name, const Dims& dims, const std::vector<double>& values) {
    graph_.text(5, tensor(name, dims, values, type_));
    return *this;
  }
  OnnxWriter& wholes(const std::string& name, const std::vector<double>& values) {
    graph_.text(5, tensor(name, {static_cast<std::int64_t>(values.size())}, values, Numbers::int64));
    return *this;
  }
  OnnxWriter& node(const std::string& type, const Names& inputs, const Names& outputs, const Names& attributes = {},
                   const std::string& domain = "") {
    Message out;
    for (const std::string& name : inputs) out.text(1, name);
    for (const std::string& name : outputs) out.text(2, name);
    out.text(3, "/" + outputs[0]).text(4, type);
    for (const std::string& attribute : attributes) out.text(5, attribute);
    if (!domain.empty()) out.text(7, domain);
    graph_.text(1, out.bytes());
    return *this;
  }
  /// Any field of the graph.
  OnnxWriter& field(int number, const std::string& bytes) {
    graph_.text(number, bytes);
    return *this;
  }

  std::string bytes() const {
    const std::string set = Message().text(1, "").number(2, static_cast<std::uint64_t>(set_)).bytes();
    return Message().number(1, 8).text(2, "tests").text(8, set).text(7, graph_.bytes()).bytes();
  }

 private:
  /// A dimension of 0 is left open ("batch").
  OnnxWriter& port(int field, const std::string& name, const Dims& dims) {
    Message shape;
    for (const std::int64_t d : dims) {
      shape.text(
          1, d > 0 ? Message().number(1, static_cast<std::uint64_t>(d)).bytes() : Message().text(2, "batch").bytes());
    }
    const std::string type = Message().number(1, static_cast<std::uint64_t>(type_)).text(2, shape.bytes()).bytes();
    graph_.text(field, Message().text(1, name).text(2, Message().text(1, type).bytes()).bytes());
    return *this;
  }

  Numbers type_;
  int set_;
  Message graph_;
};

/// Layers of these widths with an activation between them; weights by a rule that spreads them within ±1 / sqrt(width).
inline std::string perceptron(const std::vector<int>& widths, const std::string& activation, Numbers type) {
  OnnxWriter out(type);
  out.input("obs", {0, widths.front()}).output("actions", {0, widths.back()});
  std::uint32_t seed = 1;
  const auto next = [&](double size) {
    seed = seed * 1664525u + 1013904223u;
    return size * (static_cast<double>(seed >> 8) * 0x1p-23 - 1);
  };
  std::string from = "obs";
  for (std::size_t i = 0; i + 1 < widths.size(); ++i) {
    const std::string n = std::to_string(i), to = i + 2 == widths.size() ? "actions" : "h" + n;
    const int inputs = widths[i], outputs = widths[i + 1];
    double size = 1;
    while (size * size * inputs > 3) size *= 0.9;
    std::vector<double> weights(static_cast<std::size_t>(inputs * outputs)), biases(static_cast<std::size_t>(outputs));
    for (double& weight : weights) weight = next(size);
    for (double& bias : biases) bias = next(0.1);
    out.constant("w" + n, {outputs, inputs}, weights).constant("b" + n, {outputs}, biases);
    const bool last = i + 2 == widths.size();
    out.node("Gemm", {from, "w" + n, "b" + n}, {last ? to : "s" + n}, {whole("transB", 1)});
    if (!last) out.node(activation, {"s" + n}, {to});
    from = to;
  }
  return out.bytes();
}

}  // namespace graze::testing
