// Rows of a part: see part_rows.h.
#include "archive/schema/part_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "archive/schema/culprit.h"

namespace graze {
namespace {

bool within(int index, const std::vector<std::string>& names) {
  return index >= 0 && index < static_cast<int>(names.size());
}

bool possible(const Event& event, const CampaignInfo& info) {
  if (event.kind > EventKind::roll_to_slip || event.feature_a > Feature::rim || event.feature_b > Feature::rim)
    return false;
  const bool limit = event.kind == EventKind::limit_begin || event.kind == EventKind::limit_end;
  return limit ? within(event.a, info.bodies) && (event.b == -1 || event.b == 1)
               : within(event.a, info.colliders) && within(event.b, info.colliders);
}

bool possible(const ContactPhase& phase, const CampaignInfo& info) {
  constexpr double kRounding = 1e-9;
  return phase.feature_a <= Feature::rim && phase.feature_b <= Feature::rim && within(phase.a, info.colliders) &&
         within(phase.b, info.colliders) && phase.a < phase.b && phase.begin >= 0 && phase.begin <= phase.end &&
         phase.end <= info.end * (1 + kRounding) && phase.peak >= 0 && phase.peak <= phase.impulse * (1 + kRounding) &&
         std::isfinite(phase.impulse) && phase.slip >= 0 && phase.roll >= 0 && phase.slip + phase.roll <= 1 + kRounding;
}

/// Reads flat rows column by column into what they stand for.
template <class Row>
class RowFiller {
 public:
  RowFiller(const OpenPart& file, const std::string& group, RowRange range)
      : file_(file), group_(group), range_(range), rows_(range.count) {}

  template <class T, class Set>
  void fill(const hdf5::Spec& spec, const Set& set) {
    const auto data = file_.slice<T>(group_, spec, range_.rows, range_.first, range_.count);
    for (std::uint64_t i = 0; i < range_.count; ++i) set(rows_[i], data.data() + i * spec.width);
  }
  /// What events and phases have in common.
  void fill_sides() {
    fill<std::int32_t>(schema::collider("a"), [](Row& row, const auto* x) { row.a = *x; });
    fill<std::int32_t>(schema::collider("b"), [](Row& row, const auto* x) { row.b = *x; });
    fill<std::uint8_t>(schema::feature("feature_a"),
                       [](Row& row, const auto* x) { row.feature_a = static_cast<Feature>(*x); });
    fill<std::uint8_t>(schema::feature("feature_b"),
                       [](Row& row, const auto* x) { row.feature_b = static_cast<Feature>(*x); });
    fill<double>(schema::impulse(), [](Row& row, const double* x) { row.impulse = *x; });
  }
  std::vector<Row> take() { return std::move(rows_); }

 private:
  const OpenPart& file_;
  const std::string& group_;
  const RowRange range_;
  std::vector<Row> rows_;
};

}  // namespace

void check_time(const OpenPart& file, const std::string& group, const std::string& name, double time,
                const CampaignInfo& info) {
  constexpr double kRounding = 1e-9;  // times are sums of steps
  if (time >= 0 && time <= info.end * (1 + kRounding)) return;
  file.fail(fmt::format("'{}/{}': {} s does not lie in a trace, 0 to {} s", group, name, time, info.end));
}

bool possible_outcome(Outcome outcome, int violated, std::size_t requirements) {
  return outcome <= Outcome::invalid && violated >= -1 && violated < static_cast<int>(requirements) &&
         (outcome != Outcome::known_failure || violated >= 0);
}

std::string contradiction(const Verdict& trace, std::size_t deciding) {
  if (trace.outcome == Outcome::invalid) return "";
  const std::span<const double> times = trace.first_violations.first(deciding);
  for (std::size_t i = 0; i < trace.margins.size(); ++i) {
    // Below 0 is violated; a witness that is no number violates, too, and leaves the margin as it is.
    if (trace.margins[i] >= 0 || (trace.margins[i] < 0 && !std::isnan(trace.first_violations[i]))) continue;
    return fmt::format("requirement {} has margin {} and was never violated", i, trace.margins[i]);
  }
  constexpr double kRounding = 1 + 1e-9;
  for (std::size_t i = 0; i < trace.first_violations.size(); ++i) {
    if (!(trace.first_violations[i] > kRounding * trace.end_time)) continue;
    return fmt::format("requirement {} was violated at {} s, and the trace ended at {} s", i, trace.first_violations[i],
                       trace.end_time);
  }
  if (trace.outcome == Outcome::known_failure) {
    const double first = times[static_cast<std::size_t>(trace.violated)];
    if (std::isnan(first)) return fmt::format("requirement {} is the failure and was never violated", trace.violated);
    for (std::size_t i = 0; i < times.size(); ++i) {
      if (!(times[i] < first)) continue;
      return fmt::format("requirement {} is the failure, and {} was violated before it", trace.violated, i);
    }
    return "";
  }
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!std::isnan(times[i]))
      return fmt::format("requirement {} was violated at {} s, which is a failure", i, times[i]);
  }
  if (trace.violated >= 0) return fmt::format("requirement {} is told as the failure", trace.violated);
  const bool met = trace.objective_margin >= 0;
  if (met == (trace.outcome == Outcome::success)) return "";
  return fmt::format("the objective's margin {} makes {}", trace.objective_margin, met ? "a success" : "no success");
}

