// Datasets of files that may be anybody's: what hdf5.h refuses before it reads. Nothing outside the file is opened, and
// no more memory is taken than the file can fill.
#include <fmt/format.h>

#include <algorithm>

#include "archive/hdf5/hdf5.h"

namespace graze::hdf5 {
namespace {

/// Deflate makes at most so many bytes of one (zlib's documentation).
constexpr std::uint64_t kLargestInflation = 1032;
/// A chunk is read whole whatever is wanted of it: four times what is written (column.cpp), HDF5's chunk cache.
constexpr std::uint64_t kLargestChunk = std::uint64_t{1} << 20;

Handle creation_of(hid_t dataset, const std::string& path) {
  return Handle(H5Dget_create_plist(dataset), H5Pclose, path);
}

/// Shuffle and deflate, each once at most, are what every HDF5 has; more of them would inflate beyond any bound.
bool known_filters(const Handle& creation, bool* deflated) {
  int shuffles = 0, deflates = 0, others = 0;
  const int filters = H5Pget_nfilters(creation.id());
  for (int i = 0; i < filters; ++i) {
    unsigned flags = 0, config = 0;
    std::size_t values = 0;
    const H5Z_filter_t filter =
        H5Pget_filter2(creation.id(), static_cast<unsigned>(i), &flags, &values, nullptr, 0, nullptr, &config);
    ++(filter == H5Z_FILTER_DEFLATE ? deflates : filter == H5Z_FILTER_SHUFFLE ? shuffles : others);
  }
  *deflated = deflates > 0;
  return filters >= 0 && others == 0 && shuffles <= 1 && deflates <= 1;
}

void check_chunks(const Handle& list, const std::string& path, std::size_t value_bytes) {
  hsize_t chunk[2] = {1, 1};
  if (H5Pget_chunk(list.id(), 2, chunk) < 1) throw Error(fmt::format("dataset '{}' has no chunks of rows", path));
  const std::uint64_t rows = chunk[0], row_bytes = std::max<std::uint64_t>(1, chunk[1] * value_bytes);
  if (rows <= std::max<std::uint64_t>(1, kLargestChunk / row_bytes)) return;
  throw Error(fmt::format("dataset '{}' has chunks of {} rows of {} bytes; a chunk is at most {} bytes or one row",
                          path, rows, row_bytes, kLargestChunk));
}

/// To be called before anything is asked about the dataset's space: of a virtual one HDF5 opens the sources then.
void check_storage(hid_t dataset, const std::string& path) {
  const Handle list = creation_of(dataset, path);
  const H5D_layout_t layout = H5Pget_layout(list.id());
  bool deflated = false;
  const char* why = layout != H5D_CONTIGUOUS && layout != H5D_CHUNKED && layout != H5D_COMPACT
                        ? "it is virtual: its data lie in other datasets"
                    : H5Pget_external_count(list.id()) != 0 ? "its data lie in another file"
                    : !known_filters(list, &deflated)       ? "its filters are not shuffle and deflate, once each"
                                                            : nullptr;
  if (why != nullptr) throw Error(fmt::format("dataset '{}' is stored in an unexpected way: {}", path, why));
  const Handle type(H5Dget_type(dataset), H5Tclose, path);
  if (H5Tcommitted(type.id()) > 0) {
    throw Error(fmt::format("dataset '{}' has a committed type; an archive's datasets have types of their own", path));
  }
  if (layout == H5D_CHUNKED) check_chunks(list, path, H5Tget_size(type.id()));
}

}  // namespace

Handle open_dataset(hid_t parent, const std::string& path) {
  if (!exists(parent, path)) throw Error("dataset '" + path + "' is missing");
  Handle dataset(H5Dopen2(parent, path.c_str(), H5P_DEFAULT), H5Dclose, path);
  check_storage(dataset.id(), path);
  return dataset;
}

void check_size(const Handle& dataset, const std::string& path, std::uint64_t rows, std::uint64_t row_bytes,
                std::uint64_t file_bytes) {
  if (rows == 0 || row_bytes == 0) return;
  const std::uint64_t stored = std::min<std::uint64_t>(H5Dget_storage_size(dataset.id()), file_bytes);
  if (stored == 0 && H5Eget_num(H5E_DEFAULT) > 0) check(-1, path);  // its one way to say that it failed
  if (rows <= stored / row_bytes) return;                           // plain, and whole
  bool deflated = false;
  known_filters(creation_of(dataset.id(), path), &deflated);
  const std::uint64_t most = deflated ? stored * kLargestInflation : stored;
  if (rows <= most / row_bytes) return;
  throw Error(
      fmt::format("dataset '{}' claims more rows than the file can hold: {} of {} bytes, of which {} bytes are "
                  "stored{}",
                  path, rows, row_bytes, stored,
                  deflated ? fmt::format(" (deflate makes at most {} bytes of one)", kLargestInflation) : ""));
}

}  // namespace graze::hdf5
