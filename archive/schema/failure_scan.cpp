#include "archive/schema/failure_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>

#include "archive/schema/part_rows.h"

namespace graze {
namespace {

constexpr std::uint64_t kPiece = std::uint64_t{1} << 16;  // rows

/// Goes through the tables of one policy, a piece at a time.
class FailureScan {
 public:
  FailureScan(const std::string& policy, const CampaignInfo& info, const std::function<bool(std::uint32_t)>& wanted)
      : policy_(policy), group_(schema::traces_group(policy)), info_(info), widths_(widths_of(info)), wanted_(wanted) {}

  void scan(const OpenPart& file) {
    const std::uint64_t rows = file.traces(policy_);
    reasons_.clear();
    for (std::uint64_t first = 0; first < rows; first += kPiece) {
      scan(file, rows, first, std::min(kPiece, rows - first));
    }
  }

  /// A particle that stands in two parts counts once.
  FailureTable take() {
    const auto before = [](const Failure& a, const Failure& b) { return a.particle < b.particle; };
    const auto same = [](const Failure& a, const Failure& b) { return a.particle == b.particle; };
    std::stable_sort(out_.rows.begin(), out_.rows.end(), before);
    out_.rows.erase(std::unique(out_.rows.begin(), out_.rows.end(), same), out_.rows.end());
    return std::move(out_);
  }

 private:
  using Failure = FailureTable::Row;

  void scan(const OpenPart& file, std::uint64_t rows, std::uint64_t first, std::uint64_t count) {
    const auto slice = [&]<class T>(const hdf5::Spec& spec, T) {
      return file.slice<T>(group_, spec, rows, first, count);
    };
    const auto particle = slice(schema::particle(), std::uint32_t{});
    const auto outcome = slice(schema::outcome(), std::uint8_t{});
    const auto counts = [&](std::size_t i) {
      return static_cast<Outcome>(outcome[i]) != Outcome::success && particle[i] < info_.particles &&
             (!wanted_ || wanted_(particle[i]));
    };
    rows_.clear();
    for (std::size_t i = 0; i < count; ++i) {
      if (counts(i)) rows_.push_back(i);
    }
    if (rows_.empty()) return;
    const auto violated = slice(schema::violated(), std::int32_t{});
    const auto end_time = slice(schema::end_time(), double{});
    const auto objective = slice(schema::objective_margin(), double{});
    const auto margins = slice(schema::margins(widths_), double{});
    const auto times = slice(schema::first_violations(widths_), double{});
    const auto reason = slice(schema::invalid_reason(), std::uint32_t{});
    const std::vector<Culprit> culprits = read_culprits(file, policy_, {rows, first, count}, violated, info_);
    for (const std::size_t i : rows_) {
      const auto result = static_cast<Outcome>(outcome[i]);
      if (!possible_outcome(result, violated[i], info_.requirements.size())) {
        file.fail(fmt::format("policy '{}', particle {}: outcome {} with violated requirement {} is not possible",
                              policy_, particle[i], outcome[i], violated[i]));
      }
      Failure& row = out_.rows.emplace_back();
      row.particle = particle[i];
      row.outcome = result;
      row.violated = violated[i];
      const bool known = result == Outcome::known_failure;
      const std::size_t cell = known ? i * info_.requirements.size() + static_cast<std::size_t>(violated[i]) : 0;
      row.time = known ? times[cell] : end_time[i];
      row.margin = known ? margins[cell] : objective[i];
      if (result != Outcome::invalid) row.culprit = culprits[i];
      if (result == Outcome::invalid) row.reason = reason_number(file, reason[i]);
    }
  }

  std::uint32_t reason_number(const OpenPart& file, std::uint32_t index) {
    if (reasons_.empty()) reasons_ = file.texts(schema::kReasons);
    if (index >= reasons_.size()) file.fail(fmt::format("'{}/invalid_reason': index out of range", group_));
    const auto [at, fresh] = numbers_.emplace(reasons_[index], static_cast<std::uint32_t>(out_.reasons.size()));
    if (fresh) out_.reasons.push_back(reasons_[index]);
    return at->second;
  }

  const std::string policy_, group_;
  const CampaignInfo& info_;
  const Widths widths_;
  const std::function<bool(std::uint32_t)>& wanted_;
  std::vector<std::size_t> rows_;                 // of the piece, that count
  std::vector<std::string> reasons_;              // of the part
  std::map<std::string, std::uint32_t> numbers_;  // of out_.reasons
  FailureTable out_;
};

}  // namespace

FailureTable scan_failures(Parts& parts, const std::string& policy, const CampaignInfo& info,
                           const std::function<bool(std::uint32_t)>& wanted) {
  FailureScan scan(policy, info, wanted);
  for (std::size_t part = 0; part < parts.size(); ++part) scan.scan(parts.open(part));
  return scan.take();
}

}  // namespace graze
