#include "archive/hdf5/file_driver.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <span>

#include "archive/files/files.h"
#include "engine/settings/settings.h"

namespace graze::hdf5 {
namespace {

/// What a file access property list carries to the driver's open().
struct DriverInfo {
  int descriptor;
  DriverStatus* status;  // none: the file is only read, and read errors are HDF5's own
};

/// HDF5 sees the first member only, by its address.
struct DriverFile {
  H5FD_t base;
  DriverInfo info;
  haddr_t allocated, end;  // bytes
  Descriptor own;          // of a file that is only read
};

bool only_read(const DriverFile& file) { return file.info.status == nullptr; }

DriverFile* of(H5FD_t* file) { return reinterpret_cast<DriverFile*>(file); }
const DriverFile* of(const H5FD_t* file) { return reinterpret_cast<const DriverFile*>(file); }

H5FD_t* open_driver(const char*, unsigned, hid_t access, haddr_t) {
  const void* info = H5Pget_driver_info(access);
  if (info == nullptr) return nullptr;
  auto file = std::make_unique<DriverFile>();
  std::memcpy(&file->info, info, sizeof(DriverInfo));
  if (only_read(*file)) {
    struct stat status {};
    file->own = Descriptor(fcntl(file->info.descriptor, F_DUPFD_CLOEXEC, 0));
    file->info.descriptor = file->own.number();
    if (fstat(file->info.descriptor, &status) != 0) return nullptr;
    file->end = static_cast<haddr_t>(status.st_size);
  }
  return &file.release()->base;
}

herr_t close_driver(H5FD_t* file) {
  delete of(file);
  return 0;
}

herr_t query(const H5FD_t*, unsigned long* flags) {
  *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_DATA_SIEVE |
           H5FD_FEAT_AGGREGATE_SMALLDATA;
  return 0;
}

haddr_t get_allocated(const H5FD_t* file, H5FD_mem_t) { return of(file)->allocated; }

herr_t set_allocated(H5FD_t* file, H5FD_mem_t, haddr_t address) {
  of(file)->allocated = address;
  return 0;
}

haddr_t get_end(const H5FD_t* file, H5FD_mem_t) { return of(file)->end; }

/// Passes on to HDF5, whose errors the user reads, what the system said.
herr_t fail_read(int error) {
  H5Epush2(H5E_DEFAULT, __FILE__, __func__, __LINE__, H5E_ERR_CLS, H5E_IO, H5E_READERROR,
           "file read failed: error message = '%s'", std::strerror(error));
  return -1;
}

/// What was never written, or lost, reads as zeros.
herr_t read_driver(H5FD_t* base, H5FD_mem_t, hid_t, haddr_t address, std::size_t size, void* buffer) {
  const DriverFile* file = of(base);
  auto* to = static_cast<char*>(buffer);
  while (size > 0) {
    const ssize_t got = pread(file->info.descriptor, to, size, static_cast<off_t>(address));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) {
      if (got < 0 && only_read(*file)) return fail_read(errno);
      if (got < 0 && file->info.status->error == 0) file->info.status->error = errno;
      std::memset(to, 0, size);
      return 0;
    }
    to += got;
    address += static_cast<haddr_t>(got);
    size -= static_cast<std::size_t>(got);
  }
  return 0;
}

herr_t write_driver(H5FD_t* base, H5FD_mem_t, hid_t, haddr_t address, std::size_t size, const void* buffer) {
  DriverFile* file = of(base);
  if (only_read(*file)) return -1;
  const auto* from = static_cast<const char*>(buffer);
  file->end = std::max(file->end, address + size);
  while (size > 0 && file->info.status->error == 0) {
    const ssize_t written = pwrite(file->info.descriptor, from, size, static_cast<off_t>(address));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      file->info.status->error = errno;
      break;
    }
    from += written;
    address += static_cast<haddr_t>(written);
    size -= static_cast<std::size_t>(written);
  }
  return 0;
}

