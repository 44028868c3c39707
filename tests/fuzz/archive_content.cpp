// Claim: an archive that is sound HDF5 with a fitting seal, but whose content was changed in any way, is read or
// refused with an InputError or MachineError: offsets that do not rise, indices out of range, missing or reshaped
// datasets, attributes of another value. The input is a list of edits to the seed full.h5, made by HDF5 itself. (Bytes
// changed at random would try HDF5, which does not survive that: it loops for ever on a damaged heap. The seal keeps
// them away from it.)

#include <fcntl.h>
#include <hdf5.h>

#include <cstdlib>
#include <cstring>
#include <iterator>
#include <vector>

#include "archive/seal.h"
#include "tests/fuzz/scratch_archive.h"

namespace {

constexpr std::size_t kSealBytes = 24;

/// 12 bytes of input.
struct Edit {
  std::uint8_t kind, object;
  std::uint16_t position;
  std::uint8_t value[8];
};
static_assert(sizeof(Edit) == 12);

struct Object {
  std::string path;
  bool dataset;
};

const std::vector<char>& base() {
  static const std::vector<char> bytes = [] {
    std::ifstream file(GRAZE_SOURCE_DIR "/tests/fuzz/corpus/archive/full.h5", std::ios::binary);
    std::vector<char> all((std::istreambuf_iterator<char>(file)), {});
    if (all.size() < kSealBytes) std::abort();
    all.resize(all.size() - kSealBytes);
    return all;
  }();
  return bytes;
}

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
  static const std::vector<Object> objects = objects_of(file);  // of the untouched seed; some may be gone by now
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

void seal_scratch() {
  const int descriptor = open(graze::fuzz::scratch_file().c_str(), O_RDWR);
  if (descriptor < 0 || graze::seal_file(descriptor) != 0) std::abort();
  close(descriptor);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  graze::fuzz::write_scratch(base().data(), base().size());
  const hid_t file = H5Fopen(graze::fuzz::scratch_file().c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  if (file < 0) std::abort();
  constexpr std::size_t kMostEdits = 8;
  for (std::size_t i = 0; i + sizeof(Edit) <= size && i < kMostEdits * sizeof(Edit); i += sizeof(Edit)) {
    Edit edit;
    std::memcpy(&edit, data + i, sizeof edit);
    apply(file, edit);
  }
  H5Fclose(file);
  seal_scratch();
  // Untouched, the seed must be accepted: or nothing behind the first check would ever be tried.
  if (!graze::fuzz::read_scratch() && size < sizeof(Edit)) std::abort();
  return 0;
}
