#include "archive/schema/part_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "archive/schema/part_rows.h"
#include "archive/schema/trace_scan.h"

namespace graze {
namespace {

constexpr std::uint64_t kRowsOfPart = std::uint64_t{1} << 14;  // rows

/// Calls act(first, count) for all pieces of so many rows.
template <class Act>
void for_each_piece(std::uint64_t rows, const Act& act) {
  for (std::uint64_t first = 0; first < rows; first += kRowsOfPart) act(first, std::min(kRowsOfPart, rows - first));
}

class PartCheck {
 public:
  PartCheck(const OpenPart& part, const CampaignInfo& info) : part_(part), info_(info), widths_(widths_of(info)) {}

  void check() {
    sequences_ = part_.texts(schema::kSequences).size();
    reasons_ = part_.texts(schema::kReasons).size();
    for (const std::string& policy : info_.policies) {
      if (part_.has(schema::traces_group(policy))) check_policy(policy);
    }
    if (part_.has(schema::kParticles)) {
      const std::uint64_t rows = check_ids(schema::kParticles);
      read<double>(schema::kParticles, schema::values(widths_), rows);
    }
    if (info_.store_values && !info_.parameters.empty()) check_values();
  }

  /// The rows of a table, in order of particle id.
  std::uint64_t check_ids(const std::string& group) {
    const std::uint64_t rows = part_.column(group, schema::particle()).rows();
    const ParticleRange& part = info_.part;
    std::int64_t last = -1;
    each<std::uint32_t>(group, schema::particle(), rows, [&](std::uint32_t id) {
      if (id <= last) {
        part_.fail(fmt::format("'{}' is not in order of particle id: {} follows {}", group, id, last));
      }
      if (part.end > 0 && (id < part.begin || id >= part.end)) {
        part_.fail(fmt::format("'{}': particle {} is not of this part of the campaign, {} to {}", group, id, part.begin,
                               part.end - 1));
      }
      last = id;
    });
    return rows;
  }

 private:
  void check_policy(const std::string& policy) {
    const std::string group = schema::traces_group(policy);
    const std::uint64_t rows = check_ids(group);
    check_numbers(group, rows);
    check_outcomes(group, rows);
    check_solver_columns(part_, group, info_);
    if (part_.has(group + "/" + schema::solver().name)) check_solvers(group, rows);
    if (part_.has(group + "/" + schema::margin_parts(widths_).name)) check_parts(policy, group, rows);
    read<std::uint64_t>(group, schema::digest(), rows);
    check_indices(group, schema::sequence(), rows, sequences_);
    check_indices(group, schema::invalid_reason(), rows, reasons_);
    const std::string events = schema::events_group(policy), telemetry = schema::telemetry_group(policy);
    const std::uint64_t all_events = flat_rows(events, rows), frames = flat_rows(telemetry, rows);
    for_each_piece(all_events, [&](std::uint64_t first, std::uint64_t count) {
      for (const Event& event : read_events(part_, events, {all_events, first, count}, info_)) {
        check_time(part_, events, "time", event.time, info_);
      }
    });
    const std::string phases = schema::phases_group(policy);
    const std::uint64_t all_phases = flat_rows(phases, rows);
    const std::vector<std::uint64_t> offset = part_.offsets(phases, rows);
    std::vector<ContactPhase> last;  // of the piece before
    for_each_piece(all_phases, [&](std::uint64_t first, std::uint64_t count) {
      std::vector<ContactPhase> piece = read_phases(part_, phases, {all_phases, first, count}, info_);
      piece.insert(piece.begin(), last.begin(), last.end());
      const std::uint64_t from = first - last.size();
      for (std::uint64_t i = 1; i < piece.size(); ++i) {
        if (std::binary_search(offset.begin(), offset.end(), from + i)) continue;  // the first of a trace
        check_in_order(part_, phases, std::span(piece).subspan(i - 1, 2));
      }
      last.assign(piece.end() - std::min<std::ptrdiff_t>(1, std::ssize(piece)), piece.end());
    });
    if (frames == 0) return;
    for (const hdf5::Spec& spec : schema::telemetry(widths_)) {
      if (spec.name != "time") read<double>(telemetry, spec, frames);
    }
    each<double>(telemetry, schema::time(), frames,
                 [&](double time) { check_time(part_, telemetry, "time", time, info_); });
  }

