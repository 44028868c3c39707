#include "archive/hdf5/hdf5.h"

#include <algorithm>
#include <cassert>
#include <memory>
#include <new>
#include <utility>

#include "archive/files/utf8.h"

namespace graze::hdf5 {
namespace {

std::recursive_mutex& mutex() {
  static std::recursive_mutex instance;
  return instance;
}

/// The innermost entry of the library's error stack: what went wrong, not through which calls it passed.
std::string reason() {
  std::string text;
  const auto take = [](unsigned n, const H5E_error2_t* entry, void* out) -> herr_t {
    if (n == 0 && entry->desc != nullptr) *static_cast<std::string*>(out) = entry->desc;
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, take, &text);
  // "file read failed: time = …, errno = 5, error message = 'Input/output error', buf = …": what and why.
  constexpr std::string_view kWhy = "error message = '";
  if (const std::size_t at = text.find(kWhy); at != std::string::npos) {
    const std::size_t why = at + kWhy.size();
    return text.substr(0, text.find_first_of(":,")) + ": " + text.substr(why, text.find('\'', why) - why);
  }
  return text.empty() ? "unknown error" : text;
}

[[noreturn]] void fail(std::string_view what) { throw Error(std::string(what) + ": " + reason()); }

Handle text_type() {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "string type");
  check(H5Tset_size(type.id(), H5T_VARIABLE), "string type");
  check(H5Tset_cset(type.id(), H5T_CSET_UTF8), "string type");
  return type;
}

Handle scalar_space() { return Handle(H5Screate(H5S_SCALAR), H5Sclose, "dataspace"); }

void write_scalar(hid_t object, const char* name, hid_t file_type, hid_t memory_type, const void* value) {
  const Handle space = scalar_space();
  const Handle attribute(H5Acreate2(object, name, file_type, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose, name);
  check(H5Awrite(attribute.id(), memory_type, value), name);
}

/// An attribute that is a scalar of the given class, of no more bytes than a number or a reference to a text has.
Handle open_scalar(hid_t object, const char* name, H5T_class_t wanted) {
  if (!has_attribute(object, name)) throw Error("attribute '" + std::string(name) + "' is missing");
  Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose, name);
  const Handle space(H5Aget_space(attribute.id()), H5Sclose, name);
  const Handle type(H5Aget_type(attribute.id()), H5Tclose, name);
  constexpr std::size_t kMost = 16;
  if (H5Sget_simple_extent_npoints(space.id()) != 1 || H5Tget_class(type.id()) != wanted ||
      H5Tget_size(type.id()) > kMost || H5Tcommitted(type.id()) > 0) {
    throw Error("attribute '" + std::string(name) + "' is not of the expected type");
  }
  return attribute;
}

/// Where HDF5 puts the texts that it reads, no more bytes than it may.
struct TextMemory {
  std::uint64_t left;  // bytes
  std::vector<std::unique_ptr<char[]>> texts;
  bool exceeded = false;

  static void* take(std::size_t size, void* self) noexcept {
    auto& memory = *static_cast<TextMemory*>(self);
    if (size > memory.left) {
      memory.exceeded = true;
      return nullptr;
    }
    try {
      memory.texts.push_back(std::make_unique<char[]>(size));
    } catch (const std::bad_alloc&) {
      return nullptr;
    }
    memory.left -= size;
    return memory.texts.back().get();
  }
  static void give_back(void*, void*) {}
};

/// Bytes of the file that an object lies in.
std::uint64_t file_size(hid_t object) {
  const Handle file(H5Iget_file_id(object), H5Fclose, "file");
  hsize_t bytes = 0;
  check(H5Fget_filesize(file.id(), &bytes), "file size");
  return bytes;
}

/// No times in object headers: equal content, equal bytes.
Handle creation(hid_t kind) {
  Handle list(H5Pcreate(kind), H5Pclose, "creation properties");
  check(H5Pset_obj_track_times(list.id(), false), "creation properties");
  return list;
}

}  // namespace

Lock::Lock() : guard_(mutex()) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  static const bool without_plugins = H5PLset_loading_state(0) >= 0;  // a filter's name in a file loads no code
  if (!without_plugins) throw Error("plugins of HDF5 cannot be switched off");
}

Handle::Handle(hid_t id, herr_t (*close)(hid_t), std::string_view what) : id_(id), close_(close) {
  if (id_ < 0) fail(what);
}

