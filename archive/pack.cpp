// pack(): one file of a campaign directory. Tables of a few columns are held in memory; everything else is copied in
// pieces, in order of particle id.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <unordered_map>

#include "archive/archive.h"
#include "archive/campaign_files.h"
#include "archive/file_driver.h"

namespace graze {
namespace {

constexpr int kDeflate = 4;
constexpr std::size_t kPieceBytes = std::size_t{4} << 20;
constexpr std::size_t kOpenColumns = 32;

/// Consecutive rows of one part.
struct Run {
  std::uint32_t part;
  std::uint64_t first, count;
};

void add_run(std::vector<Run>& runs, const Run& run) {
  if (run.count == 0) return;
  if (!runs.empty() && runs.back().part == run.part && runs.back().first + runs.back().count == run.first) {
    runs.back().count += run.count;
  } else {
    runs.push_back(run);
  }
}

std::vector<Run> runs_of(const std::vector<RowRef>& rows) {
  std::vector<Run> runs;
  for (const RowRef& ref : rows) add_run(runs, {ref.part, ref.row, 1});
  return runs;
}

std::uint64_t rows_of(const std::vector<Run>& runs) {
  std::uint64_t rows = 0;
  for (const Run& run : runs) rows += run.count;
  return rows;
}

/// Copies one dataset, run after run, by way of a buffer of kPieceBytes.
class ColumnCopier {
 public:
  ColumnCopier(Parts& parts, const hdf5::Handle& out, std::string group, hdf5::Spec spec, int deflate,
               std::uint64_t rows)
      : parts_(parts),
        group_(std::move(group)),
        spec_(std::move(spec)),
        target_(hdf5::Column::create(out.id(), group_, spec_, rows, deflate)),
        capacity_(std::max<std::size_t>(1, kPieceBytes / std::max<std::size_t>(1, spec_.row_bytes()))) {
    buffer_.resize(capacity_ * spec_.row_bytes());
  }

  void copy(const std::vector<Run>& runs) {
    for (const Run& run : runs) {
      for (std::uint64_t done = 0; done < run.count;) {
        const std::uint64_t count = std::min<std::uint64_t>(run.count - done, capacity_ - held_);
        read(run.part, run.first + done, count);
        held_ += count;
        done += count;
        if (held_ == capacity_) flush();
      }
    }
    flush();
  }

 private:
  void read(std::uint32_t part, std::uint64_t first, std::uint64_t count) {
    const hdf5::Column& from = source(part);
    try {
      from.read(first, count, buffer_.data() + held_ * spec_.row_bytes());
    } catch (const hdf5::Error& error) {
      parts_.open(part).fail(error.what());
    }
  }

  const hdf5::Column& source(std::uint32_t part) {
    const auto found = sources_.find(part);
    if (found != sources_.end()) return found->second;
    if (sources_.size() == kOpenColumns) sources_.clear();
    return sources_.emplace(part, parts_.open(part).column(group_, spec_)).first->second;
  }

  void flush() {
    target_.write(written_, held_, buffer_.data());
    written_ += held_;
    held_ = 0;
  }

  Parts& parts_;
  std::string group_;
  hdf5::Spec spec_;
  hdf5::Column target_;
  std::uint64_t capacity_;  // rows
  std::uint64_t held_ = 0, written_ = 0;
  std::vector<std::byte> buffer_;
  std::map<std::uint32_t, hdf5::Column> sources_;
};

/// One dictionary of the packed file; numbered in order of first appearance.
class Dictionary {
 public:
  explicit Dictionary(const char* path) : path_(path) {}

  const char* path() const { return path_; }
  std::uint32_t number(const std::string& text) {
    const auto [entry, fresh] = numbers_.emplace(text, static_cast<std::uint32_t>(texts_.size()));
    if (fresh) texts_.push_back(text);
    return entry->second;
  }
  void write(const hdf5::Handle& file) const { hdf5::write_strings(file.id(), path_, texts_); }

 private:
  const char* path_;
  std::unordered_map<std::string, std::uint32_t> numbers_;  // only looked up, never walked through
  std::vector<std::string> texts_;
};

class Packer {
 public:
  Packer(CampaignFiles& files, const hdf5::Handle& out)
      : parts_(files.parts), info_(files.stored.info), widths_(widths_of(info_)), out_(out) {}

  void pack() {
    for (const std::string& policy : info_.policies) {
      const std::vector<RowRef> rows = parts_.traces(policy);
      if (rows.empty()) continue;
      pack_traces(policy, rows);
      pack_flat(schema::events_group(policy), policy, rows, schema::events());
      pack_flat(schema::telemetry_group(policy), policy, rows, schema::telemetry(widths_));
    }
    sequences_.write(out_);
    reasons_.write(out_);
    pack_particles();
  }

