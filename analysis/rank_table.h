#pragma once
// The ranks of all parameters among some rows: what every target that counts these rows is compared with.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "analysis/causes.h"

namespace graze {

/// Rows by column in rising order of their values, sorted once: ranks among any rows follow in linear time. Empty: the
/// column has values that are no numbers.
std::vector<std::vector<std::uint32_t>> orders_of(const ParticleTable& table);

/// Correlation of ranks given all other parameters: solved once for some rows, then quickly for each target.
class PartialRanks {
 public:
  PartialRanks();
  ~PartialRanks();
  PartialRanks(PartialRanks&&) noexcept;
  /// `ranks`: of each predictor, [row], of which none is constant. Up to 20,000 rows are used, chosen evenly.
  void prepare(const std::vector<const std::vector<float>*>& ranks);
  /// Why it cannot be told; empty: it can.
  const std::string& doubt() const { return doubt_; }
  struct Result {
    double correlation, p_value;
  };
  /// By predictor. `ranks`: of the target.
  std::vector<Result> of(const std::vector<double>& ranks) const;
  /// The largest correlation of two predictors, and which they are.
  double largest() const { return largest_; }
  std::size_t first() const { return first_; }
  std::size_t second() const { return second_; }

 private:
  struct Solved;
  std::unique_ptr<Solved> solved_;
  std::string doubt_;
  double largest_ = 0;
  std::size_t first_ = 0, second_ = 0;
};

/// Ranks among the rows that count.
struct RankTable {
  std::vector<std::uint32_t> rows;        // that count, rising
  std::vector<std::size_t> columns;       // of the table, that vary and are numbers throughout
  std::vector<std::vector<float>> ranks;  // by these columns: [i] of rows[i], centred
  std::vector<double> ties;               // tie_sum(), by these columns
  std::vector<std::string> notes;         // what was dropped, and why
  PartialRanks partial;                   // of those that are no choices, in this order
};

/// `counts`: by row of the table.
RankTable rank_table(const ParticleTable& table, const std::vector<std::vector<std::uint32_t>>& orders,
                     const std::vector<bool>& counts);

}  // namespace graze