/// HDF5 wants the file to be as long as what it has allocated.
herr_t truncate_driver(H5FD_t* base, hid_t, hbool_t) {
  DriverFile* file = of(base);
  if (only_read(*file)) return 0;
  if (file->end != file->allocated && file->info.status->error == 0 &&
      ftruncate(file->info.descriptor, static_cast<off_t>(file->allocated)) != 0) {
    file->info.status->error = errno;
  }
  file->end = file->allocated;
  return 0;
}

H5FD_class_t make_class() {
  H5FD_class_t driver{};
  driver.name = "graze";
  driver.maxaddr = haddr_t{1} << 62;
  driver.fc_degree = H5F_CLOSE_WEAK;
  driver.fapl_size = sizeof(DriverInfo);
  driver.open = open_driver;
  driver.close = close_driver;
  driver.query = query;
  driver.get_eoa = get_allocated;
  driver.set_eoa = set_allocated;
  driver.get_eof = get_end;
  driver.read = read_driver;
  driver.write = write_driver;
  driver.truncate = truncate_driver;
  constexpr H5FD_mem_t map[] = H5FD_FLMAP_DICHOTOMY;
  std::copy(std::begin(map), std::end(map), driver.fl_map);
  return driver;
}

void set_driver(const Handle& list, const DriverInfo& info) {
  static const H5FD_class_t driver = make_class();
  static const hid_t id = H5FDregister(&driver);
  check(H5Pset_driver(list.id(), id, &info), "file driver");
}

}  // namespace

Handle create_on(int descriptor, DriverStatus& status) {
  const Handle list = file_access();
  set_driver(list, {descriptor, &status});
  return create_file("graze", list);
}

Handle open_for_reading(int descriptor) {
  const Handle list(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "access properties");
  set_driver(list, {descriptor, nullptr});
  return Handle(H5Fopen("graze", H5F_ACC_RDONLY, list.id()), H5Fclose, "not a readable HDF5 file");
}

Handle open_for_reading(const std::filesystem::path& path) {
  return open_for_reading(open_archive_file(path).number());
}

}  // namespace graze::hdf5

namespace graze {

namespace {

Seal fill_and_seal(NewFile& target, const std::filesystem::path& path,
                   const std::function<void(const hdf5::Handle& file)>& fill) {
  {
    const hdf5::Lock lock;
    hdf5::DriverStatus status;
    try {
      hdf5::Handle file = hdf5::create_on(target.descriptor(), status);
      fill(file);
      file.close("new file");
    } catch (const hdf5::Error& error) {
      if (status.error == 0) throw MachineError(fmt::format("{}: cannot be written: {}", path.string(), error.what()));
    }
    if (status.error != 0) fail_writing(path, status.error);
  }
  Seal seal;
  if (const int error = seal_file(target.descriptor(), &seal); error != 0) fail_writing(path, error);
  return seal;
}

/// All bytes of one file into another, empty one.
void copy_bytes(int from, int to, const std::filesystem::path& path) {
  std::array<std::byte, std::size_t{1} << 16> bytes;
  for (off_t at = 0;;) {
    const ssize_t count = pread(from, bytes.data(), bytes.size(), at);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail_writing(path, errno);
    if (count == 0) return;
    const int error = write_all(to, std::span(bytes).first(static_cast<std::size_t>(count)));
    if (error != 0) fail_writing(path, error);
    at += count;
  }
}

}  // namespace

Seal publish_hdf5(const Directory& folder, const std::string& name,
                  const std::function<void(const hdf5::Handle& file)>& fill) {
  NewFile target(folder, name);
  const Seal seal = fill_and_seal(target, folder / name, fill);
  target.publish();
  return seal;
}

void publish_hdf5_twice(const Directory& folder, const std::string& name, const std::string& copy,
                        const std::function<void(const hdf5::Handle& file)>& fill) {
  NewFile first(folder, name);
  fill_and_seal(first, folder / name, fill);
  first.publish();
  NewFile second(folder, copy);
  copy_bytes(first.descriptor(), second.descriptor(), folder / copy);
  second.publish();
}

Seal publish_hdf5(const std::filesystem::path& path, bool force,
                  const std::function<void(const hdf5::Handle& file)>& fill) {
  NewFile target(path, force);
  const Seal seal = fill_and_seal(target, path, fill);
  target.publish();
  return seal;
}

}  // namespace graze
