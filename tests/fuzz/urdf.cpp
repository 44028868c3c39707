// Claim: any text either is a robot that compiles into a model or is refused with an InputError. What a repair makes of
// it needs no repair, and makes a model of positive masses and physical inertias.

#include "engine/model/urdf.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "engine/model/inertia_rules.h"
#include "engine/model/model.h"
#include "engine/settings/settings.h"
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/xml_mutator.h"

namespace {

/// Whether the text is a robot that compiles; aborts if that has a body that no robot can have.
bool read(const std::string& text, const graze::UrdfOptions& options) {
  try {
    graze::World world;
    world.robot = graze::parse_urdf(text, GRAZE_SOURCE_DIR "/tests/fuzz/corpus/urdf/fuzz.urdf", options);
    world.initial.on_ground = true;
    const graze::Model model = graze::compile(world);
    for (const graze::Body& body : model.bodies) {
      if (!graze::mass_problem(body.mass).empty() || !graze::inertia_problem(body.inertia).empty()) std::abort();
    }
    graze::initial_state(world, model);
    return true;
  } catch (const graze::InputError&) {
    return false;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  graze::UrdfOptions options;
  options.ignore_missing_meshes = true;
  read(text, options);
  std::string document;
  options.repair = true;
  options.read = [&](const std::string& repaired) { document = repaired; };
  const bool accepted = read(text, options);
  if (!accepted || document.empty()) return 0;
  graze::UrdfOptions plain;
  plain.ignore_missing_meshes = true;
  if (!read(document, plain)) std::abort();
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  graze::fuzz::Dice dice(seed);
  if (dice.one_in(4)) return LLVMFuzzerMutate(data, size, most);
  const std::string text(reinterpret_cast<const char*>(data), size);
  return graze::fuzz::put(graze::fuzz::mutated_xml(text, dice), data, size, most);
}
