#include "archive/schema/window.h"

#include <fmt/format.h>

#include <algorithm>

namespace graze {
namespace {

constexpr std::uint64_t kWindow = std::uint64_t{1} << 14;  // particle ids

}  // namespace

WindowWalk::WindowWalk(Parts& parts, std::string group, std::string policy, const std::vector<std::string>& flat)
    : parts_(parts), group_(std::move(group)), policy_(std::move(policy)), flat_rows_(flat.size()) {
  std::vector<bool> seen;
  for (std::size_t part = 0; part < parts_.size(); ++part) count(static_cast<std::uint32_t>(part), seen, flat);
}

void WindowWalk::count(std::uint32_t part, std::vector<bool>& seen, const std::vector<std::string>& flat) {
  const OpenPart& file = parts_.open(part);
  if (!file.has(group_)) return;
  const std::uint64_t table = file.column(group_, schema::particle()).rows();
  const auto ids = file.read<std::uint32_t>(group_, schema::particle(), table);
  if (!std::is_sorted(ids.begin(), ids.end())) file.fail(fmt::format("'{}' is not in order of particle id", group_));
  const auto place = [&](std::uint64_t id) {
    return static_cast<std::uint64_t>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin());
  };
  const std::uint64_t first = place(parts_.counting().begin), rows = place(parts_.counting().end);
  if (first == rows) return;
  cursors_.push_back({part, rows, first, ids[first]});
  std::vector<bool> fresh(rows);
  for (std::uint64_t i = first; i < rows; ++i) {
    const std::size_t id = ids[i];
    if (id >= seen.size()) seen.resize(std::max(id + 1, 2 * seen.size()));
    fresh[i] = !seen[id];
    seen[id] = true;
    rows_ += fresh[i];
  }
  for (std::size_t k = 0; k < flat.size(); ++k) {
    const std::vector<std::uint64_t> offset = file.offsets(flat[k], table);
    if (offset.empty()) continue;
    for (std::uint64_t i = first; i < rows; ++i) flat_rows_[k] += fresh[i] ? offset[i + 1] - offset[i] : 0;
  }
}

/// The rows of one part up to particle `end`.
WindowSlice WindowWalk::take(Cursor& cursor, std::uint64_t end, std::uint32_t slice, std::vector<Row>& rows) {
  const OpenPart& file = parts_.open(cursor.part);
  const std::uint64_t table = file.column(group_, schema::particle()).rows();
  WindowSlice out{cursor.part, cursor.row, {}};
  while (cursor.row < cursor.rows && cursor.next_id < end) {
    const std::uint64_t count = std::min(kWindow, cursor.rows - cursor.row);
    const auto ids = file.slice<std::uint32_t>(group_, schema::particle(), table, cursor.row, count);
    const auto digests = policy_.empty()
                             ? std::vector<std::uint64_t>(count)
                             : file.slice<std::uint64_t>(group_, schema::digest(), table, cursor.row, count);
    std::uint64_t i = 0;
    for (; i < count && ids[i] < end; ++i) {
      rows.push_back({ids[i], slice, static_cast<std::uint32_t>(out.place.size()), digests[i]});
      out.place.push_back(WindowSlice::kNowhere);
    }
    cursor.row += i;
    if (i < count) cursor.next_id = ids[i];
  }
  return out;
}

std::optional<RowWindow> WindowWalk::next() {
  std::erase_if(cursors_, [](const Cursor& cursor) { return cursor.row == cursor.rows; });
  if (cursors_.empty()) return std::nullopt;
  const auto by_id = [](const Cursor& a, const Cursor& b) { return a.next_id < b.next_id; };
  const std::uint64_t end = std::min_element(cursors_.begin(), cursors_.end(), by_id)->next_id + kWindow;
  RowWindow window;
  std::vector<Row> rows;
  for (Cursor& cursor : cursors_) {
    if (cursor.next_id >= end) continue;
    window.slices.push_back(take(cursor, end, static_cast<std::uint32_t>(window.slices.size()), rows));
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.particle < b.particle; });
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    WindowSlice& slice = window.slices[row.slice];
    if (i == 0 || rows[i - 1].particle != row.particle) {
      slice.place[row.row] = static_cast<std::uint32_t>(window.rows++);
    } else if (rows[i - 1].digest != row.digest) {
      fail_two_ways(parts_.open(slice.part), row.particle, policy_,
                    parts_.path(window.slices[rows[i - 1].slice].part).string());
    }
  }
  return window;
}

}  // namespace graze