void check_end(const OpenPart& file, const std::string& group, Outcome outcome, double end_time,
               const CampaignInfo& info) {
  if (outcome != Outcome::invalid || !std::isnan(end_time)) {
    check_time(file, group, schema::end_time().name, end_time, info);
  }
}

void check_violations(const OpenPart& file, const std::string& group, std::span<const double> times,
                      const CampaignInfo& info) {
  for (const double time : times) {
    if (!std::isnan(time)) check_time(file, group, "first_violations", time, info);
  }
}

void check_state(const OpenPart& file, const std::string& group, const hdf5::Spec& spec, Outcome outcome,
                 std::span<const double> numbers) {
  if (outcome == Outcome::invalid) return;
  for (const double number : numbers) {
    if (std::isfinite(number)) continue;
    file.fail(fmt::format("'{}/{}': {} in a valid trace, whose state must be finite", group, spec.name, number));
  }
}

void check_solver_columns(const OpenPart& file, const std::string& group, const CampaignInfo& info) {
  if (!info.tells_convergence) return;
  for (const hdf5::Spec& spec : {schema::solver(), schema::convergence()}) {
    if (file.has(group + "/" + spec.name)) continue;
    file.fail(fmt::format("'{}/{}' is not there, and the campaign has 'unconverged_limit', which is about it", group,
                          spec.name));
  }
}

void check_solver(const OpenPart& file, const std::string& group, std::uint64_t row, Outcome outcome,
                  const SolverLog& log, bool whole) {
  const hdf5::Spec solver = schema::solver(), more = schema::convergence();
  const auto check = [&](const hdf5::Spec& spec, int column, double number, const char* what, bool possible) {
    if (possible) return;
    file.fail(fmt::format("'{}/{}', row {}, column {}: {} is no {}", group, spec.name, row, column, number, what));
  };
  constexpr double kMost = 9007199254740992;  // 2^53
  const auto count = [](double x, double most) { return x >= 0 && x <= most && x == std::floor(x); };
  // What becomes of an invalid trace may overflow.
  const auto change = [&](double x, double most) {
    return x >= 0 && x <= most && (std::isfinite(x) || outcome == Outcome::invalid);
  };
  constexpr double kAny = std::numeric_limits<double>::infinity(), kRounding = 1 + 1e-9;
  constexpr const char *kSweeps = "number of sweeps", *kChange = "change of velocity", *kSteps = "number of steps",
                       *kOfSteps = "number of the trace's steps";
  check(solver, 1, log.most_sweeps, kSweeps, count(log.most_sweeps, kMost));
  check(solver, 0, log.mean_sweeps, "mean of numbers of sweeps up to column 1",
        log.mean_sweeps >= 0 && log.mean_sweeps <= log.most_sweeps * kRounding);
  check(solver, 2, log.largest_residual, kChange, change(log.largest_residual, kAny));
  check(solver, 3, log.unconverged_steps, kSteps, count(log.unconverged_steps, kMost));
  if (!whole) return;
  check(more, 0, log.steps, kSteps, count(log.steps, kMost));
  check(solver, 3, log.unconverged_steps, kOfSteps, log.unconverged_steps <= log.steps);
  check(more, 1, log.median_residual, "median of changes of velocity up to the largest",
        change(log.median_residual, log.unconverged_steps > 0 ? log.largest_residual : 0));
  check(more, 2, log.braked_steps, kOfSteps, count(log.braked_steps, log.steps));
  check(more, 3, log.most_braked, kChange, change(log.most_braked, kAny));
  check(more, 3, log.most_braked, "change of velocity that is counted as braked",
        log.braked_steps == 0 || log.most_braked > kBraked);
}

