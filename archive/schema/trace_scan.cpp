#include "archive/schema/trace_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "archive/schema/part_rows.h"

namespace graze {
namespace {

constexpr std::uint64_t kRowsAtOnce = std::uint64_t{1} << 16;  // rows
constexpr std::uint64_t kFlatPiece = std::uint64_t{1} << 18;   // events or phases, unless one trace has more

/// Particles that have been met. Ids that do not count are none of it.
class Once {
 public:
  bool first(std::uint32_t id) {
    if (id >= seen_.size()) seen_.resize(std::max<std::size_t>(std::size_t{id} + 1, 2 * seen_.size()));
    if (seen_[id]) return false;
    return seen_[id] = true;
  }

 private:
  std::vector<bool> seen_;
};

bool same_bits(std::span<const double> a, std::span<const double> b) {
  const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](double x, double y) { return bits(x) == bits(y); });
}

/// Particles that stand in two parts must have gone the same way in both.
void check_again(Parts& parts, const std::string& policy, const CampaignInfo& info,
                 const std::vector<std::uint32_t>& twice) {
  /// A trace as the first part has it; margins that nobody knows are NaN, so that bytes are compared.
  struct First {
    std::uint64_t digest = 0;
    std::uint8_t outcome = 0;
    std::int32_t violated = 0;
    std::vector<double> margins = {};
    std::ptrdiff_t part = -1;  // none yet
  };
  std::map<std::uint32_t, First> firsts;
  for (const std::uint32_t particle : twice) firsts[particle];
  const std::string group = schema::traces_group(policy);
  const hdf5::Spec margins = schema::margins(widths_of(info));
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const OpenPart& file = parts.open(part);
    const std::uint64_t rows = file.traces(policy);
    for (std::uint64_t first = 0; first < rows; first += kRowsAtOnce) {
      const std::uint64_t count = std::min(kRowsAtOnce, rows - first);
      const auto particle = file.slice<std::uint32_t>(group, schema::particle(), rows, first, count);
      const auto digest = file.slice<std::uint64_t>(group, schema::digest(), rows, first, count);
      const auto outcome = file.slice<std::uint8_t>(group, schema::outcome(), rows, first, count);
      const auto violated = file.slice<std::int32_t>(group, schema::violated(), rows, first, count);
      const auto all_margins = file.slice<double>(group, margins, rows, first, count);
      for (std::size_t i = 0; i < count; ++i) {
        const auto at = firsts.find(particle[i]);
        if (at == firsts.end()) continue;
        const std::span<const double> own = std::span(all_margins).subspan(i * margins.width, margins.width);
        First& one = at->second;
        if (one.part < 0) {
          one = {digest[i], outcome[i], violated[i], {own.begin(), own.end()}, static_cast<std::ptrdiff_t>(part)};
        } else if (one.digest != digest[i] || one.outcome != outcome[i] || one.violated != violated[i] ||
                   !same_bits(one.margins, own)) {
          fail_two_ways(file, particle[i], policy, parts.open(static_cast<std::size_t>(one.part)).path().string());
        }
      }
    }
  }
}

}  // namespace

SolverLog TraceRows::solver(std::size_t i) const {
  const std::span<const double> log = row(solver_, i);
  SolverLog out = {log[0], log[1], log[2], log[3]};
  if (!convergence_.empty()) {
    const std::span<const double> more = row(convergence_, i);
    out.steps = more[0], out.median_residual = more[1], out.braked_steps = more[2], out.most_braked = more[3];
    return out;
  }
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const double steps = out.tells() && !end_time_.empty() ? std::round(end_time(i) / step_) : 0;
  out.steps = steps > 0 ? steps : 0;
  out.median_residual = out.braked_steps = out.most_braked = kUnknown;
  return out;
}

class TraceScan {
 public:
  TraceScan(const std::string& policy, const CampaignInfo& info, const Parts& parts, unsigned columns,
            const TraceFilter& wanted)
      : policy_(policy),
        group_(schema::traces_group(policy)),
        events_{kEvents, schema::events_group(policy), {}},
        phases_{kContactPhases, schema::phases_group(policy), {}},
        info_(info),
        parts_(parts),
        widths_(widths_of(info)),
        columns_(columns),
        wanted_(wanted) {
    rows_.step_ = info.step;
  }

  void scan(const OpenPart& file, const std::function<void(const TraceRows&)>& take) {
    const std::uint64_t rows = file.traces(policy_);
    if (rows == 0) return;
    open(file, rows);
    for (std::uint64_t first = 0; first < rows;) {
      const std::uint64_t count = piece_from(first, rows);
      choose(file, {rows, first, count});
      if (!rows_.rows_.empty()) {
        read(file, {rows, first, count});
        take(rows_);
      }
      first += count;
    }
  }

  const std::vector<std::uint32_t>& twice() const { return twice_; }

