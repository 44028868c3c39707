#pragma once
// HDF5 files that are read and written through descriptors of ours: HDF5 never looks up a path. New ones survive a
// failing disk. HDF5 cannot close a file whose writes fail: it keeps it open and tries again at exit. This driver
// remembers the first error, swallows all later writes, and so lets HDF5 finish; the caller then looks at the error and
// throws the file away.

#include <filesystem>
#include <functional>

#include "archive/files/directory.h"
#include "archive/files/seal.h"
#include "archive/hdf5/hdf5.h"

namespace graze {

/// A new HDF5 file, sealed, that appears whole or not at all: `fill` writes its content. Takes the library's lock.
/// Throws MachineError, and what `fill` throws. Returns the file's seal.
Seal publish_hdf5(const Directory& folder, const std::string& name,
                  const std::function<void(const hdf5::Handle& file)>& fill);
/// `force`: it may take another file's place (NewFile). Throws InputError if it may not.
Seal publish_hdf5(const std::filesystem::path& path, bool force,
                  const std::function<void(const hdf5::Handle& file)>& fill);
/// The same with a copy, byte for byte, that appears after the file: its content is made and compressed only once.
void publish_hdf5_twice(const Directory& folder, const std::string& name, const std::string& copy,
                        const std::function<void(const hdf5::Handle& file)>& fill);

namespace hdf5 {

/// The first failure of a file: 0 or errno.
struct DriverStatus {
  int error = 0;
};

/// A new file in the (empty, readable and writable) file behind `descriptor`. Both outlive the handle.
Handle create_on(int descriptor, DriverStatus& status);

}  // namespace hdf5
}  // namespace graze
