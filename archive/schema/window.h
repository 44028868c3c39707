#pragma once
// Rows of all parts of a campaign in order of particle id, window after window, so that no more than a window is ever
// held: what `pack` merges shards with.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "archive/schema/part.h"

namespace graze {

/// Rows first, first + 1, … of one part, and where they go.
struct WindowSlice {
  static constexpr std::uint32_t kNowhere = 0xffffffff;  // stands in a part before, too
  std::uint32_t part = 0;
  std::uint64_t first = 0;
  std::vector<std::uint32_t> place;  // in the window, rising
};

/// Rows of neighbouring particles, each particle once.
struct RowWindow {
  std::size_t rows = 0;
  std::vector<WindowSlice> slices;
};

/// Walks the rows of one group (/particles or /traces/<policy>). Needs the library's lock. Throws InputError.
class WindowWalk {
 public:
  /// Reads the ids of all parts once. `flat`: groups of flat rows of the same traces (/events/<policy>), to be counted.
  WindowWalk(Parts& parts, std::string group, std::string policy, const std::vector<std::string>& flat);

  std::uint64_t rows() const { return rows_; }                                    // each particle once
  std::uint64_t flat_rows(std::size_t group) const { return flat_rows_[group]; }  // of these rows
  /// The next window, by rising particle id; none at the end.
  std::optional<RowWindow> next();

 private:
  struct Cursor {
    std::uint32_t part;
    std::uint64_t rows, row;    // of its table; the next to be given
    std::uint32_t next_id = 0;  // of that row
  };
  struct Row {
    std::uint32_t particle, slice, row;
    std::uint64_t digest;
  };
  void count(std::uint32_t part, std::vector<bool>& seen, const std::vector<std::string>& flat);
  WindowSlice take(Cursor& cursor, std::uint64_t end, std::uint32_t slice, std::vector<Row>& rows);

  Parts& parts_;
  const std::string group_, policy_;  // no policy: rows have no digest
  std::vector<Cursor> cursors_;       // of parts that have rows left
  std::uint64_t rows_ = 0;
  std::vector<std::uint64_t> flat_rows_;
};

}  // namespace graze