 private:
  void pack_traces(const std::string& policy, const std::vector<RowRef>& rows) {
    const std::string group = schema::traces_group(policy);
    const std::vector<Run> runs = runs_of(rows);
    for (const hdf5::Spec& spec :
         {schema::particle(), schema::outcome(), schema::violated(), schema::end_time(), schema::objective_margin(),
          schema::digest(), schema::margins(widths_), schema::first_violations(widths_), schema::final_q(widths_),
          schema::final_v(widths_), schema::solver()}) {
      if (spec.name == schema::solver().name && !everywhere(group + "/" + spec.name, policy)) continue;
      ColumnCopier(parts_, out_, group, spec, 0, rows.size()).copy(runs);
    }
    pack_texts(group, schema::sequence(), policy, rows, sequences_);
    pack_texts(group, schema::invalid_reason(), policy, rows, reasons_);
  }

  /// Whether all parts with traces of the policy have a dataset that older ones lack.
  bool everywhere(const std::string& dataset, const std::string& policy) {
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      const OpenPart& file = parts_.open(part);
      if (file.traces(policy) > 0 && !file.has(dataset)) return false;
    }
    return true;
  }

  /// An index column in the order of `rows`, renumbered for the common dictionary. Numbers go by order of particle id,
  /// so that they do not depend on how traces were spread over shards.
  void pack_texts(const std::string& group, const hdf5::Spec& spec, const std::string& policy,
                  const std::vector<RowRef>& rows, Dictionary& dictionary) {
    std::vector<std::vector<std::size_t>> by_part(parts_.size());
    for (std::size_t i = 0; i < rows.size(); ++i) by_part[rows[i].part].push_back(i);
    std::vector<std::uint32_t> index(rows.size());
    std::vector<std::vector<std::string>> texts(parts_.size());
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      if (by_part[part].empty()) continue;
      const OpenPart& file = parts_.open(part);
      const auto local = file.read<std::uint32_t>(group, spec, file.traces(policy));
      texts[part] = file.texts(dictionary.path());
      for (const std::size_t i : by_part[part]) {
        index[i] = local[rows[i].row];
        if (index[i] >= texts[part].size()) file.fail(fmt::format("'{}/{}': index out of range", group, spec.name));
      }
    }
    for (std::size_t i = 0; i < rows.size(); ++i) index[i] = dictionary.number(texts[rows[i].part][index[i]]);
    hdf5::write_column(out_.id(), group, spec, index, 0);
  }

  /// The flat rows of each trace, and their offsets.
  void pack_flat(const std::string& group, const std::string& policy, const std::vector<RowRef>& rows,
                 const std::vector<hdf5::Spec>& columns) {
    std::vector<std::vector<std::uint64_t>> offsets(parts_.size());
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      const OpenPart& file = parts_.open(part);
      offsets[part] = file.offsets(group, file.traces(policy));
    }
    std::vector<Run> runs;
    std::vector<std::uint64_t> offset = {0};
    for (const RowRef& ref : rows) {
      const auto& source = offsets[ref.part];
      const std::uint64_t count = source.empty() ? 0 : source[ref.row + 1] - source[ref.row];
      if (count > 0) add_run(runs, {ref.part, source[ref.row], count});
      offset.push_back(offset.back() + count);
    }
    if (offset.back() == 0) return;
    hdf5::write_column(out_.id(), group, schema::offset(), offset, kDeflate);
    for (const hdf5::Spec& spec : columns) {
      ColumnCopier(parts_, out_, group, spec, kDeflate, offset.back()).copy(runs);
    }
  }

  void pack_particles() {
    const std::vector<Run> runs = runs_of(parts_.particles());
    if (runs.empty()) return;
    for (const hdf5::Spec& spec : {schema::particle(), schema::values(widths_)}) {
      ColumnCopier(parts_, out_, schema::kParticles, spec, 0, rows_of(runs)).copy(runs);
    }
  }

  Parts& parts_;
  const CampaignInfo& info_;
  const Widths widths_;
  const hdf5::Handle& out_;
  Dictionary sequences_{schema::kSequences}, reasons_{schema::kReasons};
};

void pack_files(CampaignFiles files, const std::filesystem::path& file, bool force) {
  if (!force && std::filesystem::exists(file)) {
    throw InputError(fmt::format("{}: exists already; choose another --output or give --force", file.string()));
  }
  publish_hdf5(file, [&](const hdf5::Handle& out) {
    write_info(out, files.stored.info, Layout::packed, files.stored.complete);
    Packer(files, out).pack();
  });
  const hdf5::Lock lock;  // closes the shards
  files.parts = Parts({}, 0);
}

}  // namespace

void pack(const std::filesystem::path& directory, const std::filesystem::path& file, bool force) {
  CampaignFiles files = open_campaign(directory);
  if (files.stored.layout == Layout::packed) {
    throw InputError(fmt::format("{}: is one file already; give a campaign directory", directory.string()));
  }
  pack_files(std::move(files), file, force);
}

void pack(const std::vector<std::filesystem::path>& directories, const std::filesystem::path& file, bool force) {
  pack_files(open_parts(directories), file, force);
}

}  // namespace graze
