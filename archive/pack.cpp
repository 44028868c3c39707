// pack(): one file of a campaign directory. Shards are merged in order of particle id, a window of particles at a time:
// memory does not grow with the campaign, but for a bit per particle and a hash per contact sequence.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "archive/archive.h"
#include "archive/directory/campaign_files.h"
#include "archive/files/files.h"
#include "archive/hdf5/file_driver.h"
#include "archive/hdf5/reading_child.h"
#include "archive/hdf5/text_spool.h"
#include "archive/schema/part_check.h"
#include "archive/schema/window.h"

namespace graze {
namespace {

constexpr int kPackedDeflate = 4;
constexpr std::size_t kSegmentBytes = std::size_t{8} << 20;  // of flat rows that are held at a time

using Bytes = std::vector<std::byte>;

/// Rows first … first + count of one column of a part.
Bytes read_rows(const OpenPart& file, const std::string& group, const hdf5::Spec& spec, std::uint64_t first,
                std::uint64_t count) {
  Bytes data(count * spec.row_bytes());
  const hdf5::Column column = file.column(group, spec);
  if (first + count > column.rows()) {
    file.fail(fmt::format("dataset '{}/{}' has {} rows instead of {} or more", group, spec.name, column.rows(),
                          first + count));
  }
  const ReadingNote note(file.path());
  try {
    column.read(first, count, data.data());
  } catch (const hdf5::Error& error) {
    file.fail(error.what());
  }
  return data;
}

/// One column of the packed file, written from its first row to its last.
class Target {
 public:
  Target(const hdf5::Handle& out, const std::string& group, hdf5::Spec spec, std::uint64_t rows, int deflate)
      : spec_(std::move(spec)), column_(hdf5::Column::create(out.id(), group, spec_, rows, deflate)) {}

  const hdf5::Spec& spec() const { return spec_; }
  void begin(std::size_t rows) { buffer_.resize(rows * spec_.row_bytes()); }
  /// Puts `count` rows at a place of what was begun.
  void put(std::size_t place, const std::byte* from, std::size_t count) {
    std::copy_n(from, count * spec_.row_bytes(), buffer_.data() + place * spec_.row_bytes());
  }
  void write(std::size_t rows) {
    column_.write(written_, rows, buffer_.data());
    written_ += rows;
  }

 private:
  hdf5::Spec spec_;
  hdf5::Column column_;
  std::uint64_t written_ = 0;
  Bytes buffer_;
};

/// The plain columns of a group.
class TablePacker {
 public:
  TablePacker(Parts& parts, const hdf5::Handle& out, std::string group, std::uint64_t rows,
              const std::vector<hdf5::Spec>& specs)
      : parts_(parts), group_(std::move(group)) {
    for (const hdf5::Spec& spec : specs) targets_.emplace_back(out, group_, spec, rows, 0);
  }

  void add(const RowWindow& window) {
    for (Target& target : targets_) target.begin(window.rows);
    for (const WindowSlice& slice : window.slices) {
      const OpenPart& file = parts_.open(slice.part);
      for (Target& target : targets_) {
        const Bytes data = read_rows(file, group_, target.spec(), slice.first, slice.place.size());
        for (std::size_t i = 0; i < slice.place.size(); ++i) {
          if (slice.place[i] == WindowSlice::kNowhere) continue;
          target.put(slice.place[i], data.data() + i * target.spec().row_bytes(), 1);
        }
      }
    }
    for (Target& target : targets_) target.write(window.rows);
  }

 private:
  Parts& parts_;
  std::string group_;
  std::vector<Target> targets_;
};

/// An index column, renumbered for the common dictionary. Numbers go by order of particle id, so that they do not
/// depend on how traces were spread over shards.
class IndexPacker {
 public:
  IndexPacker(Parts& parts, const hdf5::Handle& out, std::string group, const hdf5::Spec& spec, std::uint64_t rows,
              const char* path, TextSpool& dictionary)
      : parts_(parts),
        group_(std::move(group)),
        path_(path),
        target_(out, group_, spec, rows, 0),
        dictionary_(dictionary) {}

  void add(const RowWindow& window) {
    std::vector<std::string> texts(window.rows);
    for (const WindowSlice& slice : window.slices) {
      const OpenPart& file = parts_.open(slice.part);
      const Bytes data = read_rows(file, group_, target_.spec(), slice.first, slice.place.size());
      const std::vector<std::string> words = file.texts(path_);
      for (std::size_t i = 0; i < slice.place.size(); ++i) {
        std::uint32_t word = 0;
        std::memcpy(&word, data.data() + i * sizeof word, sizeof word);
        if (word >= words.size()) file.fail(fmt::format("'{}/{}': index out of range", group_, target_.spec().name));
        if (slice.place[i] != WindowSlice::kNowhere) texts[slice.place[i]] = words[word];
      }
    }
    target_.begin(window.rows);
    for (std::size_t place = 0; place < window.rows; ++place) {
      const std::uint32_t number = dictionary_.number(texts[place]);
      target_.put(place, reinterpret_cast<const std::byte*>(&number), 1);
    }
    target_.write(window.rows);
  }

