// Claim: any file either is an archive, of which all can be read, or is refused with an InputError or MachineError.

#include "archive/archive.h"

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

namespace {

// One file per process, since targets run side by side.
const std::filesystem::path& scratch_file() {
  static const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("graze_fuzz_" + std::to_string(getpid()) + ".h5");
  return file;
}

void read_all(const graze::Archive& archive) {
  archive.complete();
  for (const std::string& policy : archive.info().policies) {
    const graze::TraceTable traces = archive.traces(policy);
    archive.events(policy);
    for (std::size_t i = 0; i < traces.size() && i < 8; ++i) {
      archive.telemetry(policy, traces.particle[i]);
      archive.particle_values(traces.particle[i]);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::ofstream(scratch_file(), std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    read_all(graze::Archive(scratch_file()));
  } catch (const graze::InputError&) {
  } catch (const graze::MachineError&) {
  }
  std::filesystem::remove(scratch_file());
  return 0;
}