Handle::Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}

Handle& Handle::operator=(Handle&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(close_, other.close_);
  return *this;
}

void Handle::close(std::string_view what) {
  if (id_ >= 0 && close_(std::exchange(id_, H5I_INVALID_HID)) < 0) fail(what);
}

void Handle::reset() noexcept {
  if (id_ >= 0) close_(std::exchange(id_, H5I_INVALID_HID));
}

void check(herr_t status, std::string_view what) {
  if (status < 0) fail(what);
}

Handle file_access() {
  Handle list(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "access properties");
  check(H5Pset_libver_bounds(list.id(), H5F_LIBVER_V18, H5F_LIBVER_V18), "access properties");
  return list;
}

Handle create_file(const std::string& name, const Handle& access) {
  const Handle list = creation(H5P_FILE_CREATE);
  return Handle(H5Fcreate(name.c_str(), H5F_ACC_TRUNC, list.id(), access.id()), H5Fclose, "new file");
}

void make_group(hid_t parent, const std::string& path) {
  const Handle list = creation(H5P_GROUP_CREATE);
  for (std::size_t end = path.find('/');; end = path.find('/', end + 1)) {
    const std::string head = path.substr(0, end);
    if (!exists(parent, head)) {
      Handle(H5Gcreate2(parent, head.c_str(), H5P_DEFAULT, list.id(), H5P_DEFAULT), H5Gclose, path);
    }
    if (end == std::string::npos) return;
  }
}

bool exists(hid_t parent, const std::string& path) {
  for (std::size_t end = path.find('/');; end = path.find('/', end + 1)) {
    const std::string head = path.substr(0, end);
    const htri_t found = H5Lexists(parent, head.c_str(), H5P_DEFAULT);
    check(found, head);
    if (found == 0) return false;
    H5L_info_t link{};
    check(H5Lget_info(parent, head.c_str(), &link, H5P_DEFAULT), head);
    if (link.type != H5L_TYPE_HARD) {
      const char* kind = link.type == H5L_TYPE_SOFT       ? "a soft link"
                         : link.type == H5L_TYPE_EXTERNAL ? "a link to another file"
                                                          : "a user-defined link";
      throw Error("'" + head + "' is " + kind + "; an archive has hard links only");
    }
    if (end == std::string::npos) return true;
  }
}

std::vector<std::string> links(hid_t parent, const std::string& path) {
  const Handle group(H5Gopen2(parent, path.c_str(), H5P_DEFAULT), H5Gclose, path);
  std::vector<std::string> names;
  const auto take = [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
    static_cast<std::vector<std::string>*>(out)->push_back(name);
    return 0;
  };
  hsize_t start = 0;
  check(H5Literate(group.id(), H5_INDEX_NAME, H5_ITER_INC, &start, take, &names), path);
  std::sort(names.begin(), names.end());
  return names;
}

void write_attribute(hid_t object, const char* name, const std::string& text) {
  const Handle type = text_type();
  const std::string valid = valid_utf8(text);
  const char* pointer = valid.c_str();
  write_scalar(object, name, type.id(), type.id(), &pointer);
}

void write_attribute(hid_t object, const char* name, std::uint64_t value) {
  write_scalar(object, name, H5T_STD_U64LE, H5T_NATIVE_UINT64, &value);
}

void write_attribute(hid_t object, const char* name, double value) {
  write_scalar(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value);
}

bool has_attribute(hid_t object, const char* name) {
  const htri_t found = H5Aexists(object, name);
  check(found, name);
  return found > 0;
}

std::string read_text(hid_t object, const char* name) {
  const Handle attribute = open_scalar(object, name, H5T_STRING);
  const Handle stored(H5Aget_type(attribute.id()), H5Tclose, name);
  if (H5Tis_variable_str(stored.id()) <= 0) throw Error("attribute '" + std::string(name) + "' has a fixed length");
  const Handle type = text_type();
  char* text = nullptr;
  check(H5Aread(attribute.id(), type.id(), &text), name);
  const std::string out = text == nullptr ? "" : valid_utf8(text);
  H5free_memory(text);
  return out;
}

std::uint64_t read_count(hid_t object, const char* name) {
  const Handle attribute = open_scalar(object, name, H5T_INTEGER);
  std::uint64_t value = 0;
  check(H5Aread(attribute.id(), H5T_NATIVE_UINT64, &value), name);
  return value;
}

