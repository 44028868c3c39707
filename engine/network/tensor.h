#pragma once
// Values of a network: numbers that are known when it is read, or rows of the memory that it computes in.

#include <cstdint>
#include <string>
#include <vector>

namespace graze {

using TensorShape = std::vector<std::int64_t>;

/// Numbers of one tensor, and of all constants of a file: policies of legged robots have some 100,000.
inline constexpr std::int64_t kMostNumbers = 4 << 20;

/// Dimensions of one tensor.
inline constexpr std::size_t kMostRank = 8;

/// Numbers in a tensor of this shape. Throws NetworkError if they, its dimensions or its span are too many, or a
/// dimension is negative.
std::int64_t size_of(const TensorShape& shape);
/// The product of the dimensions with those of 0 as 1, which bounds every loop over some of them: an empty tensor may
/// hide a large dimension behind a 0.
std::int64_t span_of(const TensorShape& shape);
/// "[1, 48]"; of one that is far too long its beginning.
std::string text_of(const TensorShape& shape);

/// `single`: every result is rounded to a float.
enum class ElementType { single, real, integer };

/// One number: a constant, or a row [lane] of the network's memory.
struct Element {
  int row = -1;  // -1: the constant `value`
  double value = 0;
  bool constant() const { return row < 0; }
};

struct Tensor {
  TensorShape shape;
  ElementType type = ElementType::single;
  std::vector<Element> elements;  // size_of(shape) of them, which Graph checks; the last dimension runs fastest

  std::int64_t size() const { return static_cast<std::int64_t>(elements.size()); }
  bool constant() const;
};

/// The elements of `in` in the order of `shape`, to which it is broadcast as NumPy does. Throws NetworkError if they do
/// not fit.
std::vector<Element> broadcast(const Tensor& in, const TensorShape& shape);
/// The shape that two are broadcast to.
TensorShape common_shape(const TensorShape& a, const TensorShape& b);

}  // namespace graze