  /// When traces ended, when their requirements were violated, and their last states.
  void check_numbers(const std::string& group, std::uint64_t rows) {
    const hdf5::Spec violations = schema::first_violations(widths_);
    for_each_piece(rows, [&](std::uint64_t first, std::uint64_t count) {
      const auto outcome = part_.slice<std::uint8_t>(group, schema::outcome(), rows, first, count);
      const auto end = part_.slice<double>(group, schema::end_time(), rows, first, count);
      check_violations(part_, group, part_.slice<double>(group, violations, rows, first, count), info_);
      for (std::size_t i = 0; i < count; ++i) {
        check_end(part_, group, static_cast<Outcome>(outcome[i]), end[i], info_);
      }
      for (const hdf5::Spec& spec : {schema::final_q(widths_), schema::final_v(widths_)}) {
        const auto state = part_.slice<double>(group, spec, rows, first, count);
        for (std::size_t i = 0; i < count; ++i) {
          check_state(part_, group, spec, static_cast<Outcome>(outcome[i]),
                      std::span(state).subspan(i * spec.width, spec.width));
        }
      }
    });
  }

  void check_solvers(const std::string& group, std::uint64_t rows) {
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    const bool converged = part_.has(group + "/" + schema::convergence().name);
    for_each_piece(rows, [&](std::uint64_t first, std::uint64_t count) {
      const auto outcome = part_.slice<std::uint8_t>(group, schema::outcome(), rows, first, count);
      const auto solver = part_.slice<double>(group, schema::solver(), rows, first, count);
      std::vector<double> more;
      if (converged) more = part_.slice<double>(group, schema::convergence(), rows, first, count);
      for (std::size_t i = 0; i < 4 * count; i += 4) {
        SolverLog log = {solver[i], solver[i + 1], solver[i + 2], solver[i + 3], 0, kUnknown, kUnknown, kUnknown};
        if (converged) {
          log.steps = more[i], log.median_residual = more[i + 1];
          log.braked_steps = more[i + 2], log.most_braked = more[i + 3];
        }
        check_solver(part_, group, first + i / 4, static_cast<Outcome>(outcome[i / 4]), log, converged);
      }
    });
  }

  /// Every trace's particle must have its values beside it.
  void check_values() {
    std::vector<bool> valued;
    const std::uint64_t rows =
        part_.has(schema::kParticles) ? part_.column(schema::kParticles, schema::particle()).rows() : 0;
    each<std::uint32_t>(schema::kParticles, schema::particle(), rows, [&](std::uint32_t id) {
      if (id >= valued.size()) valued.resize(std::max<std::size_t>(std::size_t{id} + 1, 2 * valued.size()));
      valued[id] = true;
    });
    for (const std::string& policy : info_.policies) {
      const std::string group = schema::traces_group(policy);
      each<std::uint32_t>(group, schema::particle(), part_.traces(policy), [&](std::uint32_t id) {
        if (id < valued.size() && valued[id]) return;
        part_.fail(fmt::format("'{}': particle {} has no values in '{}', which the campaign stores", group, id,
                               schema::kParticles));
      });
    }
  }

  std::uint64_t flat_rows(const std::string& group, std::uint64_t traces) {
    const std::vector<std::uint64_t> offset = part_.offsets(group, traces);
    return offset.empty() ? 0 : offset.back();
  }

