#pragma once
// Archives with a fitting seal that no Graze has written: what a stranger could send.

#include <fcntl.h>
#include <hdf5.h>
#include <unistd.h>

#include <functional>
#include <string>

#include "archive/files/files.h"
#include "archive/files/seal.h"
#include "archive/hdf5/file_driver.h"
#include "archive/schema/info.h"
#include "tests/archive/compare.h"
#include "tests/archive/tables.h"

namespace graze::synthetic {

/// Reads everything that there is.
inline void read_all(const std::filesystem::path& path) {
  const Archive archive(path);
  for (const std::string& policy : archive.info().policies) {
    for (const std::uint32_t particle : table_of(archive, policy).particle) {
      archive.telemetry(policy, particle);
      archive.particle_values(particle);
    }
    events_of(archive, policy);
  }
}

inline std::string refusal(const std::filesystem::path& path) {
  return message_of<InputError>([&] { read_all(path); });
}

/// A small campaign, packed.
inline std::filesystem::path packed(const Folder& folder) {
  CampaignInfo facts = info();
  facts.particles = 16;
  facts.scenario_text = "graze: 1";
  write(folder / "good.graze", facts);
  pack(folder / "good.graze", folder / "good.h5", false);
  return folder / "good.h5";
}

/// A sealed copy of a file in which one thing has been changed through HDF5: what a program that knows the seal could
/// forge.
inline std::filesystem::path forged(const Folder& folder, const std::filesystem::path& source,
                                    const std::function<void(hid_t)>& change) {
  const std::filesystem::path target = folder / "forged.h5";
  publish_hdf5(target, true, [&](const hdf5::Handle& out) {
    const hdf5::Handle in = hdf5::open_for_reading(source);
    for (const std::string& name : hdf5::links(in.id(), ".")) {
      hdf5::check(H5Ocopy(in.id(), name.c_str(), out.id(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), name);
    }
    write_info_attributes(out, info(), Layout::packed, true);
    change(out.id());
  });
  return target;
}

inline void drop(hid_t file, const char* path) { hdf5::check(H5Ldelete(file, path, H5P_DEFAULT), path); }

template <class T>
void replace(hid_t file, const std::string& group, const hdf5::Spec& spec, const std::vector<T>& data) {
  drop(file, (group + "/" + spec.name).c_str());
  hdf5::write_column(file, group, spec, data, 0);
}

/// Gives a file that has been changed a seal that fits; `had_seal`: its old one goes.
inline void reseal(const std::filesystem::path& path, bool had_seal = true) {
  constexpr int kSealBytes = 24;
  if (had_seal) std::filesystem::resize_file(path, std::filesystem::file_size(path) - kSealBytes);
  const Descriptor file(open(path.c_str(), O_RDWR | O_CLOEXEC));
  ASSERT_EQ(seal_file(file.number()), 0);
}

}  // namespace graze::synthetic