 private:
  Parts& parts_;
  std::string group_;
  const char* path_;
  Target target_;
  TextSpool& dictionary_;
};

/// The flat rows of each trace (events, frames), and their offsets.
class FlatPacker {
 public:
  FlatPacker(Parts& parts, const hdf5::Handle& out, std::string group, std::string policy, std::uint64_t traces,
             std::uint64_t rows, const std::vector<hdf5::Spec>& specs)
      : parts_(parts),
        group_(std::move(group)),
        policy_(std::move(policy)),
        offset_(out, group_, schema::offset(), traces + 1, kPackedDeflate) {
    for (const hdf5::Spec& spec : specs) {
      targets_.emplace_back(out, group_, spec, rows, kPackedDeflate);
      widest_ = std::max(widest_, spec.row_bytes());
    }
    write_offsets({0});
  }

  void add(const RowWindow& window) {
    std::vector<std::vector<std::uint64_t>> offsets;  // [slice][row + 1], empty: no flat rows
    std::vector<std::uint64_t> begin(window.rows + 1);
    for (const WindowSlice& slice : window.slices) {
      const OpenPart& file = parts_.open(slice.part);
      offsets.push_back(file.offsets(group_, file.traces(policy_)));
      for (std::size_t i = 0; i < slice.place.size() && !offsets.back().empty(); ++i) {
        if (slice.place[i] == WindowSlice::kNowhere) continue;
        begin[slice.place[i] + 1] = offsets.back()[slice.first + i + 1] - offsets.back()[slice.first + i];
      }
    }
    std::vector<std::uint64_t> ends(window.rows);
    for (std::size_t i = 0; i < window.rows; ++i) {
      begin[i + 1] += begin[i];
      ends[i] = written_ + begin[i + 1];
    }
    for (std::size_t first = 0, last = 0; first < window.rows; first = last) {
      last = first + 1;
      while (last < window.rows && (begin[last + 1] - begin[first]) * widest_ <= kSegmentBytes) ++last;
      add_segment(window, offsets, begin, first, last);
    }
    write_offsets(ends);
    written_ += begin.back();
  }

 private:
  /// The flat rows of the traces at places first … last - 1: in each part, neighbours.
  void add_segment(const RowWindow& window, const std::vector<std::vector<std::uint64_t>>& offsets,
                   const std::vector<std::uint64_t>& begin, std::size_t first, std::size_t last) {
    const std::uint64_t rows = begin[last] - begin[first];
    if (rows == 0) return;
    for (Target& target : targets_) target.begin(rows);
    for (std::size_t s = 0; s < window.slices.size(); ++s) {
      const WindowSlice& slice = window.slices[s];
      if (offsets[s].empty()) continue;
      std::vector<std::size_t> inside;  // rows of the slice
      for (std::size_t i = 0; i < slice.place.size(); ++i) {
        if (slice.place[i] != WindowSlice::kNowhere && slice.place[i] >= first && slice.place[i] < last) {
          inside.push_back(i);
        }
      }
      if (inside.empty()) continue;
      const std::uint64_t* offset = offsets[s].data() + slice.first;
      const std::uint64_t from = offset[inside.front()], count = offset[inside.back() + 1] - from;
      if (count == 0) continue;
      const OpenPart& file = parts_.open(slice.part);
      for (Target& target : targets_) {
        const Bytes data = read_rows(file, group_, target.spec(), from, count);
        for (const std::size_t i : inside) {
          target.put(begin[slice.place[i]] - begin[first], data.data() + (offset[i] - from) * target.spec().row_bytes(),
                     offset[i + 1] - offset[i]);
        }
      }
    }
    for (Target& target : targets_) target.write(rows);
  }

  void write_offsets(const std::vector<std::uint64_t>& values) {
    offset_.begin(values.size());
    offset_.put(0, reinterpret_cast<const std::byte*>(values.data()), values.size());
    offset_.write(values.size());
  }

  Parts& parts_;
  std::string group_, policy_;
  Target offset_;
  std::vector<Target> targets_;
  std::size_t widest_ = 1;     // bytes of a row
  std::uint64_t written_ = 0;  // rows
};

class Packer {
 public:
  Packer(CampaignFiles& files, const hdf5::Handle& out, const std::filesystem::path& path)
      : parts_(files.parts),
        info_(files.stored.info),
        widths_(widths_of(info_)),
        out_(out),
        sequences_(path),
        reasons_(path) {}

