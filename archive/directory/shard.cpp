#include "archive/directory/shard.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>

#include "archive/hdf5/file_driver.h"
#include "archive/schema/info.h"
#include "archive/schema/schema.h"

namespace graze {
namespace {

using Traces = std::vector<TraceRecord>;

constexpr int kShardDeflate = 1;  // shards are passing things: fast

/// Numbers texts in order of first appearance.
class Dictionary {
 public:
  std::uint32_t index(const std::string& text) {
    const auto [entry, fresh] = index_.emplace(text, static_cast<std::uint32_t>(texts_.size()));
    if (fresh) texts_.push_back(text);
    return entry->second;
  }
  const std::vector<std::string>& texts() const { return texts_; }

 private:
  std::map<std::string, std::uint32_t> index_;
  std::vector<std::string> texts_;
};

/// Writes one table: `value` gives what each column holds for each row.
class TableWriter {
 public:
  TableWriter(const hdf5::Handle& file, std::string group, int deflate)
      : file_(file), group_(std::move(group)), deflate_(deflate) {}

  template <class T, class Rows, class Get>
  void column(const hdf5::Spec& spec, const Rows& rows, const Get& get) const {
    std::vector<T> data;
    data.reserve(rows.size());
    for (const auto& row : rows) data.push_back(static_cast<T>(get(row)));
    hdf5::write_column(file_.id(), group_, spec, data, deflate_);
  }

  template <class Rows, class Get>
  void matrix(const hdf5::Spec& spec, const Rows& rows, const Get& get) const {
    matrix_of(spec, rows, get, std::numeric_limits<double>::quiet_NaN());
  }

  /// `missing`: values of rows that have none: a particle that could not be fabricated has no state, margins or parts.
  template <class T, class Rows, class Get>
  void matrix_of(const hdf5::Spec& spec, const Rows& rows, const Get& get, T missing) const {
    std::vector<T> data;
    data.reserve(rows.size() * spec.width);
    for (const auto& row : rows) {
      const auto& values = get(row);
      if (values.size() == 0) {
        data.insert(data.end(), spec.width, missing);
        continue;
      }
      assert(static_cast<std::size_t>(values.size()) == spec.width);
      data.insert(data.end(), values.data(), values.data() + spec.width);
    }
    if (spec.width > 0) return hdf5::write_column(file_.id(), group_, spec, data, deflate_);
    hdf5::Column::create(file_.id(), group_, spec, rows.size(), 0);
  }

