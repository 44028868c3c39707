// Archive: reads campaigns.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "archive/archive.h"
#include "archive/directory/campaign_files.h"
#include "archive/schema/failure_scan.h"
#include "archive/schema/outcome_scan.h"
#include "archive/schema/part_rows.h"

namespace graze {
namespace {

/// Where the rows of each part begin when all parts' tables are laid one behind the other.
struct Concatenation {
  std::vector<std::uint64_t> begin;  // [part]
  std::uint64_t rows = 0;
};

Concatenation concatenate(Parts& parts, const std::string& policy) {
  Concatenation all;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    all.begin.push_back(all.rows);
    all.rows += parts.open(part).traces(policy);
  }
  return all;
}

/// Reads the columns of one policy and puts them into the order of `order`.
class TableReader {
 public:
  TableReader(Parts& parts, const std::string& policy, const std::vector<RowRef>& order)
      : parts_(parts), group_(schema::traces_group(policy)), policy_(policy), order_(order) {
    const Concatenation all = concatenate(parts, policy);
    position_.reserve(order.size());
    for (const RowRef& ref : order) position_.push_back(all.begin[ref.part] + ref.row);
    rows_ = all.rows;
  }

  /// Whether all parts have the column; older ones may not.
  bool has(const hdf5::Spec& spec) {
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      const OpenPart& file = parts_.open(part);
      if (file.traces(policy_) > 0 && !file.has(group_ + "/" + spec.name)) return false;
    }
    return true;
  }

  template <class T>
  std::vector<T> column(const hdf5::Spec& spec) {
    const std::vector<T> all = concatenated<T>(spec);
    std::vector<T> out(position_.size());
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = all[position_[i]];
    return out;
  }

  /// [column][trace]
  std::vector<std::vector<double>> matrix(const hdf5::Spec& spec) {
    const std::vector<double> all = concatenated<double>(spec);
    std::vector<std::vector<double>> out(spec.width, std::vector<double>(position_.size()));
    for (std::size_t i = 0; i < position_.size(); ++i) {
      for (std::size_t k = 0; k < spec.width; ++k) out[k][i] = all[position_[i] * spec.width + k];
    }
    return out;
  }

  std::vector<std::string> texts(const hdf5::Spec& spec, const char* dictionary) {
    std::vector<std::string> out(position_.size());
    std::vector<std::string> words;
    std::vector<std::uint32_t> index;
    std::vector<std::vector<std::size_t>> wanted(parts_.size());  // rows of the result, by part
    for (std::size_t i = 0; i < order_.size(); ++i) wanted[order_[i].part].push_back(i);
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      if (wanted[part].empty()) continue;
      const OpenPart& file = parts_.open(part);
      words = file.texts(dictionary);
      index = file.read<std::uint32_t>(group_, spec, file.traces(policy_));
      for (const std::size_t i : wanted[part]) {
        const std::uint32_t word = index[order_[i].row];
        if (word >= words.size()) file.fail(fmt::format("{}/{}: index out of range", group_, spec.name));
        out[i] = words[word];
      }
    }
    return out;
  }

 private:
  template <class T>
  std::vector<T> concatenated(const hdf5::Spec& spec) {
    std::vector<T> all;
    all.reserve(rows_ * spec.width);
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      const OpenPart& file = parts_.open(part);
      const std::uint64_t count = file.traces(policy_);
      if (count == 0) continue;
      const std::vector<T> piece = file.read<T>(group_, spec, count);
      all.insert(all.end(), piece.begin(), piece.end());
    }
    return all;
  }

  Parts& parts_;
  std::string group_, policy_;
  const std::vector<RowRef>& order_;
  std::vector<std::uint64_t> position_;  // of each trace in the concatenated parts
  std::uint64_t rows_ = 0;
};

/// Values that only a damaged or forged file has.
void check_values(const TraceTable& table, std::size_t requirements, const std::filesystem::path& path) {
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (!possible_outcome(table.outcome[i], table.violated[i], requirements)) {
      throw InputError(fmt::format(
          "{}: policy '{}', particle {}: outcome {} with violated requirement {} is not possible", path.string(),
          table.policy, table.particle[i], static_cast<int>(table.outcome[i]), table.violated[i]));
    }
  }
}

const RowRef* find(const std::vector<RowRef>& rows, std::uint32_t particle) {
  const auto at = std::lower_bound(rows.begin(), rows.end(), particle,
                                   [](const RowRef& ref, std::uint32_t id) { return ref.particle < id; });
  return at != rows.end() && at->particle == particle ? &*at : nullptr;
}

}  // namespace

struct Archive::Impl {
  Impl(const std::filesystem::path& from, Seals seals) : path(from), files(open_campaign(from, seals)) {}
  ~Impl() {
    const hdf5::Lock lock;  // closes files
    files.parts = Parts({}, 0, 0);
  }

  const std::vector<RowRef>& rows(const std::string& policy) {
    const auto found = index.find(policy);
    return found != index.end() ? found->second : index.emplace(policy, files.parts.traces(policy)).first->second;
  }

  bool has_policy(const std::string& policy) const {
    const auto& names = files.stored.info.policies;
    return std::find(names.begin(), names.end(), policy) != names.end();
  }

  std::filesystem::path path;
  CampaignFiles files;
  std::map<std::string, std::vector<RowRef>> index;  // by policy
  std::optional<std::vector<RowRef>> particles;
};

Archive::Archive(const std::filesystem::path& path, Seals seals) : impl_(std::make_unique<Impl>(path, seals)) {}
Archive::~Archive() = default;

