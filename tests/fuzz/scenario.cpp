// Claim: any text either is a scenario or is refused with an InputError. The mutator changes trees, not bytes, nine
// times out of ten: what is no YAML does not come far.

#include "scenarios/scenario.h"

#include "tests/fuzz/mutate.h"
#include "tests/fuzz/yaml_mutator.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    // Stands in the corpus folder, so that the seeds find their robot at ../robot.urdf, and shipped scenarios theirs.
    graze::parse_scenario(text, GRAZE_SOURCE_DIR "/tests/fuzz/corpus/scenario/fuzz.yaml");
  } catch (const graze::InputError&) {
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  graze::fuzz::Dice dice(seed);
  if (dice.one_in(10)) return LLVMFuzzerMutate(data, size, most);
  const std::string text(reinterpret_cast<const char*>(data), size);
  return graze::fuzz::put(graze::fuzz::mutated_yaml(text, dice), data, size, most);
}
