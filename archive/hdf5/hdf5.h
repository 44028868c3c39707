#pragma once
// A thin layer over HDF5's C interface: handles that close themselves, typed columns, UTF-8 strings, and errors as
// exceptions instead of a printed stack. It knows nothing of campaigns; everything that is read is checked for type,
// rank and size before memory is taken for it.

#include <hdf5.h>

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace graze::hdf5 {

/// HDF5 refused, or a file is not of the expected structure. what() names the object but not the file.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Callers of anything below hold one: the library serves one thread at a time, and its error stack, which belongs
/// to the thread, is kept from printing.
class Lock {
 public:
  Lock();

 private:
  std::unique_lock<std::recursive_mutex> guard_;
};

/// Owns an HDF5 identifier.
class Handle {
 public:
  Handle() = default;
  /// Throws Error with `what` if the identifier is invalid.
  Handle(hid_t id, herr_t (*close)(hid_t), std::string_view what);
  ~Handle() { reset(); }
  Handle(Handle&& other) noexcept;
  Handle& operator=(Handle&& other) noexcept;
  hid_t id() const { return id_; }
  explicit operator bool() const { return id_ >= 0; }
  /// Closes now; throws Error when that fails.
  void close(std::string_view what);
  void reset() noexcept;

 private:
  hid_t id_ = H5I_INVALID_HID;
  herr_t (*close_)(hid_t) = nullptr;
};

/// Throws Error("what: reason of the library") if a call failed.
void check(herr_t status, std::string_view what);

// ---- files
/// Access properties for new files: version 1.8 of the format, which everything since 2008 reads and which sets no
/// limit on the size of an attribute.
Handle file_access();
Handle create_file(const std::string& name, const Handle& access);
/// Opens an HDF5 file through a descriptor, of which it takes a copy: the path is never looked up again.
Handle open_for_reading(int descriptor);
/// The same of a file that the caller names.
Handle open_for_reading(const std::filesystem::path& path);

// ---- groups
void make_group(hid_t parent, const std::string& path);  // with all that lead to it
/// Link by link. Throws Error if one of them is no hard link: soft and external ones lead where an archive never does.
bool exists(hid_t parent, const std::string& path);
std::vector<std::string> links(hid_t parent, const std::string& path);  // names in a group, sorted

// ---- attributes, scalar
void write_attribute(hid_t object, const char* name, const std::string& text);
void write_attribute(hid_t object, const char* name, std::uint64_t value);
void write_attribute(hid_t object, const char* name, double value);
bool has_attribute(hid_t object, const char* name);
std::string read_text(hid_t object, const char* name);
std::uint64_t read_count(hid_t object, const char* name);
double read_number(hid_t object, const char* name);

// ---- strings: one-dimensional, variable length, UTF-8 (invalid bytes are replaced by U+FFFD)
void write_strings(hid_t parent, const std::string& path, const std::vector<std::string>& texts);
/// The same in pieces: a list of so many texts, each piece written once.
class StringColumn {
 public:
  StringColumn(hid_t parent, const std::string& path, std::uint64_t rows);
  void write(std::uint64_t first, const std::vector<std::string>& texts);

 private:
  std::string path_;
  Handle dataset_;
};
std::vector<std::string> read_strings(hid_t parent, const std::string& path);

// ---- datasets of files that may be anybody's
/// Throws Error unless hard links lead there and the data lie in this file: neither external nor virtual, with no other
/// filters than shuffle and deflate (once each), of a type of their own.
Handle open_dataset(hid_t parent, const std::string& path);
/// How data are converted on their way (texts always are): in pieces of 64 KiB. HDF5's own two buffers of 1 MiB are
/// cleared for each dataset, which takes longer than most datasets here.
Handle transfer_list();
/// Throws Error unless so many rows may be what is stored: as many bytes, or as many as deflate can make of them,
/// within a file of `file_bytes`, in chunks of a MiB or a row at most. A dataset without storage has no rows.
void check_size(const Handle& dataset, const std::string& path, std::uint64_t rows, std::uint64_t row_bytes,
                std::uint64_t file_bytes);

/// Goes through all groups of a file. Throws Error unless there are hard links only, each object has one name (so that
/// there are no circles), every dataset may be opened (open_dataset), and they claim no more than the file has.
void check_tree(const Handle& file);

// ---- columns
enum class Type { enumeration, u8, i32, u32, u64, f64 };  // enumeration: of u8
std::size_t size_of(Type type);

/// What a dataset is: one value per row (rank 1), or, as a matrix, `width` values per row (rank 2).
struct Spec {
  std::string name;
  Type type = Type::f64;
  bool matrix = false;
  std::size_t width = 1;
  std::string unit = {};                 // attribute "unit"; empty: none is written
  std::vector<std::string> labels = {};  // of an enumeration: what 0, 1, … mean
  std::size_t row_bytes() const { return width * size_of(type); }
};

/// A dataset that is written or read by rows.
class Column {
 public:
  /// `deflate` 0: contiguous, plain. Else chunked, shuffled and compressed at that level.
  static Column create(hid_t parent, const std::string& group, const Spec& spec, std::uint64_t rows, int deflate);
  /// Throws Error unless the dataset is there (open_dataset), of this type, rank and width, and no larger than what is
  /// stored of it (check_size).
  static Column open(hid_t parent, const std::string& group, const Spec& spec, std::uint64_t file_bytes);

  std::uint64_t rows() const { return rows_; }
  void write(std::uint64_t first, std::uint64_t count, const void* data);
  void read(std::uint64_t first, std::uint64_t count, void* data) const;

 private:
  Handle select(std::uint64_t first, std::uint64_t count) const;
  Spec spec_;
  std::string path_;
  std::uint64_t rows_ = 0;
  Handle dataset_;
};

/// Whole columns.
template <class T>
void write_column(hid_t parent, const std::string& group, const Spec& spec, const std::vector<T>& data, int deflate) {
  const std::uint64_t rows = spec.width == 0 ? 0 : data.size() / spec.width;
  Column::create(parent, group, spec, rows, deflate).write(0, rows, data.data());
}
template <class T>
std::vector<T> read_column(hid_t parent, const std::string& group, const Spec& spec, std::uint64_t file_bytes) {
  const Column column = Column::open(parent, group, spec, file_bytes);
  std::vector<T> data(column.rows() * spec.width);
  column.read(0, column.rows(), data.data());
  return data;
}

}  // namespace graze::hdf5
