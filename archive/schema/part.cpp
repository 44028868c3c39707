#include "archive/schema/part.h"

#include <fmt/format.h>

#include <algorithm>

#include "archive/hdf5/reading_child.h"

namespace graze {
namespace {

constexpr std::size_t kOpenParts = 64;  // well below the usual limit of 1024 descriptors

struct DigestRef {
  RowRef ref;
  std::uint64_t digest;
};

}  // namespace

OpenPart::OpenPart(std::filesystem::path path, const Descriptor& descriptor) : path_(std::move(path)) {
  guarded([&] {
    file_ = hdf5::open_for_reading(descriptor.number());
    hsize_t bytes = 0;
    hdf5::check(H5Fget_filesize(file_.id(), &bytes), "file size");
    bytes_ = bytes;
  });
}

void OpenPart::fail(const std::string& what) const { throw InputError(fmt::format("{}: {}", path_.string(), what)); }

void OpenPart::guarded(const std::function<void()>& act) const {
  const ReadingNote note(path_);
  try {
    act();
  } catch (const hdf5::Error& error) {
    fail(error.what());
  }
}

void OpenPart::check_tree() const {
  guarded([&] { hdf5::check_tree(file_); });
}

bool OpenPart::has(const std::string& group) const {
  bool found = false;
  guarded([&] { found = hdf5::exists(file_.id(), group); });
  return found;
}

hdf5::Column OpenPart::column(const std::string& group, const hdf5::Spec& spec) const {
  std::optional<hdf5::Column> column;
  guarded([&] { column = hdf5::Column::open(file_.id(), group, spec, bytes_); });
  return std::move(*column);
}

hdf5::Column OpenPart::column(const std::string& group, const hdf5::Spec& spec, std::uint64_t rows) const {
  hdf5::Column found = column(group, spec);
  if (found.rows() != rows) {
    fail(fmt::format("dataset '{}/{}' has {} rows instead of {}", group, spec.name, found.rows(), rows));
  }
  return found;
}

const hdf5::Column& OpenPart::kept(const std::string& group, const hdf5::Spec& spec, std::uint64_t rows) const {
  constexpr std::size_t kKept = 16;  // the widest table, of traces, has 13
  const std::string path = group + "/" + spec.name;
  if (const auto found = kept_.find(path); found != kept_.end() && found->second.rows() == rows) return found->second;
  if (kept_.size() >= kKept) kept_.clear();
  return kept_.insert_or_assign(path, column(group, spec, rows)).first->second;
}

std::uint64_t OpenPart::traces(const std::string& policy) const {
  const std::string group = schema::traces_group(policy);
  return has(group) ? column(group, schema::particle()).rows() : 0;
}

std::vector<std::uint64_t> OpenPart::offsets(const std::string& group, std::uint64_t traces) const {
  if (!has(group)) return {};
  std::vector<std::uint64_t> offset = read<std::uint64_t>(group, schema::offset(), traces + 1);
  if (offset.front() != 0 || !std::is_sorted(offset.begin(), offset.end()) ||
      offset.back() != column(group, has(group + "/time") ? schema::time() : schema::begin()).rows()) {
    fail(fmt::format("dataset '{}/offset' does not divide its table", group));
  }
  return offset;
}

std::vector<std::string> OpenPart::texts(const char* path) const {
  std::vector<std::string> texts;
  guarded([&] { texts = hdf5::read_strings(file_.id(), path); });
  return texts;
}

void fail_two_ways(const OpenPart& file, std::uint32_t particle, const std::string& policy, const std::string& other) {
  file.fail(
      fmt::format("particle {} of policy '{}' went another way here than in {}; these shards are not of one campaign: "
                  "move the one that is not of this out of the directory, and 'graze resume' simulates what is missing",
                  particle, policy, other));
}

std::shared_ptr<OpenPart> Parts::hold(std::size_t part) {
  if (!open_[part]) {
    if (opened_ == kOpenParts) {
      for (auto& one : open_) one.reset();
      opened_ = 0;
    }
    open_[part] = std::make_shared<OpenPart>(files_[part], open_archive_file(files_[part], inner_));
    ++opened_;
  }
  return open_[part];
}

std::vector<RowRef> Parts::traces(const std::string& policy) {
  std::vector<DigestRef> rows;
  const std::string group = schema::traces_group(policy);
  for (std::size_t part = 0; part < size(); ++part) {
    const OpenPart& file = open(part);
    const std::uint64_t count = file.traces(policy);
    if (count == 0) continue;
    const auto particle = file.read<std::uint32_t>(group, schema::particle(), count);
    const auto digest = file.read<std::uint64_t>(group, schema::digest(), count);
    for (std::uint64_t row = 0; row < count; ++row) {
      if (!counts(particle[row])) continue;
      rows.push_back({{particle[row], static_cast<std::uint32_t>(part), row}, digest[row]});
    }
  }
  std::stable_sort(rows.begin(), rows.end(),
                   [](const DigestRef& a, const DigestRef& b) { return a.ref.particle < b.ref.particle; });
  std::vector<RowRef> unique;
  unique.reserve(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i == 0 || rows[i].ref.particle != rows[i - 1].ref.particle) {
      unique.push_back(rows[i].ref);
    } else if (rows[i].digest != rows[i - 1].digest) {
      fail_two_ways(open(rows[i].ref.part), rows[i].ref.particle, policy, files_[rows[i - 1].ref.part].string());
    }
  }
  return unique;
}

std::vector<RowRef> Parts::particles() {
  std::vector<RowRef> rows;
  for (std::size_t part = 0; part < size(); ++part) {
    const OpenPart& file = open(part);
    if (!file.has(schema::kParticles)) continue;
    const std::uint64_t count = file.column(schema::kParticles, schema::particle()).rows();
    const auto particle = file.read<std::uint32_t>(schema::kParticles, schema::particle(), count);
    for (std::uint64_t row = 0; row < count; ++row) {
      if (!counts(particle[row])) continue;
      rows.push_back({particle[row], static_cast<std::uint32_t>(part), row});
    }
  }
  std::stable_sort(rows.begin(), rows.end(), [](const RowRef& a, const RowRef& b) { return a.particle < b.particle; });
  const auto same = [](const RowRef& a, const RowRef& b) { return a.particle == b.particle; };
  rows.erase(std::unique(rows.begin(), rows.end(), same), rows.end());
  return rows;
}

}  // namespace graze
