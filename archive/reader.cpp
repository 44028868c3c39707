// Archive: reads campaigns.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "archive/archive.h"
#include "archive/directory/campaign_files.h"
#include "archive/schema/part_rows.h"
#include "archive/schema/trace_scan.h"

namespace graze {
namespace {

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
    files.parts = Parts({}, {}, 0);
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
  std::optional<bool> complete;  // once it was asked
};

Archive::Archive(const std::filesystem::path& path, Seals seals) : impl_(std::make_unique<Impl>(path, seals)) {}
Archive::~Archive() = default;

const std::filesystem::path& Archive::path() const { return impl_->path; }
const CampaignInfo& Archive::info() const { return impl_->files.stored.info; }

bool Archive::complete() const {
  // What the description says is no proof: shards may have been lost since.
  if (!impl_->complete) {
    const hdf5::Lock lock;
    impl_->complete = impl_->files.stored.complete && holds_all(impl_->files.parts, info());
  }
  return *impl_->complete;
}

const std::vector<std::string>& Archive::warnings() const { return impl_->files.warnings; }

std::optional<TraceRecord> Archive::trace(const std::string& policy, std::uint32_t particle) const {
  const hdf5::Lock lock;
  if (!impl_->has_policy(policy)) return std::nullopt;
  const RowRef* ref = find(impl_->rows(policy), particle);
  if (ref == nullptr) return std::nullopt;
  return read_trace(impl_->files.parts.open(ref->part), policy, ref->row, info());
}

void Archive::scan(const std::string& policy, unsigned columns, const std::function<void(const TraceRows&)>& take,
                   const TraceFilter& wanted) const {
  const hdf5::Lock lock;
  if (impl_->has_policy(policy)) scan_traces(impl_->files.parts, policy, info(), columns, take, wanted);
}

void Archive::scan_values(const std::function<void(std::uint32_t, std::span<const double>)>& take) const {
  const hdf5::Lock lock;
  graze::scan_values(impl_->files.parts, info(), take);
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
