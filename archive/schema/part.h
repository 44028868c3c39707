#pragma once
// A part of a campaign: a file with traces (a shard, or the packed file), opened when it is needed. What is read is
// checked: columns of a table are equally long, offsets rise and end where their table ends, indices are in range.

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "archive/files/directory.h"
#include "archive/hdf5/hdf5.h"
#include "archive/schema/campaign_info.h"
#include "archive/schema/schema.h"

namespace graze {

/// An open part. All methods throw InputError that names the file, and need the library's lock.
class OpenPart {
 public:
  /// `path` is for messages.
  OpenPart(std::filesystem::path path, const Descriptor& descriptor);
  const std::filesystem::path& path() const { return path_; }
  const hdf5::Handle& file() const { return file_; }

  /// Throws unless the file is made of groups and datasets as an archive is (hdf5::check_tree).
  void check_tree() const;
  /// True if the group is there.
  bool has(const std::string& group) const;
  /// A dataset with so many rows.
  hdf5::Column column(const std::string& group, const hdf5::Spec& spec, std::uint64_t rows) const;
  /// A dataset with as many rows as it has.
  hdf5::Column column(const std::string& group, const hdf5::Spec& spec) const;
  template <class T>
  std::vector<T> read(const std::string& group, const hdf5::Spec& spec, std::uint64_t rows) const {
    return slice<T>(group, spec, rows, 0, rows);
  }
  /// Rows first … first + count of a dataset that has `rows`.
  template <class T>
  std::vector<T> slice(const std::string& group, const hdf5::Spec& spec, std::uint64_t rows, std::uint64_t first,
                       std::uint64_t count) const {
    std::optional<hdf5::Column> opened;
    const hdf5::Column& source = keeps_columns_ ? kept(group, spec, rows) : opened.emplace(column(group, spec, rows));
    std::vector<T> data(count * spec.width);
    guarded([&] { source.read(first, count, data.data()); });
    return data;
  }
  /// From now on the datasets that slice() read last stay open, with the chunk that HDF5 holds of each: a reader of a
  /// table a piece at a time has each chunk inflated once, not once for each of its pieces. Takes 1 MiB for each.
  void keep_columns() { keeps_columns_ = true; }
  /// Traces of a policy; 0 if it has none here.
  std::uint64_t traces(const std::string& policy) const;
  /// Where the flat rows of each of `traces` traces begin, and where the last end; empty if the group is not there.
  std::vector<std::uint64_t> offsets(const std::string& group, std::uint64_t traces) const;
  std::vector<std::string> texts(const char* path) const;

  [[noreturn]] void fail(const std::string& what) const;

 private:
  void guarded(const std::function<void()>& act) const;
  std::filesystem::path path_;
  hdf5::Handle file_;
  const hdf5::Column& kept(const std::string& group, const hdf5::Spec& spec, std::uint64_t rows) const;
  std::uint64_t bytes_ = 0;
  bool keeps_columns_ = false;
  mutable std::map<std::string, hdf5::Column> kept_;  // by path
};

/// Ids of the traces that count: those that a directory is about (graze run --part), or all that the campaign has.
inline ParticleRange counting(const CampaignInfo& info) {
  return info.part.end > 0 ? info.part : ParticleRange{0, info.particles};
}

/// Where one row lies.
struct RowRef {
  std::uint32_t particle, part;
  std::uint64_t row;
};

/// Throws InputError: a particle stands in two parts with different digests.
[[noreturn]] void fail_two_ways(const OpenPart& file, std::uint32_t particle, const std::string& policy,
                                const std::string& other);

/// All parts of a campaign. Keeps a few of them open. Needs the library's lock.
class Parts {
 public:
  /// `counting`: rows of particles that lie not within are passed over.
  /// `inner`: so many of each path's last names are within a campaign directory (open_archive_file).
  Parts(std::vector<std::filesystem::path> files, ParticleRange counting, int inner)
      : files_(std::move(files)), open_(files_.size()), counting_(counting), inner_(inner) {}
  std::size_t size() const { return files_.size(); }
  /// Open until one that is not open yet is asked for.
  OpenPart& open(std::size_t part) { return *hold(part); }
  /// The same, open as long as it is held.
  std::shared_ptr<OpenPart> hold(std::size_t part);
  const std::filesystem::path& path(std::size_t part) const { return files_[part]; }
  const ParticleRange& counting() const { return counting_; }
  bool counts(std::uint64_t particle) const { return particle >= counting_.begin && particle < counting_.end; }

  /// The traces of a policy in order of particle id. A particle that stands in two parts counts once; throws InputError
  /// if its digests differ.
  std::vector<RowRef> traces(const std::string& policy);
  /// The rows of /particles in order of id, each id once.
  std::vector<RowRef> particles();

 private:
  std::vector<std::filesystem::path> files_;
  std::vector<std::shared_ptr<OpenPart>> open_;
  std::size_t opened_ = 0;
  ParticleRange counting_;
  int inner_;
};

}  // namespace graze
