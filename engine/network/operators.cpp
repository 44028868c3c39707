#include "engine/network/operators.h"

#include <fmt/format.h>

#include <algorithm>

namespace graze {

const Tensor& OperatorCall::operand(std::size_t i) const {
  if (!has(i)) throw NetworkError(fmt::format("lacks its operand {}", i + 1));
  return *operands_[i];
}

std::vector<double> OperatorCall::constants(std::size_t i, const char* what) const {
  const Tensor& tensor = operand(i);
  if (!tensor.constant()) {
    throw NetworkError(fmt::format("computes its {}; they must be constants of the file", what));
  }
  return numbers_of(tensor);
}

std::vector<std::int64_t> OperatorCall::integers(std::size_t i, const char* what) const {
  std::vector<std::int64_t> out;
  for (const double number : constants(i, what)) {
    if (number != number) throw NetworkError(fmt::format("has {} among its {}", number, what));
    // Slices say "to the end" by the largest and smallest whole numbers, which are no doubles.
    out.push_back(static_cast<std::int64_t>(std::clamp(number, -0x1p53, 0x1p53)));
  }
  return out;
}

const OnnxAttribute* OperatorCall::find(const std::string& name) const {
  const auto found = node.attributes.find(name);
  return found == node.attributes.end() ? nullptr : &found->second;
}

double OperatorCall::number(const std::string& name, double otherwise) const {
  const OnnxAttribute* const found = find(name);
  return found ? found->number : otherwise;
}

std::int64_t OperatorCall::integer(const std::string& name, std::int64_t otherwise) const {
  const OnnxAttribute* const found = find(name);
  return found ? found->integer : otherwise;
}

std::vector<std::int64_t> OperatorCall::list(const std::string& name, std::size_t i) const {
  if (const OnnxAttribute* const found = find(name)) return found->integers;
  return has(i) ? integers(i, name.c_str()) : std::vector<std::int64_t>{};
}

void OperatorCall::only(const std::string& name, std::int64_t value) const {
  const std::int64_t written = integer(name, value);
  if (written != value) throw NetworkError(fmt::format("has {} = {}; only {} is known", name, written, value));
}

std::size_t OperatorCall::axis_of(std::int64_t axis, std::size_t rank) {
  const auto length = static_cast<std::int64_t>(rank);
  if (axis < -length || axis >= length) throw NetworkError(fmt::format("has axis {} of {} dimensions", axis, rank));
  return static_cast<std::size_t>(axis < 0 ? axis + length : axis);
}

const OperatorTable& network_operators() {
  static const OperatorTable all = [] {
    OperatorTable out = elementwise_operators();
    out.merge(shape_operators());
    out.merge(layer_operators());
    out.merge(recurrent_operators());
    return out;
  }();
  return all;
}

Tensor pick(const Tensor& in, std::size_t axis, const std::vector<std::int64_t>& picks) {
  const std::int64_t length = in.shape[axis];
  std::int64_t before = 1, after = 1;
  for (std::size_t d = 0; d < axis; ++d) before *= in.shape[d];
  for (std::size_t d = axis + 1; d < in.shape.size(); ++d) after *= in.shape[d];
  Tensor out{in.shape, in.type, {}};
  out.shape[axis] = static_cast<std::int64_t>(picks.size());
  for (const std::int64_t at : picks) {
    if (at < 0 || at >= length) throw NetworkError(fmt::format("takes number {} of {}", at, length));
  }
  if (size_of(out.shape) == 0) return out;
  for (std::int64_t i = 0; i < before; ++i) {
    for (const std::int64_t at : picks) {
      const auto first = in.elements.begin() + (i * length + at) * after;
      out.elements.insert(out.elements.end(), first, first + after);
    }
  }
  return out;
}

Tensor constant_tensor(TensorShape shape, ElementType type, const std::vector<double>& numbers) {
  Tensor out{std::move(shape), type, {}};
  for (const double number : numbers) out.elements.push_back({-1, number});
  return out;
}

std::vector<double> numbers_of(const Tensor& tensor) {
  std::vector<double> out;
  for (const Element& element : tensor.elements) out.push_back(element.value);
  return out;
}

}  // namespace graze