 private:
  /// What pieces of one part share.
  void open(const OpenPart& file, std::uint64_t rows) {
    texts_read_ = false;
    file.column(group_, schema::digest(), rows);  // by which rows of one particle are told apart: nothing goes without
    for (Flat* flat : {&events_, &phases_}) {
      if (columns_ & flat->column) flat->offsets = file.offsets(flat->group, rows);
    }
    if (columns_ & kSolver) check_solver_columns(file, group_, info_);
    rows_.sequences_ = &sequences_;
    rows_.reasons_ = &reasons_;
  }

  /// The part's dictionaries, when a row of it is wanted.
  void read_texts(const OpenPart& file) {
    if (std::exchange(texts_read_, true)) return;
    if (columns_ & kSequence) sequences_ = file.texts(schema::kSequences);
    if (columns_ & kInvalidReason) reasons_ = file.texts(schema::kReasons);
  }

  /// Rows of the piece that begins at `first`.
  std::uint64_t piece_from(std::uint64_t first, std::uint64_t rows) const {
    std::uint64_t most = std::min(kRowsAtOnce, rows - first);
    for (const Flat* flat : {&events_, &phases_}) {
      if (flat->offsets.empty()) continue;
      const auto begin = flat->offsets.begin() + static_cast<std::ptrdiff_t>(first);
      const auto end = std::upper_bound(begin + 1, begin + static_cast<std::ptrdiff_t>(most) + 1, *begin + kFlatPiece);
      most = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(end - begin) - 1);
    }
    return most;
  }

  /// Which rows of a piece count.
  void choose(const OpenPart& file, const RowRange& range) {
    const auto [rows, first, count] = range;
    rows_.particle_ = file.slice<std::uint32_t>(group_, schema::particle(), rows, first, count);
    rows_.outcome_ = file.slice<std::uint8_t>(group_, schema::outcome(), rows, first, count);
    rows_.violated_ = file.slice<std::int32_t>(group_, schema::violated(), rows, first, count);
    rows_.rows_.clear();
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t id = rows_.particle_[i];
      if (!parts_.counts(id)) continue;
      const auto outcome = static_cast<Outcome>(rows_.outcome_[i]);
      if (!possible_outcome(outcome, rows_.violated_[i], info_.deciding())) {
        file.fail(fmt::format("policy '{}', particle {}: outcome {} with violated requirement {} is not possible",
                              policy_, id, rows_.outcome_[i], rows_.violated_[i]));
      }
      if (!once_.first(id)) {  // also where it is not wanted: its other row may say that it is
        twice_.push_back(id);
      } else if (!wanted_ || wanted_(id, outcome)) {
        rows_.rows_.push_back(i);
      }
    }
  }

  void read(const OpenPart& file, const RowRange& range) {
    const auto [rows, first, count] = range;
    read_texts(file);
    const auto numbers = [&, rows = rows, first = first, count = count](TraceColumn column, const hdf5::Spec& spec,
                                                                        std::vector<double>& out) {
      if (columns_ & column) out = file.slice<double>(group_, spec, rows, first, count);
    };
    numbers(kEndTime, schema::end_time(), rows_.end_time_);
    numbers(kObjectiveMargin, schema::objective_margin(), rows_.objective_margin_);
    numbers(kMargins, schema::margins(widths_), rows_.margins_);
    numbers(kFirstViolations, schema::first_violations(widths_), rows_.violations_);
    numbers(kFinalState, schema::final_q(widths_), rows_.final_q_);
    numbers(kFinalState, schema::final_v(widths_), rows_.final_v_);
    rows_.solver_.clear();
    const bool solved = (columns_ & kSolver) && file.has(group_ + "/" + schema::solver().name);
    if (solved) numbers(kSolver, schema::solver(), rows_.solver_);
    rows_.convergence_.clear();
    const bool converged = solved && file.has(group_ + "/" + schema::convergence().name);
    if (converged) numbers(kSolver, schema::convergence(), rows_.convergence_);
    rows_.margin_parts_.clear();
    if ((columns_ & kMarginParts) && file.has(group_ + "/" + schema::margin_parts(widths_).name)) {
      rows_.margin_parts_ = file.slice<std::int32_t>(group_, schema::margin_parts(widths_), rows, first, count);
    }
    check_numbers(file, first);
    if (columns_ & kCulprits) rows_.culprits_ = read_culprits(file, policy_, range, rows_.violated_, info_);
    if (columns_ & kDigest) rows_.digest_ = file.slice<std::uint64_t>(group_, schema::digest(), rows, first, count);
    if (columns_ & kSequence) words(file, schema::sequence(), range, sequences_.size(), rows_.sequence_);
    if (columns_ & kInvalidReason) words(file, schema::invalid_reason(), range, reasons_.size(), rows_.reason_);
    read_flat(events_, range, rows_.events_,
              [&](const RowRange& of) { return read_events(file, events_.group, of, info_); });
    read_flat(phases_, range, rows_.phases_,
              [&](const RowRange& of) { return read_phases(file, phases_.group, of, info_, columns_ & kPhaseShares); });
    for (const std::size_t i : rows_.rows_) check_in_order(file, phases_.group, rows_.phases_.of(i));
  }

  /// Those of the rows that are passed on, of the piece that begins at `first`.
  void check_numbers(const OpenPart& file, std::uint64_t first) const {
    const hdf5::Spec q = schema::final_q(widths_), v = schema::final_v(widths_);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const Outcome outcome = rows_.outcome(k);
      if (columns_ & kEndTime) check_end(file, group_, outcome, rows_.end_time(k), info_);
      if (columns_ & kFirstViolations) check_violations(file, group_, rows_.first_violations(k), info_);
      if (rows_.has_solver()) {
        check_solver(file, group_, first + rows_.rows_[k], outcome, rows_.solver(k), !rows_.convergence_.empty());
      }
      if (!(columns_ & kFinalState)) continue;
      check_state(file, group_, q, outcome, rows_.final_q(k));
      check_state(file, group_, v, outcome, rows_.final_v(k));
    }
  }

  /// Indices into one of the part's dictionaries.
  void words(const OpenPart& file, const hdf5::Spec& spec, const RowRange& range, std::size_t texts,
             std::vector<std::uint32_t>& out) const {
    out = file.slice<std::uint32_t>(group_, spec, range.rows, range.first, range.count);
    for (const std::size_t i : rows_.rows_) {
      if (out[i] >= texts) file.fail(fmt::format("'{}/{}': index out of range", group_, spec.name));
    }
  }

  /// A table with any number of rows per trace, and where each trace's begin in the part; no offsets: it has none.
  struct Flat {
    TraceColumn column;
    std::string group;
    std::vector<std::uint64_t> offsets;
  };

  template <class Row, class Read>
  static void read_flat(const Flat& flat, const RowRange& range, FlatRows<Row>& out, const Read& read) {
    out.offset_.clear();
    out.rows_.clear();
    if (flat.offsets.empty()) return;
    const auto begin = flat.offsets.begin() + static_cast<std::ptrdiff_t>(range.first);
    out.offset_.assign(begin, begin + static_cast<std::ptrdiff_t>(range.count) + 1);
    const std::uint64_t first = out.offset_.front(), count = out.offset_.back() - first;
    out.rows_ = read({flat.offsets.back(), first, count});
  }

  const std::string policy_, group_;
  Flat events_, phases_;
  const CampaignInfo& info_;
  const Parts& parts_;
  const Widths widths_;
  const unsigned columns_;
  const TraceFilter& wanted_;
  TraceRows rows_;
  Once once_;
  std::vector<std::uint32_t> twice_;
  std::vector<std::string> sequences_, reasons_;  // of the part, if they
  bool texts_read_ = false;                       // are read
};

