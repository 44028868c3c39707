// Operators that move numbers about: they make other lists of the same rows, and no steps.

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <numeric>
#include <utility>

#include "engine/network/operators.h"

namespace graze {

namespace {

void constant(OperatorCall& call) {
  if (const OnnxAttribute* const value = call.find("value"); value && !value->tensors.empty()) {
    call.results = {value->tensors[0]};
  } else if (const OnnxAttribute* const number = call.find("value_float")) {
    call.results = {constant_tensor({}, ElementType::single, {number->number})};
  } else if (const OnnxAttribute* const integer = call.find("value_int")) {
    call.results = {constant_tensor({}, ElementType::integer, {static_cast<double>(integer->integer)})};
  } else if (const OnnxAttribute* const numbers = call.find("value_floats")) {
    const auto size = static_cast<std::int64_t>(numbers->numbers.size());
    call.results = {constant_tensor({size}, ElementType::single, numbers->numbers)};
  } else if (const OnnxAttribute* const integers = call.find("value_ints")) {
    const std::vector<double> values(integers->integers.begin(), integers->integers.end());
    call.results = {constant_tensor({static_cast<std::int64_t>(values.size())}, ElementType::integer, values)};
  } else {
    throw NetworkError("has a constant that is neither numbers nor whole numbers");
  }
}

void reshaped(OperatorCall& call, TensorShape shape) {
  Tensor out = call.operand(0);
  if (size_of(shape) != out.size()) {
    throw NetworkError(fmt::format("cannot make shape {} of {}", text_of(shape), text_of(out.shape)));
  }
  out.shape = std::move(shape);
  call.results = {std::move(out)};
}

void reshape(OperatorCall& call) {
  call.only("allowzero", 0);
  const Tensor& in = call.operand(0);
  TensorShape shape = call.list("shape", 1);
  std::int64_t known = 1;
  for (std::size_t d = 0; d < shape.size(); ++d) {
    if (shape[d] == 0 && d < in.shape.size()) shape[d] = in.shape[d];  // as it was
    if (shape[d] > 0) known = size_of({known, shape[d]});
  }
  const auto open = std::find(shape.begin(), shape.end(), -1);  // the rest
  if (open != shape.end()) *open = known > 0 ? in.size() / known : 0;
  reshaped(call, shape);
}

void flatten(OperatorCall& call) {
  const TensorShape& shape = call.operand(0).shape;
  const std::int64_t axis = call.integer("axis", 1), rank = static_cast<std::int64_t>(shape.size());
  if (axis < -rank || axis > rank) throw NetworkError(fmt::format("has axis {} of {} dimensions", axis, rank));
  const std::int64_t split = axis < 0 ? axis + rank : axis;
  const std::int64_t before =
      std::accumulate(shape.begin(), shape.begin() + split, std::int64_t{1}, std::multiplies<>());
  const std::int64_t after = std::accumulate(shape.begin() + split, shape.end(), std::int64_t{1}, std::multiplies<>());
  reshaped(call, {before, after});
}

void squeeze(OperatorCall& call) {
  const TensorShape& shape = call.operand(0).shape;
  const std::vector<std::int64_t> axes = call.list("axes", 1);
  std::vector<bool> drop(shape.size(), axes.empty());
  for (const std::int64_t axis : axes) drop[OperatorCall::axis_of(axis, shape.size())] = true;
  TensorShape out;
  for (std::size_t d = 0; d < shape.size(); ++d) {
    if (drop[d] && !axes.empty() && shape[d] != 1) {
      throw NetworkError(fmt::format("drops dimension {} of shape {}, which is not 1", d, text_of(shape)));
    }
    if (!drop[d] || shape[d] != 1) out.push_back(shape[d]);
  }
  reshaped(call, out);
}

void unsqueeze(OperatorCall& call) {
  const TensorShape& shape = call.operand(0).shape;
  const std::vector<std::int64_t> axes = call.list("axes", 1);
  std::vector<bool> fresh(shape.size() + axes.size(), false);
  for (const std::int64_t axis : axes) fresh[OperatorCall::axis_of(axis, fresh.size())] = true;
  TensorShape out;
  std::size_t next = 0;
  for (const bool one : fresh) {
    if (!one && next == shape.size()) throw NetworkError("has an axis twice");
    out.push_back(one ? 1 : shape[next++]);
  }
  reshaped(call, out);
}

void concat(OperatorCall& call) {
  const Tensor& first = call.operand(0);
  const std::size_t rank = first.shape.size(), axis = OperatorCall::axis_of(call.integer("axis", 0), rank);
  Tensor out{first.shape, first.type, {}};
  out.shape[axis] = 0;
  std::int64_t before = 1;
  for (std::size_t d = 0; d < axis; ++d) before *= first.shape[d];
  for (std::size_t i = 0; i < call.node.inputs.size(); ++i) {
    TensorShape shape = call.operand(i).shape;
    if (shape.size() == rank) out.shape[axis] += std::exchange(shape[axis], first.shape[axis]);
    if (shape != first.shape) {
      throw NetworkError(fmt::format("joins shapes {} and {}", text_of(first.shape), text_of(call.operand(i).shape)));
    }
  }
  size_of(out.shape);
  for (std::int64_t j = 0; j < before; ++j) {
    for (std::size_t i = 0; i < call.node.inputs.size(); ++i) {
      const std::vector<Element>& from = call.operand(i).elements;
      const std::int64_t part = static_cast<std::int64_t>(from.size()) / std::max<std::int64_t>(before, 1);
      out.elements.insert(out.elements.end(), from.begin() + j * part, from.begin() + (j + 1) * part);
    }
  }
  call.results = {std::move(out)};
}

/// The places that a slice takes of `length`, as Python counts.
std::vector<std::int64_t> slice_places(std::int64_t begin, std::int64_t end, std::int64_t step, std::int64_t length) {
  if (step == 0) throw NetworkError("has a step of 0");
  const auto inside = [&](std::int64_t at) {
    const std::int64_t counted = at < 0 ? at + length : at;
    return step > 0 ? std::clamp<std::int64_t>(counted, 0, length) : std::clamp<std::int64_t>(counted, -1, length - 1);
  };
  step = std::clamp<std::int64_t>(step, -kMostNumbers, kMostNumbers);  // so that sums stay whole numbers
  std::vector<std::int64_t> out;
  const std::int64_t last = inside(end);
  for (std::int64_t at = inside(begin); step > 0 ? at < last : at > last; at += step) out.push_back(at);
  return out;
}

void slice(OperatorCall& call) {
  Tensor out = call.operand(0);
  const std::vector<std::int64_t> begins = call.list("starts", 1), ends = call.list("ends", 2);
  std::vector<std::int64_t> axes = call.list("axes", 3), steps = call.list("steps", 4);
  if (axes.empty()) {
    axes.resize(begins.size());
    std::iota(axes.begin(), axes.end(), 0);
  }
  if (steps.empty()) steps.assign(begins.size(), 1);
  if (ends.size() != begins.size() || axes.size() != begins.size() || steps.size() != begins.size()) {
    throw NetworkError("has lists of different lengths");
  }
  std::vector<bool> cut(out.shape.size(), false);
  for (std::size_t i = 0; i < begins.size(); ++i) {
    const std::size_t axis = OperatorCall::axis_of(axes[i], out.shape.size());
    if (cut[axis]) throw NetworkError(fmt::format("has axis {} twice", axes[i]));
    cut[axis] = true;
    out = pick(out, axis, slice_places(begins[i], ends[i], steps[i], out.shape[axis]));
  }
  call.results = {std::move(out)};
}

void split(OperatorCall& call) {
  const Tensor& in = call.operand(0);
  const std::size_t axis = OperatorCall::axis_of(call.integer("axis", 0), in.shape.size());
  const auto parts = static_cast<std::int64_t>(call.node.outputs.size());
  std::vector<std::int64_t> lengths = call.list("split", 1);
  if (lengths.empty()) {
    const std::int64_t each = (in.shape[axis] + parts - 1) / parts;  // the last may be shorter
    lengths.assign(static_cast<std::size_t>(parts), each);
    lengths.back() = in.shape[axis] - each * (parts - 1);
  }
  if (static_cast<std::int64_t>(lengths.size()) != parts) {
    throw NetworkError(fmt::format("has {} lengths and {} outputs", lengths.size(), parts));
  }
  const auto outside = [&](std::int64_t length) { return length < 0 || length > in.shape[axis]; };
  if (std::any_of(lengths.begin(), lengths.end(), outside) ||
      std::accumulate(lengths.begin(), lengths.end(), std::int64_t{0}) != in.shape[axis]) {
    throw NetworkError(fmt::format("splits {} numbers into {}", in.shape[axis], text_of(lengths)));
  }
  std::int64_t begin = 0;
  for (const std::int64_t length : lengths) {
    std::vector<std::int64_t> places(static_cast<std::size_t>(length));
    std::iota(places.begin(), places.end(), begin);
    call.results.push_back(pick(in, axis, places));
    begin += length;
  }
}

void gather(OperatorCall& call) {
  const Tensor& in = call.operand(0);
  const std::size_t axis = OperatorCall::axis_of(call.integer("axis", 0), in.shape.size());
  std::vector<std::int64_t> places = call.integers(1, "indices");
  for (std::int64_t& place : places) place += place < 0 ? in.shape[axis] : 0;
  Tensor out = pick(in, axis, places);
  const TensorShape& inner = call.operand(1).shape;
  out.shape.erase(out.shape.begin() + static_cast<std::ptrdiff_t>(axis));
  out.shape.insert(out.shape.begin() + static_cast<std::ptrdiff_t>(axis), inner.begin(), inner.end());
  call.results = {std::move(out)};
}

void transpose(OperatorCall& call) {
  const Tensor& in = call.operand(0);
  const std::size_t rank = in.shape.size();
  std::vector<std::int64_t> order = call.list("perm", 1);
  if (order.empty()) {
    for (std::size_t d = rank; d-- > 0;) order.push_back(static_cast<std::int64_t>(d));
  }
  std::vector<std::int64_t> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t d = 0; d < std::max(rank, sorted.size()); ++d) {
    if (sorted.size() != rank || sorted[d] != static_cast<std::int64_t>(d)) throw NetworkError("has no permutation");
  }
  std::vector<std::int64_t> stride(rank, 1);
  for (std::size_t d = rank; d-- > 1;) stride[d - 1] = stride[d] * in.shape[d];
  Tensor out{{}, in.type, {}};
  for (const std::int64_t d : order) out.shape.push_back(in.shape[static_cast<std::size_t>(d)]);
  TensorShape at(rank, 0);
  for (std::int64_t i = 0; i < in.size(); ++i) {
    std::int64_t from = 0;
    for (std::size_t d = 0; d < rank; ++d) from += at[d] * stride[static_cast<std::size_t>(order[d])];
    out.elements.push_back(in.elements[static_cast<std::size_t>(from)]);
    for (std::size_t d = rank; d-- > 0 && ++at[d] == out.shape[d];) at[d] = 0;
  }
  call.results = {std::move(out)};
}

void shape_of(OperatorCall& call) {
  call.only("start", 0);
  if (call.find("end")) throw NetworkError("has an end of its own; only whole shapes are known");
  const TensorShape& shape = call.operand(0).shape;
  const std::vector<double> lengths(shape.begin(), shape.end());
  call.results = {constant_tensor({static_cast<std::int64_t>(shape.size())}, ElementType::integer, lengths)};
}

void constant_of_shape(OperatorCall& call) {
  const TensorShape shape = call.integers(0, "shape");
  Tensor one = constant_tensor({}, ElementType::single, {0});
  if (const OnnxAttribute* const value = call.find("value"); value && !value->tensors.empty()) one = value->tensors[0];
  if (one.size() != 1) throw NetworkError("has no single value");
  const auto size = static_cast<std::size_t>(size_of(shape));
  call.results = {{shape, one.type, std::vector<Element>(size, one.elements[0])}};
}

void expand(OperatorCall& call) {
  const Tensor& in = call.operand(0);
  const TensorShape shape = common_shape(in.shape, call.integers(1, "shape"));
  call.results = {{shape, in.type, broadcast(in, shape)}};
}

}  // namespace

OperatorTable shape_operators() {
  return {{"Concat", &concat},      {"Constant", &constant}, {"ConstantOfShape", &constant_of_shape},
          {"Expand", &expand},      {"Flatten", &flatten},   {"Gather", &gather},
          {"Reshape", &reshape},    {"Shape", &shape_of},    {"Slice", &slice},
          {"Split", &split},        {"Squeeze", &squeeze},   {"Transpose", &transpose},
          {"Unsqueeze", &unsqueeze}};
}

}  // namespace graze