bool possible_part(const std::string& parts, int part, const CampaignInfo& info) {
  return part == kNoPart || (part >= 0 && static_cast<std::uint64_t>(part) < part_count(parts, info));
}

std::vector<Culprit> read_culprits(const OpenPart& file, const std::string& policy, RowRange range,
                                   const std::vector<std::int32_t>& violated, const CampaignInfo& info) {
  std::vector<Culprit> out(range.count);
  const std::string group = schema::traces_group(policy);
  const hdf5::Spec parts = schema::violation_parts(widths_of(info)), objective = schema::objective_culprit();
  if (!file.has(group + "/" + parts.name)) return out;
  const auto part = file.slice<std::int32_t>(group, parts, range.rows, range.first, range.count);
  const auto leaf = file.slice<std::int32_t>(group, objective, range.rows, range.first, range.count);
  const int leaves = static_cast<int>(info.leaves.size()), requirements = static_cast<int>(info.requirements.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const bool known = violated[i] >= 0 && violated[i] < requirements;
    out[i] = known ? Culprit{-1, part[i * parts.width + static_cast<std::size_t>(violated[i])]}
                   : Culprit{leaf[2 * i], leaf[2 * i + 1]};
    const bool has_leaf = out[i].leaf >= 0 && out[i].leaf < leaves;
    const std::string& kind = known      ? info.requirements[static_cast<std::size_t>(violated[i])].parts
                              : has_leaf ? info.leaves[static_cast<std::size_t>(out[i].leaf)].parts
                                         : std::string();
    if ((!has_leaf && out[i].leaf != -1) || !possible_part(kind, out[i].part, info)) {
      file.fail(fmt::format("'{}': a culprit that the campaign does not have", group));
    }
  }
  return out;
}

std::vector<Event> read_events(const OpenPart& file, const std::string& group, RowRange range,
                               const CampaignInfo& info) {
  RowFiller<Event> filler(file, group, range);
  filler.fill_sides();
  filler.fill<double>(schema::time(), [](Event& e, const double* x) { e.time = *x; });
  filler.fill<std::uint8_t>(schema::kind(), [](Event& e, const auto* x) { e.kind = static_cast<EventKind>(*x); });
  filler.fill<double>(schema::position(), [](Event& e, const double* x) { e.p_W = Vec3(x[0], x[1], x[2]); });
  std::vector<Event> events = filler.take();
  for (const Event& event : events) {
    if (!possible(event, info)) file.fail(fmt::format("'{}': an event with an index out of range", group));
  }
  return events;
}

std::vector<ContactPhase> read_phases(const OpenPart& file, const std::string& group, RowRange range,
                                      const CampaignInfo& info, bool shares) {
  RowFiller<ContactPhase> filler(file, group, range);
  filler.fill_sides();
  filler.fill<double>(schema::begin(), [](ContactPhase& p, const double* x) { p.begin = *x; });
  filler.fill<double>(schema::end(), [](ContactPhase& p, const double* x) { p.end = *x; });
  if (shares) {
    filler.fill<double>(schema::peak(), [](ContactPhase& p, const double* x) { p.peak = *x; });
    filler.fill<double>(schema::share("slip"), [](ContactPhase& p, const double* x) { p.slip = *x; });
    filler.fill<double>(schema::share("roll"), [](ContactPhase& p, const double* x) { p.roll = *x; });
  }
  std::vector<ContactPhase> phases = filler.take();
  for (const ContactPhase& phase : phases) {
    if (!possible(phase, info)) file.fail(fmt::format("'{}': a phase that no trace can have", group));
  }
  return phases;
}

void check_in_order(const OpenPart& file, const std::string& group, std::span<const ContactPhase> trace) {
  const auto before = [](const ContactPhase& a, const ContactPhase& b) { return a.begin < b.begin; };
  if (!std::is_sorted(trace.begin(), trace.end(), before)) {
    file.fail(fmt::format("'{}': phases of a trace that do not stand in the order of their beginnings", group));
  }
}

