#pragma once
// A table of joint values over time from a CSV file: header `time,JOINT,JOINT,…`, one row per knot, times (s) growing.

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "engine/settings/description.h"

namespace graze {

enum class Interpolation { linear, cubic };

/// The key `interpolation`, which goes with `table`, and its value.
Key interpolation_key();
Interpolation read_interpolation(const Described& settings);

class JointTable {
 public:
  /// Reads the file that `file` names (relative to the settings' own file). Columns must be among `joints`. Throws
  /// InputError "PLACE: path: table.csv:LINE: …", the place and path being those of `file`.
  static JointTable load(const Settings& file, const std::vector<std::string>& joints, Interpolation interpolation);
  /// From text; `name` stands for the file in messages.
  static JointTable parse(const std::string& text, const std::string& name, const std::vector<std::string>& joints,
                          Interpolation interpolation);

  /// Joints (index into the list given) of the columns.
  const std::vector<int>& columns() const { return columns_; }
  double first_time() const { return time_.front(); }
  double last_time() const { return time_.back(); }
  /// Time of the second row, after which the joints can have got somewhere; of a table of one row the only one.
  double second_time() const { return time_[std::min<std::size_t>(1, time_.size() - 1)]; }

  /// Value and rate of a column at t; held at the ends, where the rate is 0. Cubic: Catmull-Rom slopes on the table's
  /// own times (C1, exact for parabolas inside).
  struct Sample {
    double value, rate;
  };
  Sample at(std::size_t column, double t) const;
  /// The least and the greatest value of a column's knots.
  std::pair<double, double> extremes(std::size_t column) const {
    const auto [low, high] = std::minmax_element(values_[column].begin(), values_[column].end());
    return {*low, *high};
  }

 private:
  double slope(std::size_t column, std::size_t knot) const;

  Interpolation interpolation_ = Interpolation::linear;
  std::vector<int> columns_;
  std::vector<double> time_;                 // s
  std::vector<std::vector<double>> values_;  // [column][knot]
};

}  // namespace graze