 private:
  const hdf5::Handle& file_;
  std::string group_;
  int deflate_;
};

void write_traces(const hdf5::Handle& file, const std::string& policy, const Traces& traces, const Widths& widths,
                  Dictionary& sequences, Dictionary& reasons) {
  using T = TraceRecord;
  const TableWriter table(file, schema::traces_group(policy), 0);
  table.column<std::uint32_t>(schema::particle(), traces, [](const T& t) { return t.particle; });
  table.column<std::uint8_t>(schema::outcome(), traces, [](const T& t) { return t.outcome; });
  table.column<std::int32_t>(schema::violated(), traces, [](const T& t) { return t.violated; });
  table.column<double>(schema::end_time(), traces, [](const T& t) { return t.end_time; });
  table.column<double>(schema::objective_margin(), traces, [](const T& t) { return t.objective_margin; });
  table.column<std::uint64_t>(schema::digest(), traces, [](const T& t) { return t.digest; });
  table.column<std::uint32_t>(schema::sequence(), traces, [&](const T& t) { return sequences.index(t.sequence); });
  table.column<std::uint32_t>(schema::invalid_reason(), traces,
                              [&](const T& t) { return reasons.index(t.invalid_reason); });
  table.matrix(
      schema::margins(widths), traces, [](const T& t) -> const auto& { return t.margins; });
  table.matrix(
      schema::first_violations(widths), traces, [](const T& t) -> const auto& { return t.first_violations; });
  table.matrix_of(
      schema::margin_parts(widths), traces, [](const T& t) -> const auto& { return t.margin_parts; },
      std::int32_t{kNoPart});
  table.matrix_of(
      schema::violation_parts(widths), traces, [](const T& t) -> const auto& { return t.violation_parts; },
      std::int32_t{kNoPart});
  table.matrix_of(
      schema::objective_culprit(), traces,
      [](const T& t) {
        return std::array{t.objective_culprit.leaf, t.objective_culprit.part};
      },
      std::int32_t{kNoPart});
  table.matrix(schema::solver(), traces, [](const T& t) {
    const SolverLog& log = t.solver;
    return std::array{log.mean_sweeps, log.most_sweeps, log.largest_residual, log.unconverged_steps};
  });
  table.matrix(schema::convergence(), traces, [](const T& t) {
    const SolverLog& log = t.solver;
    return std::array{log.steps, log.median_residual, log.braked_steps, log.most_braked};
  });
  table.matrix(
      schema::final_q(widths), traces, [](const T& t) -> const auto& { return t.q; });
  table.matrix(
      schema::final_v(widths), traces, [](const T& t) -> const auto& { return t.v; });
}

/// All rows of all traces, and where each trace's begin; no rows at all: nothing is written.
template <class Row, class Get>
std::vector<const Row*> flatten(const hdf5::Handle& file, const std::string& group, const Traces& traces,
                                const Get& get) {
  std::vector<const Row*> rows;
  std::vector<std::uint64_t> offset = {0};
  for (const TraceRecord& trace : traces) {
    for (const Row& row : get(trace)) rows.push_back(&row);
    offset.push_back(rows.size());
  }
  if (!rows.empty()) hdf5::write_column(file.id(), group, schema::offset(), offset, kShardDeflate);
  return rows;
}

/// Parts and features of events or phases.
template <class Rows>
void write_sides(const TableWriter& table, const Rows& rows) {
  table.column<std::int32_t>(schema::collider("a"), rows, [](auto row) { return row->a; });
  table.column<std::int32_t>(schema::collider("b"), rows, [](auto row) { return row->b; });
  table.column<std::uint8_t>(schema::feature("feature_a"), rows, [](auto row) { return row->feature_a; });
  table.column<std::uint8_t>(schema::feature("feature_b"), rows, [](auto row) { return row->feature_b; });
}

void write_events(const hdf5::Handle& file, const std::string& policy, const Traces& traces) {
  using E = const Event*;
  const std::string group = schema::events_group(policy);
  const auto rows = flatten<Event>(
      file, group, traces, [](const TraceRecord& t) -> const auto& { return t.events; });
  if (rows.empty()) return;
  // Numbers of events hardly compress, and would take longer to than all the rest of an archive: left to `pack`.
  const TableWriter table(file, group, kShardDeflate), numbers(file, group, 0);
  numbers.column<double>(schema::time(), rows, [](E e) { return e->time; });
  table.column<std::uint8_t>(schema::kind(), rows, [](E e) { return e->kind; });
  write_sides(table, rows);
  numbers.column<double>(schema::impulse(), rows, [](E e) { return e->impulse; });
  numbers.matrix(
      schema::position(), rows, [](E e) -> const auto& { return e->p_W; });
}

void write_phases(const hdf5::Handle& file, const std::string& policy, const Traces& traces) {
  using P = const ContactPhase*;
  const std::string group = schema::phases_group(policy);
  const auto rows = flatten<ContactPhase>(
      file, group, traces, [](const TraceRecord& t) -> const auto& { return t.phases; });
  if (rows.empty()) return;
  const TableWriter table(file, group, kShardDeflate), numbers(file, group, 0);
  numbers.column<double>(schema::begin(), rows, [](P p) { return p->begin; });
  numbers.column<double>(schema::end(), rows, [](P p) { return p->end; });
  write_sides(table, rows);
  numbers.column<double>(schema::peak(), rows, [](P p) { return p->peak; });
  numbers.column<double>(schema::impulse(), rows, [](P p) { return p->impulse; });
  numbers.column<double>(schema::share("slip"), rows, [](P p) { return p->slip; });
  numbers.column<double>(schema::share("roll"), rows, [](P p) { return p->roll; });
}

/// One column of all traces' frames, trace after trace, straight from where they lie.
template <class Get>
void write_frames(const hdf5::Handle& file, const std::string& group, const hdf5::Spec& spec, std::uint64_t rows,
                  const Traces& traces, const Get& get) {
  hdf5::Column column = hdf5::Column::create(file.id(), group, spec, rows, 0);
  std::uint64_t first = 0;
  for (const TraceRecord& trace : traces) {
    const std::vector<double>& data = get(trace.telemetry);
    assert(data.size() == trace.telemetry.size() * spec.width);
    column.write(first, trace.telemetry.size(), data.data());
    first += trace.telemetry.size();
  }
}

/// Plain: compressing frames of every step would take several times as long as simulating them; left to `pack`.
void write_telemetry(const hdf5::Handle& file, const std::string& policy, const Traces& traces, const Widths& widths) {
  using Log = FrameLog;
  const std::string group = schema::telemetry_group(policy);
  std::vector<std::uint64_t> offset = {0};
  for (const TraceRecord& trace : traces) offset.push_back(offset.back() + trace.telemetry.size());
  const std::uint64_t rows = offset.back();
  if (rows == 0) return;
  hdf5::write_column(file.id(), group, schema::offset(), offset, kShardDeflate);
  const auto write = [&](const hdf5::Spec& spec, const std::vector<double>& (Log::*column)() const) {
    write_frames(
        file, group, spec, rows, traces, [&](const Log& log) -> const auto& { return (log.*column)(); });
  };
  write(schema::time(), &Log::time);
  write(schema::telemetry_q(widths), &Log::q);
  write(schema::telemetry_v(widths), &Log::v);
  write(schema::telemetry_tau(widths), &Log::tau);
}

std::size_t memory_of(const TraceRecord& trace) {
  const FrameLog& frames = trace.telemetry;
  const std::size_t doubles = trace.margins.size() * 2 + trace.q.size() + trace.v.size() + frames.time().size() +
                              frames.q().size() + frames.v().size() + frames.tau().size();
  return sizeof(TraceRecord) + 8 * doubles + 8 * trace.margin_parts.size() + trace.sequence.size() +
         trace.events.size() * sizeof(Event) + trace.phases.size() * sizeof(ContactPhase);
}

}  // namespace

void ShardBuffer::add(int policy, std::vector<TraceRecord> traces, const std::vector<double>& values,
                      std::size_t parameters) {
  assert(values.empty() || values.size() == traces.size() * parameters);
  for (std::size_t i = 0; i < traces.size(); ++i) {
    bytes_ += memory_of(traces[i]);
    if (values.empty()) continue;
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(i * parameters);
    const auto fresh =
        values_.try_emplace(traces[i].particle, first, first + static_cast<std::ptrdiff_t>(parameters)).second;
    if (fresh) bytes_ += 8 * parameters;
  }
  count_ += traces.size();
  auto& all = traces_[static_cast<std::size_t>(policy)];
  std::move(traces.begin(), traces.end(), std::back_inserter(all));
}

ShardEntry ShardBuffer::publish(const Directory& folder, const std::string& name, const CampaignInfo& info) {
  const Seal seal = publish_hdf5(folder, name, [&](const hdf5::Handle& file) { write(file, info); });
  ShardEntry entry{name, seal.bytes, seal.digest, {}};
  for (std::size_t policy = 0; policy < traces_.size(); ++policy) {
    const Traces& traces = traces_[policy];  // sorted by now
    if (traces.empty()) continue;
    entry.traces.push_back({info.policies[policy], traces.size(), traces.front().particle, traces.back().particle});
  }
  return entry;
}

void ShardBuffer::write(const hdf5::Handle& file, const CampaignInfo& info) {
  write_shard_identity(file, info);
  const Widths widths = widths_of(info);
  Dictionary sequences, reasons;
  for (std::size_t policy = 0; policy < traces_.size(); ++policy) {
    Traces& traces = traces_[policy];
    if (traces.empty()) continue;
    std::sort(traces.begin(), traces.end(),
              [](const TraceRecord& a, const TraceRecord& b) { return a.particle < b.particle; });
    write_traces(file, info.policies[policy], traces, widths, sequences, reasons);
    write_events(file, info.policies[policy], traces);
    write_phases(file, info.policies[policy], traces);
    write_telemetry(file, info.policies[policy], traces, widths);
  }
  hdf5::write_strings(file.id(), schema::kSequences, sequences.texts());
  hdf5::write_strings(file.id(), schema::kReasons, reasons.texts());
  if (!values_.empty()) {
    const TableWriter table(file, schema::kParticles, 0);
    table.column<std::uint32_t>(schema::particle(), values_, [](const auto& row) { return row.first; });
    table.matrix(
        schema::values(widths), values_, [](const auto& row) -> const auto& { return row.second; });
  }
}

}  // namespace graze
