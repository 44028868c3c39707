// Typed columns of hdf5.h.

#include <algorithm>
#include <cassert>

#include "archive/hdf5/hdf5.h"

namespace graze::hdf5 {
namespace {

constexpr std::uint64_t kChunkBytes = std::uint64_t{1} << 18;  // fits HDF5's chunk cache (1 MiB) several times

Handle enumeration_type(const std::vector<std::string>& labels, hid_t base) {
  Handle type(H5Tenum_create(base), H5Tclose, "enumeration");
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const auto value = static_cast<std::uint8_t>(i);
    check(H5Tenum_insert(type.id(), labels[i].c_str(), &value), "enumeration");
  }
  return type;
}

Handle file_type(const Spec& spec) {
  if (spec.type == Type::enumeration) return enumeration_type(spec.labels, H5T_STD_U8LE);
  const hid_t type = spec.type == Type::u8    ? H5T_STD_U8LE
                     : spec.type == Type::i32 ? H5T_STD_I32LE
                     : spec.type == Type::u32 ? H5T_STD_U32LE
                     : spec.type == Type::u64 ? H5T_STD_U64LE
                                              : H5T_IEEE_F64LE;
  return Handle(H5Tcopy(type), H5Tclose, spec.name);
}

Handle memory_type(const Spec& spec) {
  if (spec.type == Type::enumeration) return enumeration_type(spec.labels, H5T_NATIVE_UINT8);
  const hid_t type = spec.type == Type::u8    ? H5T_NATIVE_UINT8
                     : spec.type == Type::i32 ? H5T_NATIVE_INT32
                     : spec.type == Type::u32 ? H5T_NATIVE_UINT32
                     : spec.type == Type::u64 ? H5T_NATIVE_UINT64
                                              : H5T_NATIVE_DOUBLE;
  return Handle(H5Tcopy(type), H5Tclose, spec.name);
}

Handle creation_of(const Spec& spec, std::uint64_t rows, int deflate) {
  Handle list(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, spec.name);
  check(H5Pset_obj_track_times(list.id(), false), spec.name);
  check(H5Pset_fill_time(list.id(), H5D_FILL_TIME_NEVER), spec.name);  // every row is written
  if (deflate == 0 || rows == 0 || spec.width == 0) return list;
  const hsize_t chunk[2] = {std::clamp<hsize_t>(kChunkBytes / spec.row_bytes(), 1, rows), spec.width};
  check(H5Pset_chunk(list.id(), spec.matrix ? 2 : 1, chunk), spec.name);
  check(H5Pset_shuffle(list.id()), spec.name);
  check(H5Pset_deflate(list.id(), static_cast<unsigned>(deflate)), spec.name);
  return list;
}

/// Whether a stored enumeration's members are the first of `labels`, all at the same values: programs add kinds at the
/// end, and what an older one wrote stays readable.
bool leading_labels(hid_t stored, const std::vector<std::string>& labels) {
  if (H5Tget_class(stored) != H5T_ENUM || H5Tget_size(stored) != 1) return false;
  const int count = H5Tget_nmembers(stored);
  if (count < 1 || static_cast<std::size_t>(count) > labels.size()) return false;
  const std::vector<std::string> leading(labels.begin(), labels.begin() + count);
  const Handle wanted = enumeration_type(leading, H5T_STD_U8LE);
  return H5Tequal(stored, wanted.id()) > 0;
}

bool same_type(hid_t stored, const Spec& spec) {
  if (spec.type == Type::enumeration) return leading_labels(stored, spec.labels);
  const Handle wanted = file_type(spec);
  return H5Tequal(stored, wanted.id()) > 0;
}

}  // namespace

std::size_t size_of(Type type) {
  switch (type) {
    case Type::enumeration:
    case Type::u8:
      return 1;
    case Type::i32:
    case Type::u32:
      return 4;
    case Type::u64:
    case Type::f64:
      return 8;
  }
  return 0;
}

Column Column::create(hid_t parent, const std::string& group, const Spec& spec, std::uint64_t rows, int deflate) {
  Column column;
  column.spec_ = spec;
  column.path_ = group + "/" + spec.name;
  column.rows_ = rows;
  const hsize_t extent[2] = {rows, spec.width};
  const Handle type = file_type(spec);
  const Handle space(H5Screate_simple(spec.matrix ? 2 : 1, extent, nullptr), H5Sclose, column.path_);
  make_group(parent, group);
  const Handle list = creation_of(spec, rows, deflate);
  column.dataset_ =
      Handle(H5Dcreate2(parent, column.path_.c_str(), type.id(), space.id(), H5P_DEFAULT, list.id(), H5P_DEFAULT),
             H5Dclose, column.path_);
  if (!spec.unit.empty()) write_attribute(column.dataset_.id(), "unit", spec.unit);
  return column;
}

Column Column::open(hid_t parent, const std::string& group, const Spec& spec, std::uint64_t file_bytes) {
  Column column;
  column.spec_ = spec;
  column.path_ = group + "/" + spec.name;
  column.dataset_ = open_dataset(parent, column.path_);
  const Handle type(H5Dget_type(column.dataset_.id()), H5Tclose, column.path_);
  const Handle space(H5Dget_space(column.dataset_.id()), H5Sclose, column.path_);
  const int rank = spec.matrix ? 2 : 1;
  hsize_t extent[2] = {0, 1};
  if (!same_type(type.id(), spec) || H5Sget_simple_extent_ndims(space.id()) != rank ||
      H5Sget_simple_extent_dims(space.id(), extent, nullptr) != rank || extent[1] != spec.width) {
    throw Error("dataset '" + column.path_ + "' is not of the expected type and shape");
  }
  check_size(column.dataset_, column.path_, extent[0], spec.row_bytes(), file_bytes);
  column.rows_ = extent[0];
  return column;
}

Handle Column::select(std::uint64_t first, std::uint64_t count) const {
  Handle space(H5Dget_space(dataset_.id()), H5Sclose, path_);
  const hsize_t start[2] = {first, 0}, extent[2] = {count, spec_.width};
  check(H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, start, nullptr, extent, nullptr), path_);
  return space;
}

void Column::write(std::uint64_t first, std::uint64_t count, const void* data) {
  assert(first + count <= rows_);
  if (count == 0 || spec_.width == 0) return;
  const Handle file_space = select(first, count);
  const hsize_t extent[2] = {count, spec_.width};
  const Handle memory_space(H5Screate_simple(spec_.matrix ? 2 : 1, extent, nullptr), H5Sclose, path_);
  const Handle type = memory_type(spec_);
  check(H5Dwrite(dataset_.id(), type.id(), memory_space.id(), file_space.id(), H5P_DEFAULT, data), path_);
}

void Column::read(std::uint64_t first, std::uint64_t count, void* data) const {
  assert(first + count <= rows_);
  if (count == 0 || spec_.width == 0) return;
  const Handle file_space = select(first, count);
  const hsize_t extent[2] = {count, spec_.width};
  const Handle memory_space(H5Screate_simple(spec_.matrix ? 2 : 1, extent, nullptr), H5Sclose, path_);
  const Handle type = memory_type(spec_);
  check(H5Dread(dataset_.id(), type.id(), memory_space.id(), file_space.id(), H5P_DEFAULT, data), path_);
}

}  // namespace graze::hdf5
