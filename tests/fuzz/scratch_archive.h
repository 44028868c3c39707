#pragma once
// What the archive targets share: a scratch file, and reading all that an archive holds.

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "archive/archive.h"
#include "tests/archive/tables.h"

namespace graze::fuzz {

/// One file per process, since targets run side by side.
inline const std::filesystem::path& scratch_file() {
  static const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("graze_fuzz_" + std::to_string(getpid()) + ".h5");
  return file;
}

inline void write_scratch(const void* data, std::size_t size) {
  std::ofstream(scratch_file(), std::ios::binary)
      .write(static_cast<const char*>(data), static_cast<std::streamsize>(size));
}

/// Reads everything of the scratch file, and removes it. Returns false if it is refused; that is an answer too.
inline bool read_scratch() {
  bool accepted = true;
  try {
    const Archive archive(scratch_file());
    archive.complete();
    for (const std::string& policy : archive.info().policies) {
      const TraceTable traces = table_of(archive, policy);
      events_of(archive, policy);
      for (std::size_t i = 0; i < traces.size() && i < 8; ++i) {
        archive.telemetry(policy, traces.particle[i]);
        archive.particle_values(traces.particle[i]);
      }
    }
  } catch (const InputError&) {
    accepted = false;
  } catch (const MachineError&) {
    accepted = false;
  }
  std::filesystem::remove(scratch_file());
  return accepted;
}

}  // namespace graze::fuzz