void scan_traces(Parts& parts, const std::string& policy, const CampaignInfo& info, unsigned columns,
                 const std::function<void(const TraceRows&)>& take, const TraceFilter& wanted) {
  TraceScan scan(policy, info, parts, columns, wanted);
  for (std::size_t part = 0; part < parts.size(); ++part) scan.scan(*parts.hold(part), take);
  if (!scan.twice().empty()) check_again(parts, policy, info, scan.twice());
}

std::uint64_t count_traces(Parts& parts, const std::string& policy, const CampaignInfo& info) {
  std::uint64_t traces = 0;
  scan_traces(parts, policy, info, 0, [&](const TraceRows& some) { traces += some.size(); });
  return traces;
}

void scan_values(Parts& parts, const CampaignInfo& info,
                 const std::function<void(std::uint32_t, std::span<const double>)>& take) {
  const hdf5::Spec spec = schema::values(widths_of(info));
  Once once;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const std::shared_ptr<const OpenPart> held = parts.hold(part);  // `take` may ask for other parts
    const OpenPart& file = *held;
    if (!file.has(schema::kParticles)) continue;
    const std::uint64_t rows = file.column(schema::kParticles, schema::particle()).rows();
    for (std::uint64_t first = 0; first < rows; first += kRowsAtOnce) {
      const std::uint64_t count = std::min(kRowsAtOnce, rows - first);
      const auto id = file.slice<std::uint32_t>(schema::kParticles, schema::particle(), rows, first, count);
      const auto values = file.slice<double>(schema::kParticles, spec, rows, first, count);
      for (std::size_t i = 0; i < count; ++i) {
        if (!parts.counts(id[i]) || !once.first(id[i])) continue;
        take(id[i], std::span(values).subspan(i * spec.width, spec.width));
      }
    }
  }
}

}  // namespace graze