  void check_outcomes(const std::string& group, std::uint64_t rows) {
    const hdf5::Spec margin = schema::margins(widths_), violation = schema::first_violations(widths_);
    for_each_piece(rows, [&](std::uint64_t first, std::uint64_t count) {
      const auto outcome = part_.slice<std::uint8_t>(group, schema::outcome(), rows, first, count);
      const auto violated = part_.slice<std::int32_t>(group, schema::violated(), rows, first, count);
      const auto objective = part_.slice<double>(group, schema::objective_margin(), rows, first, count);
      const auto margins = part_.slice<double>(group, margin, rows, first, count);
      const auto times = part_.slice<double>(group, violation, rows, first, count);
      const auto end = part_.slice<double>(group, schema::end_time(), rows, first, count);
      for (std::size_t i = 0; i < count; ++i) {
        const auto known = static_cast<Outcome>(outcome[i]);
        if (!possible_outcome(known, violated[i], info_.deciding())) {
          part_.fail(fmt::format("'{}', row {}: outcome {} with violated requirement {} is not possible", group,
                                 first + i, outcome[i], violated[i]));
        }
        const Verdict verdict{known,
                              violated[i],
                              end[i],
                              objective[i],
                              std::span(margins).subspan(i * margin.width, margin.width),
                              std::span(times).subspan(i * violation.width, violation.width)};
        if (const std::string why = contradiction(verdict, info_.deciding()); !why.empty()) {
          part_.fail(fmt::format("'{}', row {}: outcome {} is not possible: {}", group, first + i, outcome[i], why));
        }
      }
    });
  }

  /// Columns that older archives lack; read_culprits() checks the culprits of failures.
  void check_parts(const std::string& policy, const std::string& group, std::uint64_t rows) {
    for (const hdf5::Spec& spec : {schema::margin_parts(widths_), schema::violation_parts(widths_)}) {
      for_each_piece(rows, [&](std::uint64_t first, std::uint64_t count) {
        const auto parts = part_.slice<std::int32_t>(group, spec, rows, first, count);
        for (std::size_t i = 0; i < parts.size(); ++i) {
          if (possible_part(info_.requirements[i % spec.width].parts, parts[i], info_)) continue;
          part_.fail(fmt::format("'{}/{}': {} is no part of the campaign", group, spec.name, parts[i]));
        }
      });
    }
    for_each_piece(rows, [&](std::uint64_t first, std::uint64_t count) {
      const std::vector<std::int32_t> none(count, -1);
      read_culprits(part_, policy, {rows, first, count}, none, info_);
    });
  }

  void check_indices(const std::string& group, const hdf5::Spec& spec, std::uint64_t rows, std::size_t texts) {
    each<std::uint32_t>(group, spec, rows, [&](std::uint32_t index) {
      if (index >= texts) part_.fail(fmt::format("'{}/{}': index out of range", group, spec.name));
    });
  }

  template <class T>
  void read(const std::string& group, const hdf5::Spec& spec, std::uint64_t rows) {
    for_each_piece(rows,
                   [&](std::uint64_t first, std::uint64_t count) { part_.slice<T>(group, spec, rows, first, count); });
  }

  template <class T, class Act>
  void each(const std::string& group, const hdf5::Spec& spec, std::uint64_t rows, const Act& act) {
    for_each_piece(rows, [&](std::uint64_t first, std::uint64_t count) {
      for (const T value : part_.slice<T>(group, spec, rows, first, count)) act(value);
    });
  }

  const OpenPart& part_;
  const CampaignInfo& info_;
  const Widths widths_;
  std::size_t sequences_ = 0, reasons_ = 0;
};

}  // namespace

void check_part(OpenPart& part, const CampaignInfo& info) {
  part.keep_columns();
  part.check_tree();
  PartCheck(part, info).check();
}

void check_outcomes(Parts& part, const CampaignInfo& info) {
  PartCheck check(part.open(0), info);
  if (part.open(0).has(schema::kParticles)) check.check_ids(schema::kParticles);
  for (const std::string& policy : info.policies) {
    if (part.open(0).traces(policy) > 0) check.check_ids(schema::traces_group(policy));
    const unsigned columns =
        // What scores, reports and lists of failures ask for.
        kEndTime | kObjectiveMargin | kMargins | kFirstViolations | kCulprits | kSolver | kFinalState | kInvalidReason;
    scan_traces(part, policy, info, columns, [](const TraceRows&) {});
  }
}

}  // namespace graze
