#include "tests/fuzz/archive_edits.h"

#include <fcntl.h>
#include <hdf5.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <iterator>
#include <string>
#include <vector>

#include "archive/files/seal.h"

namespace graze::fuzz {
namespace {

constexpr std::uintmax_t kSealBytes = 24;

struct Object {
  std::string path;
  bool dataset;
};

herr_t collect(hid_t, const char* name, const H5O_info_t* info, void* objects) {
  static_cast<std::vector<Object>*>(objects)->push_back({name, info->type == H5O_TYPE_DATASET});
  return 0;
}

std::vector<Object> objects_of(hid_t file) {
  std::vector<Object> out;
  H5Ovisit(file, H5_INDEX_NAME, H5_ITER_INC, collect, &out);
  return out;
}

/// Up to 8 bytes as a C string.
std::string text_of(const Edit& edit) {
  const auto* first = reinterpret_cast<const char*>(edit.value);
  return {first, strnlen(first, sizeof edit.value)};
}

/// Overwrites a few bytes of `values`, elements of `type`: as a string where it is one.
void overwrite(std::vector<char>& values, hid_t type, const Edit& edit) {
  if (values.empty()) return;
  if (H5Tis_variable_str(type) > 0) {
    static std::string text;  // outlives the write
    text = text_of(edit);
    char* pointer = text.data();
    std::memcpy(&values[edit.position % (values.size() / sizeof pointer) * sizeof pointer], &pointer, sizeof pointer);
    return;
  }
  const std::size_t at = edit.position % values.size();
  std::memcpy(&values[at], edit.value, std::min(sizeof edit.value, values.size() - at));
}

void change_dataset(hid_t file, const std::string& path, const Edit& edit) {
  const hid_t dataset = H5Dopen2(file, path.c_str(), H5P_DEFAULT);
  if (dataset < 0) return;
  const hid_t type = H5Dget_type(dataset), space = H5Dget_space(dataset);
  std::vector<char> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)) * H5Tget_size(type));
  if (!values.empty() && H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0) {
    std::vector<char> changed = values;
    overwrite(changed, type, edit);
    H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, changed.data());
    if (H5Tis_variable_str(type) > 0) H5Dvlen_reclaim(type, space, H5P_DEFAULT, values.data());
  }
  H5Sclose(space), H5Tclose(type), H5Dclose(dataset);
}

void change_attribute(hid_t file, const std::string& path, const Edit& edit) {
  const hid_t object = H5Oopen(file, path.c_str(), H5P_DEFAULT);
  if (object < 0) return;
  H5O_info_t info;
  H5Oget_info2(object, &info, H5O_INFO_NUM_ATTRS);
  if (info.num_attrs > 0) {
    const hid_t attribute = H5Aopen_by_idx(object, ".", H5_INDEX_NAME, H5_ITER_INC, edit.position % info.num_attrs,
                                           H5P_DEFAULT, H5P_DEFAULT);
    const hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute);
    std::vector<char> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)) * H5Tget_size(type));
    Edit whole = edit;
    whole.position = 0;
    overwrite(values, type, whole);
    const bool complete = H5Tis_variable_str(type) <= 0 || values.size() == sizeof(char*);
    if (!values.empty() && complete) H5Awrite(attribute, type, values.data());
    H5Sclose(space), H5Tclose(type), H5Aclose(attribute);
  }
  H5Oclose(object);
}

/// Puts a dataset of another type or shape in the place of one.
void replace(hid_t file, const std::string& path, const Edit& edit) {
  const hsize_t sizes[] = {edit.value[0] % 9u, edit.value[1] % 9u};
  const hid_t types[] = {H5T_STD_U8LE, H5T_STD_I32LE, H5T_STD_U32LE, H5T_STD_U64LE, H5T_IEEE_F64LE, H5T_C_S1};
  if (H5Ldelete(file, path.c_str(), H5P_DEFAULT) < 0) return;
  const hid_t space = H5Screate_simple(edit.value[2] % 3, sizes, nullptr);
  const hid_t dataset = H5Dcreate2(file, path.c_str(), types[edit.position % std::size(types)], space, H5P_DEFAULT,
                                   H5P_DEFAULT, H5P_DEFAULT);
  if (dataset >= 0) H5Dclose(dataset);
  H5Sclose(space);
}

void apply(hid_t file, const Edit& edit) {
  const std::vector<Object> objects = objects_of(file);
  if (objects.empty()) return;
  const Object& object = objects[edit.object % objects.size()];
  switch (edit.kind % 4) {
    case 0:
      if (object.dataset) change_dataset(file, object.path, edit);
      break;
    case 1:
      change_attribute(file, object.path, edit);
      break;
    case 2:
      if (object.dataset) replace(file, object.path, edit);
      break;
    default:
      if (object.path != ".") H5Ldelete(file, object.path.c_str(), H5P_DEFAULT);
  }
}

void unseal(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (!error && size >= kSealBytes) std::filesystem::resize_file(file, size - kSealBytes, error);
}

void seal(const std::filesystem::path& file) {
  const int descriptor = open(file.c_str(), O_RDWR | O_NOFOLLOW);
  if (descriptor < 0) return;
  if (seal_file(descriptor) != 0) std::abort();
  close(descriptor);
}

}  // namespace

bool edit_archive(const std::filesystem::path& path, std::span<const Edit> edits) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  unseal(path);
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  if (file < 0) return false;
  for (const Edit& edit : edits) apply(file, edit);
  H5Fclose(file);
  seal(path);
  return true;
}

void seal_again(const std::filesystem::path& file) {
  unseal(file);
  seal(file);
}

}  // namespace graze::fuzz