std::vector<TelemetryFrame> read_frames(const OpenPart& file, const std::string& group, RowRange range,
                                        const Widths& widths) {
  const auto [rows, first, count] = range;
  const auto time = file.slice<double>(group, schema::time(), rows, first, count);
  const auto q = file.slice<double>(group, schema::telemetry_q(widths), rows, first, count);
  const auto v = file.slice<double>(group, schema::telemetry_v(widths), rows, first, count);
  const auto tau = file.slice<double>(group, schema::telemetry_tau(widths), rows, first, count);
  const auto row = [](const std::vector<double>& data, std::size_t width, std::uint64_t i) {
    return std::vector<double>(data.begin() + static_cast<std::ptrdiff_t>(i * width),
                               data.begin() + static_cast<std::ptrdiff_t>((i + 1) * width));
  };
  std::vector<TelemetryFrame> frames;
  for (std::uint64_t i = 0; i < count; ++i) {
    frames.push_back({time[i], row(q, widths.q, i), row(v, widths.v, i), row(tau, widths.actuators, i)});
  }
  return frames;
}

TraceRecord read_trace(const OpenPart& file, const std::string& policy, std::uint64_t row, const CampaignInfo& info) {
  const std::string group = schema::traces_group(policy);
  const std::uint64_t rows = file.traces(policy);
  const Widths widths = widths_of(info);
  const auto numbers = [&](const hdf5::Spec& spec) { return file.slice<double>(group, spec, rows, row, 1); };
  const auto index = [&](const hdf5::Spec& spec) { return file.slice<std::uint32_t>(group, spec, rows, row, 1)[0]; };
  TraceRecord trace;
  trace.particle = index(schema::particle());
  trace.outcome = static_cast<Outcome>(file.slice<std::uint8_t>(group, schema::outcome(), rows, row, 1)[0]);
  trace.violated = file.slice<std::int32_t>(group, schema::violated(), rows, row, 1)[0];
  if (!possible_outcome(trace.outcome, trace.violated, info.deciding())) {
    file.fail(fmt::format("particle {}: outcome {} with violated requirement {} is not possible", trace.particle,
                          static_cast<int>(trace.outcome), trace.violated));
  }
  trace.end_time = numbers(schema::end_time())[0];
  check_end(file, group, trace.outcome, trace.end_time, info);
  trace.objective_margin = numbers(schema::objective_margin())[0];
  trace.margins = numbers(schema::margins(widths));
  trace.first_violations = numbers(schema::first_violations(widths));
  check_violations(file, group, trace.first_violations, info);
  if (file.has(group + "/" + schema::margin_parts(widths).name)) {
    trace.margin_parts = file.slice<std::int32_t>(group, schema::margin_parts(widths), rows, row, 1);
    trace.violation_parts = file.slice<std::int32_t>(group, schema::violation_parts(widths), rows, row, 1);
    const auto culprit = file.slice<std::int32_t>(group, schema::objective_culprit(), rows, row, 1);
    trace.objective_culprit = {culprit[0], culprit[1]};
  }
  trace.q = numbers(schema::final_q(widths));
  trace.v = numbers(schema::final_v(widths));
  check_state(file, group, schema::final_q(widths), trace.outcome, trace.q);
  check_state(file, group, schema::final_v(widths), trace.outcome, trace.v);
  trace.digest = file.slice<std::uint64_t>(group, schema::digest(), rows, row, 1)[0];
  if (trace.outcome == Outcome::invalid) {
    const std::vector<std::string> reasons = file.texts(schema::kReasons);
    const std::uint32_t reason = index(schema::invalid_reason());
    if (reason >= reasons.size()) file.fail(fmt::format("'{}/invalid_reason': index out of range", group));
    trace.invalid_reason = reasons[reason];
  }
  const std::string events = schema::events_group(policy);
  if (const auto offset = file.offsets(events, rows); !offset.empty()) {
    trace.events = read_events(file, events, {offset.back(), offset[row], offset[row + 1] - offset[row]}, info);
  }
  const std::string phases = schema::phases_group(policy);
  if (const auto offset = file.offsets(phases, rows); !offset.empty()) {
    trace.phases = read_phases(file, phases, {offset.back(), offset[row], offset[row + 1] - offset[row]}, info);
    check_in_order(file, phases, trace.phases);
  }
  return trace;
}

}  // namespace graze
