// Claim: any text either is a scenario or is refused with an InputError.

#include "scenarios/scenario.h"

#include <cstddef>
#include <cstdint>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    // Stands in the corpus folder, so that the seeds find their robot at ../robot.urdf.
    graze::parse_scenario(text, GRAZE_SOURCE_DIR "/tests/fuzz/corpus/scenario/fuzz.yaml");
  } catch (const graze::InputError&) {
  }
  return 0;
}