  void pack() {
    for (const std::string& policy : info_.policies) pack_policy(policy);
    sequences_.write(out_, schema::kSequences);
    reasons_.write(out_, schema::kReasons);
    pack_particles();
  }

 private:
  void pack_policy(const std::string& policy) {
    const std::string group = schema::traces_group(policy);
    const std::vector<std::string> flat = {schema::events_group(policy), schema::phases_group(policy),
                                           schema::telemetry_group(policy)};
    const std::vector<std::vector<hdf5::Spec>> columns = {schema::events(), schema::phases(),
                                                          schema::telemetry(widths_)};
    WindowWalk walk(parts_, group, policy, flat);
    const std::uint64_t rows = walk.rows();
    if (rows == 0) return;
    TablePacker table(parts_, out_, group, rows, trace_columns(policy));
    IndexPacker sequence(parts_, out_, group, schema::sequence(), rows, schema::kSequences, sequences_);
    IndexPacker reason(parts_, out_, group, schema::invalid_reason(), rows, schema::kReasons, reasons_);
    std::vector<FlatPacker> flats;
    for (std::size_t i = 0; i < flat.size(); ++i) {
      if (walk.flat_rows(i) == 0) continue;
      flats.emplace_back(parts_, out_, flat[i], policy, rows, walk.flat_rows(i), columns[i]);
    }
    while (const std::optional<RowWindow> window = walk.next()) {
      table.add(*window);
      sequence.add(*window);
      reason.add(*window);
      for (FlatPacker& one : flats) one.add(*window);
    }
  }

  std::vector<hdf5::Spec> trace_columns(const std::string& policy) {
    std::vector<hdf5::Spec> specs = {schema::particle(),         schema::outcome(),
                                     schema::violated(),         schema::end_time(),
                                     schema::objective_margin(), schema::digest(),
                                     schema::margins(widths_),   schema::first_violations(widths_),
                                     schema::final_q(widths_),   schema::final_v(widths_)};
    for (const hdf5::Spec& later : {schema::solver(), schema::convergence(), schema::margin_parts(widths_),
                                    schema::violation_parts(widths_), schema::objective_culprit()}) {
      if (everywhere(schema::traces_group(policy) + "/" + later.name, policy)) specs.push_back(later);
    }
    return specs;
  }

  /// Whether all parts with traces of the policy have a dataset that older ones lack.
  bool everywhere(const std::string& dataset, const std::string& policy) {
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      const OpenPart& file = parts_.open(part);
      if (file.traces(policy) > 0 && !file.has(dataset)) return false;
    }
    return true;
  }

  void pack_particles() {
    WindowWalk walk(parts_, schema::kParticles, "", {});
    if (walk.rows() == 0) return;
    TablePacker table(parts_, out_, schema::kParticles, walk.rows(), {schema::particle(), schema::values(widths_)});
    while (const std::optional<RowWindow> window = walk.next()) table.add(*window);
  }

  Parts& parts_;
  const CampaignInfo& info_;
  const Widths widths_;
  const hdf5::Handle& out_;
  TextSpool sequences_, reasons_;
};

std::vector<std::string> pack_files(CampaignFiles files, const std::filesystem::path& file, bool force,
                                    PackedContent content) {
  publish_hdf5(file, force, [&](const hdf5::Handle& out) {
    // What `graze verify` would call damaged is not made whole by a new seal.
    for (std::size_t part = 0; content == PackedContent::checked && part < files.parts.size(); ++part) {
      check_part(files.parts.open(part), files.stored.info);
    }
    // Nor is a campaign called complete whose traces have been lost since.
    if (content == PackedContent::checked && files.stored.complete) {
      files.stored.complete = holds_all(files.parts, files.stored.info);
    }
    write_info(out, files.stored.info, Layout::packed, files.stored.complete);
    Packer(files, out, file).pack();
  });
  const hdf5::Lock lock;  // closes the shards
  files.parts = Parts({}, {}, 0);
  return std::move(files.warnings);
}

}  // namespace

std::vector<std::string> pack(const std::filesystem::path& directory, const std::filesystem::path& file, bool force,
                              PackedContent content) {
  CampaignFiles files = open_campaign(directory);
  if (files.stored.layout == Layout::packed) {
    throw InputError(fmt::format("{}: is one file already; give a campaign directory", directory.string()));
  }
  check_new_file(file, force, {directory});
  if (files.stored.info.part.end > 0) files = open_parts({directory});  // of the whole, however little is there
  return pack_files(std::move(files), file, force, content);
}

std::vector<std::string> pack(const std::vector<std::filesystem::path>& directories, const std::filesystem::path& file,
                              bool force) {
  check_new_file(file, force, directories);
  return pack_files(open_parts(directories), file, force, PackedContent::checked);
}

}  // namespace graze
