#include "engine/network/tensor.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "engine/network/wire.h"

namespace graze {

std::int64_t span_of(const TensorShape& shape) {
  if (shape.size() > kMostRank) {
    throw NetworkError(fmt::format("has a tensor of {} dimensions; at most {}", shape.size(), kMostRank));
  }
  std::int64_t out = 1;
  for (const std::int64_t length : shape) {
    if (length < 0) throw NetworkError(fmt::format("has a tensor of shape {}", text_of(shape)));
    if (length > 0 && out > kMostNumbers / length) {
      const bool hidden = std::count(shape.begin(), shape.end(), 0) > 0;
      throw NetworkError(fmt::format("has a tensor of shape {}; at most {} numbers{}", text_of(shape), kMostNumbers,
                                     hidden ? ", also without its dimension of 0" : ""));
    }
    out *= std::max<std::int64_t>(length, 1);
  }
  return out;
}

std::int64_t size_of(const TensorShape& shape) {
  const std::int64_t span = span_of(shape);
  return std::count(shape.begin(), shape.end(), 0) > 0 ? 0 : span;
}

std::string text_of(const TensorShape& shape) {
  if (shape.size() <= kMostRank) return fmt::format("[{}]", fmt::join(shape, ", "));
  const auto end = shape.begin() + static_cast<std::ptrdiff_t>(kMostRank);
  return fmt::format("[{}, …] of {}", fmt::join(shape.begin(), end, ", "), shape.size());
}

bool Tensor::constant() const {
  return std::all_of(elements.begin(), elements.end(), [](const Element& one) { return one.constant(); });
}

TensorShape common_shape(const TensorShape& a, const TensorShape& b) {
  TensorShape out(std::max(a.size(), b.size()), 1);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::size_t back = out.size() - i;  // dimensions are matched from the last
    const std::int64_t m = back <= a.size() ? a[a.size() - back] : 1, n = back <= b.size() ? b[b.size() - back] : 1;
    if (m != n && m != 1 && n != 1) {
      throw NetworkError(fmt::format("shapes {} and {} do not fit each other", text_of(a), text_of(b)));
    }
    out[i] = m == 1 ? n : m;
  }
  return out;
}

std::vector<Element> broadcast(const Tensor& in, const TensorShape& shape) {
  if (common_shape(in.shape, shape) != shape) {
    throw NetworkError(fmt::format("shape {} cannot be spread to {}", text_of(in.shape), text_of(shape)));
  }
  const std::size_t size = static_cast<std::size_t>(size_of(shape)), lead = shape.size() - in.shape.size();
  std::vector<Element> out(size);
  TensorShape at(shape.size(), 0);
  for (std::size_t i = 0; i < size; ++i) {
    std::size_t from = 0;
    for (std::size_t d = 0; d < in.shape.size(); ++d) {
      const auto length = static_cast<std::size_t>(in.shape[d]);
      from = from * length + (length == 1 ? 0 : static_cast<std::size_t>(at[lead + d]));
    }
    out[i] = in.elements[from];
    for (std::size_t d = shape.size(); d-- > 0 && ++at[d] == shape[d];) at[d] = 0;
  }
  return out;
}

}  // namespace graze