double read_number(hid_t object, const char* name) {
  const Handle attribute = open_scalar(object, name, H5T_FLOAT);
  double value = 0;
  check(H5Aread(attribute.id(), H5T_NATIVE_DOUBLE, &value), name);
  return value;
}

Handle transfer_list() {
  Handle list(H5Pcreate(H5P_DATASET_XFER), H5Pclose, "transfer");
  constexpr std::size_t kBytes = 65536;
  check(H5Pset_buffer(list.id(), kBytes, nullptr, nullptr), "transfer");
  return list;
}

StringColumn::StringColumn(hid_t parent, const std::string& path, std::uint64_t rows) : path_(path) {
  const hsize_t count = rows;
  const Handle type = text_type();
  const Handle space(H5Screate_simple(1, &count, nullptr), H5Sclose, path);
  const Handle list = creation(H5P_DATASET_CREATE);
  if (const std::size_t slash = path.rfind('/'); slash != std::string::npos) make_group(parent, path.substr(0, slash));
  dataset_ = Handle(H5Dcreate2(parent, path.c_str(), type.id(), space.id(), H5P_DEFAULT, list.id(), H5P_DEFAULT),
                    H5Dclose, path);
}

void StringColumn::write(std::uint64_t first, const std::vector<std::string>& texts) {
  if (texts.empty()) return;
  std::vector<std::string> valid(texts.size());
  std::transform(texts.begin(), texts.end(), valid.begin(), valid_utf8);
  std::vector<const char*> pointers(texts.size());
  std::transform(valid.begin(), valid.end(), pointers.begin(), [](const std::string& text) { return text.c_str(); });
  const Handle type = text_type();
  const Handle file_space(H5Dget_space(dataset_.id()), H5Sclose, path_);
  const hsize_t start = first, count = texts.size();
  check(H5Sselect_hyperslab(file_space.id(), H5S_SELECT_SET, &start, nullptr, &count, nullptr), path_);
  const Handle memory_space(H5Screate_simple(1, &count, nullptr), H5Sclose, path_);
  const Handle transfer = transfer_list();
  check(H5Dwrite(dataset_.id(), type.id(), memory_space.id(), file_space.id(), transfer.id(), pointers.data()), path_);
}

void write_strings(hid_t parent, const std::string& path, const std::vector<std::string>& texts) {
  StringColumn(parent, path, texts.size()).write(0, texts);
}

std::vector<std::string> read_strings(hid_t parent, const std::string& path) {
  const Handle dataset = open_dataset(parent, path);
  const Handle stored(H5Dget_type(dataset.id()), H5Tclose, path);
  const Handle space(H5Dget_space(dataset.id()), H5Sclose, path);
  if (H5Tget_class(stored.id()) != H5T_STRING || H5Tis_variable_str(stored.id()) <= 0 ||
      H5Sget_simple_extent_ndims(space.id()) != 1) {
    throw Error("dataset '" + path + "' is not a list of strings");
  }
  const auto count = static_cast<std::uint64_t>(H5Sget_simple_extent_npoints(space.id()));
  const std::uint64_t file_bytes = file_size(dataset.id());
  constexpr std::uint64_t kReference = 16;  // bytes per string of variable length in a plain dataset
  check_size(dataset, path, count, kReference, file_bytes);
  std::vector<std::string> texts(count);
  if (count == 0) return texts;
  const Handle type = text_type();
  // Each text lies in the file once, with its end: more of them than the file has bytes are one text many times over.
  TextMemory memory{file_bytes + count, {}};
  const Handle transfer = transfer_list();
  check(H5Pset_vlen_mem_manager(transfer.id(), TextMemory::take, &memory, TextMemory::give_back, nullptr), path);
  std::vector<char*> pointers(count, nullptr);
  const herr_t read = H5Dread(dataset.id(), type.id(), H5S_ALL, H5S_ALL, transfer.id(), pointers.data());
  if (memory.exceeded) {
    throw Error("dataset '" + path + "' claims more text than the file of " + std::to_string(file_bytes) +
                " bytes can hold");
  }
  check(read, path);
  for (std::uint64_t i = 0; i < count; ++i) texts[i] = pointers[i] == nullptr ? "" : valid_utf8(pointers[i]);
  return texts;
}

}  // namespace graze::hdf5
