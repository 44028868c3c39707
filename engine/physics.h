#pragma once
// The back ends by name. A back end is a BlockPhysics in a folder of its own; it ends one of its files in a
// PhysicsRegistration, and nothing else names its headers. (The folder's name also goes into two lists: that of the
// library, CMakeLists.txt, and that of the order of the house, tests/house/includes.py.)

#include <functional>

#include "engine/block_physics.h"

namespace graze {

/// What is told of a back end, for `graze help physics`, messages and archives.
struct PhysicsText {
  struct ContactModel {
    std::string name, help;  // help: what it does, in one line
  };
  std::string help;                          // what it is, in one line
  std::vector<ContactModel> contact_models;  // in the order of contact.model's choices; the first is the default
  std::string library = {};                  // version of the library that does the work, if it is one
  bool knows_rotors = true;                  // Body::armature counts
};

/// `nominal`: any particle of the campaign (all share its numbering).
using PhysicsFactory = std::function<std::unique_ptr<BlockPhysics>(const Model& nominal)>;

struct PhysicsRegistration {
  PhysicsRegistration(const std::string& name, PhysicsText text, PhysicsFactory make);
};

/// The back end of a scenario that names none.
inline constexpr const char* kDefaultPhysics = "lanes";

/// Back ends by name, the default first, the others sorted, in whatever order they were linked.
std::vector<std::string> physics_names();
/// Of a registered one. Throws InputError, here and below, that names those that there are.
const PhysicsText& physics_text(const std::string& physics);
/// Contact models that a back end knows, in the order of contact.model's choices.
std::vector<std::string> contact_models_of(const std::string& physics);
/// Throws InputError also for a contact model, or rotors of drives, that the back end does not have.
std::unique_ptr<BlockPhysics> make_physics(const std::string& name, const Model& nominal);

}  // namespace graze