const std::filesystem::path& Archive::path() const { return impl_->path; }
const CampaignInfo& Archive::info() const { return impl_->files.stored.info; }
bool Archive::complete() const { return impl_->files.stored.complete; }
const std::vector<std::string>& Archive::warnings() const { return impl_->files.warnings; }

TraceTable Archive::traces(const std::string& policy) const {
  const hdf5::Lock lock;
  TraceTable table;
  table.policy = policy;
  const std::size_t requirements = info().requirements.size();
  table.margins.resize(requirements);
  table.first_violations.resize(requirements);
  if (!impl_->has_policy(policy)) return table;
  const std::vector<RowRef>& order = impl_->rows(policy);
  if (order.empty()) return table;
  const Widths widths = widths_of(info());
  TableReader reader(impl_->files.parts, policy, order);
  table.particle = reader.column<std::uint32_t>(schema::particle());
  for (const auto code : reader.column<std::uint8_t>(schema::outcome())) {
    table.outcome.push_back(static_cast<Outcome>(code));
  }
  table.violated = reader.column<std::int32_t>(schema::violated());
  table.end_time = reader.column<double>(schema::end_time());
  table.objective_margin = reader.column<double>(schema::objective_margin());
  if (reader.has(schema::solver())) {
    const std::vector<std::vector<double>> solver = reader.matrix(schema::solver());
    for (std::size_t i = 0; i < table.particle.size(); ++i) {
      table.solver.push_back({solver[0][i], solver[1][i], solver[2][i], solver[3][i]});
    }
  }
  table.margins = reader.matrix(schema::margins(widths));
  table.first_violations = reader.matrix(schema::first_violations(widths));
  table.digest = reader.column<std::uint64_t>(schema::digest());
  table.sequence = reader.texts(schema::sequence(), schema::kSequences);
  table.invalid_reason = reader.texts(schema::invalid_reason(), schema::kReasons);
  check_values(table, requirements, impl_->path);
  return table;
}

std::optional<TraceRecord> Archive::trace(const std::string& policy, std::uint32_t particle) const {
  const hdf5::Lock lock;
  if (!impl_->has_policy(policy)) return std::nullopt;
  const RowRef* ref = find(impl_->rows(policy), particle);
  if (ref == nullptr) return std::nullopt;
  return read_trace(impl_->files.parts.open(ref->part), policy, ref->row, info());
}

OutcomeTable Archive::outcomes(const std::string& policy) const {
  const hdf5::Lock lock;
  OutcomeTable table;
  if (!impl_->has_policy(policy)) return table;
  const std::vector<RowRef>& order = impl_->rows(policy);
  TableReader reader(impl_->files.parts, policy, order);
  for (const RowRef& row : order) table.particle.push_back(row.particle);
  for (const auto code : reader.column<std::uint8_t>(schema::outcome())) {
    table.outcome.push_back(static_cast<Outcome>(code));
  }
  return table;
}

FailureTable Archive::failures(const std::string& policy, const std::function<bool(std::uint32_t)>& wanted) const {
  const hdf5::Lock lock;
  return impl_->has_policy(policy) ? scan_failures(impl_->files.parts, policy, info(), wanted) : FailureTable{};
}

void Archive::visit_outcomes(const std::string& policy,
                             const std::function<void(std::span<const TraceOutcome>)>& take) const {
  const hdf5::Lock lock;
  if (impl_->has_policy(policy)) scan_outcomes(impl_->files.parts, policy, info(), take);
}

std::vector<double> Archive::particle_values(std::uint32_t particle) const {
  const hdf5::Lock lock;
  Parts& parts = impl_->files.parts;
  if (!impl_->particles) impl_->particles = parts.particles();
  const RowRef* ref = find(*impl_->particles, particle);
  if (ref == nullptr) return {};
  const OpenPart& file = parts.open(ref->part);
  const std::uint64_t rows = file.column(schema::kParticles, schema::particle()).rows();
  return file.slice<double>(schema::kParticles, schema::values(widths_of(info())), rows, ref->row, 1);
}

std::vector<std::vector<Event>> Archive::events(const std::string& policy) const {
  const hdf5::Lock lock;
  if (!impl_->has_policy(policy)) return {};
  const std::vector<RowRef>& order = impl_->rows(policy);
  const std::string group = schema::events_group(policy);
  std::vector<std::vector<Event>> out(order.size());
  Parts& parts = impl_->files.parts;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const OpenPart& file = parts.open(part);
    const std::vector<std::uint64_t> offset = file.offsets(group, file.traces(policy));
    if (offset.empty()) continue;
    const std::vector<Event> all = read_events(file, group, {offset.back(), 0, offset.back()}, info());
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (order[i].part != part) continue;
      out[i].assign(all.begin() + static_cast<std::ptrdiff_t>(offset[order[i].row]),
                    all.begin() + static_cast<std::ptrdiff_t>(offset[order[i].row + 1]));
    }
  }
  return out;
}

std::vector<TelemetryFrame> Archive::telemetry(const std::string& policy, std::uint32_t particle) const {
  const hdf5::Lock lock;
  if (!impl_->has_policy(policy)) return {};
  const RowRef* ref = find(impl_->rows(policy), particle);
  if (ref == nullptr) return {};
  const OpenPart& file = impl_->files.parts.open(ref->part);
  const std::string group = schema::telemetry_group(policy);
  const std::vector<std::uint64_t> offset = file.offsets(group, file.traces(policy));
  if (offset.empty()) return {};
  const std::uint64_t first = offset[ref->row], count = offset[ref->row + 1] - first;
  return read_frames(file, group, {offset.back(), first, count}, widths_of(info()));
}

}  // namespace graze
