#include "archive/file_driver.h"

#include <fmt/format.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "archive/archive.h"
#include "archive/files.h"

namespace graze::hdf5 {
namespace {

/// What a file access property list carries to the driver's open().
struct DriverInfo {
  int descriptor;
  DriverStatus* status;
};

/// HDF5 sees the first member only, by its address.
struct DriverFile {
  H5FD_t base;
  DriverInfo info;
  haddr_t allocated, end;  // bytes
};

DriverFile* of(H5FD_t* file) { return reinterpret_cast<DriverFile*>(file); }
const DriverFile* of(const H5FD_t* file) { return reinterpret_cast<const DriverFile*>(file); }

H5FD_t* open_driver(const char*, unsigned, hid_t access, haddr_t) {
  const void* info = H5Pget_driver_info(access);
  if (info == nullptr) return nullptr;
  auto* file = new DriverFile{};
  std::memcpy(&file->info, info, sizeof(DriverInfo));
  return &file->base;
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

/// What was never written, or lost, reads as zeros.
herr_t read_driver(H5FD_t* base, H5FD_mem_t, hid_t, haddr_t address, std::size_t size, void* buffer) {
  const DriverFile* file = of(base);
  auto* to = static_cast<char*>(buffer);
  while (size > 0) {
    const ssize_t got = pread(file->info.descriptor, to, size, static_cast<off_t>(address));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) {
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

}  // namespace

Handle create_on(int descriptor, DriverStatus& status) {
  static const H5FD_class_t driver = make_class();
  static const hid_t id = H5FDregister(&driver);
  const DriverInfo info{descriptor, &status};
  const Handle list = file_access();
  check(H5Pset_driver(list.id(), id, &info), "file driver");
  return create_file("graze", list);
}

}  // namespace graze::hdf5

namespace graze {

Seal publish_hdf5(const std::filesystem::path& path, const std::function<void(const hdf5::Handle& file)>& fill) {
  NewFile target(path);
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
  target.publish();
  return seal;
}

}  // namespace graze
