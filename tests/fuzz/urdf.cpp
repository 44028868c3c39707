// Claim: any text either is a robot that compiles into a model or is refused with an InputError.

#include "engine/model/urdf.h"

#include <cstddef>
#include <cstdint>
#include <string>

#include "engine/model/model.h"
#include "engine/settings/settings.h"
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/xml_mutator.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    graze::UrdfOptions options;
    options.ignore_missing_meshes = true;
    graze::World world;
    world.robot = graze::parse_urdf(text, GRAZE_SOURCE_DIR "/tests/fuzz/corpus/urdf/fuzz.urdf", options);
    world.initial.on_ground = true;
    const graze::Model model = graze::compile(world);
    graze::initial_state(world, model);
  } catch (const graze::InputError&) {
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  graze::fuzz::Dice dice(seed);
  if (dice.one_in(4)) return LLVMFuzzerMutate(data, size, most);
  const std::string text(reinterpret_cast<const char*>(data), size);
  return graze::fuzz::put(graze::fuzz::mutated_xml(text, dice), data, size, most);
}
