#pragma once
// The block: W particles that are simulated side by side, one per lane. Every array between the parts of the engine is
// laid out [quantity][lane], so that a lane engine reads one quantity of all particles with one load and a back end
// without lanes (Bullet) loops over them.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace graze {

/// Particles per block (W).
inline constexpr int kLanes = 8;

/// Which lanes take part: bit l is lane l.
class LaneMask {
 public:
  constexpr LaneMask() = default;
  constexpr explicit LaneMask(std::uint32_t bits) : bits_(bits) {}
  static constexpr LaneMask first(int n) { return LaneMask((1u << n) - 1u); }
  static constexpr LaneMask all() { return first(kLanes); }

  constexpr bool operator[](int lane) const { return (bits_ >> lane) & 1u; }
  constexpr void set(int lane, bool on = true) { bits_ = on ? bits_ | (1u << lane) : bits_ & ~(1u << lane); }
  constexpr bool any() const { return bits_ != 0; }
  constexpr std::uint32_t bits() const { return bits_; }

 private:
  std::uint32_t bits_ = 0;
};

/// A [rows][kLanes] array of doubles, zero at first, each row on its own cache line.
class BlockArray {
 public:
  BlockArray() = default;
  explicit BlockArray(int rows) : rows_(static_cast<std::size_t>(rows)) {}

  int rows() const { return static_cast<int>(rows_.size()); }
  double& operator()(int row, int lane) { return rows_[row].value[lane]; }
  double operator()(int row, int lane) const { return rows_[row].value[lane]; }
  /// The lanes of row i; of an array without rows null, which stands for rows that nobody reads.
  double* row(int i) { return rows_.empty() ? nullptr : rows_[i].value; }
  const double* row(int i) const { return rows_.empty() ? nullptr : rows_[i].value; }
  void set_zero() { rows_.assign(rows_.size(), Row{}); }

  /// Column `lane`, rows [first, first + count), as a vector.
  Eigen::VectorXd column(int lane, int first, int count) const {
    Eigen::VectorXd out(count);
    for (int i = 0; i < count; ++i) out[i] = rows_[first + i].value[lane];
    return out;
  }
  Eigen::VectorXd column(int lane) const { return column(lane, 0, rows()); }
  Eigen::Vector3d vec3(int first, int lane) const {
    return {rows_[first].value[lane], rows_[first + 1].value[lane], rows_[first + 2].value[lane]};
  }
  void set_column(int lane, const Eigen::Ref<const Eigen::VectorXd>& values, int first = 0) {
    for (int i = 0; i < values.size(); ++i) rows_[first + i].value[lane] = values[i];
  }

 private:
  struct alignas(64) Row {
    double value[kLanes] = {};
  };
  std::vector<Row> rows_;
};

}  // namespace graze
