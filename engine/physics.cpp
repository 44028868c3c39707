#include "engine/physics.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cassert>

#include "engine/settings/registry.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

struct Entry {
  PhysicsText text;
  PhysicsFactory make;
};

const Entry& entry_of(const std::string& name) {
  const auto found = registry<Entry>().find(name);
  if (found != registry<Entry>().end()) return found->second;
  const std::vector<std::string> names = physics_names();
  const std::string near = nearest(name, names);
  throw InputError(fmt::format("physics: {}: no such back end; there are {}{}", name, fmt::join(names, ", "),
                               near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
}

}  // namespace

PhysicsRegistration::PhysicsRegistration(const std::string& name, PhysicsText text, PhysicsFactory make) {
  assert(!text.contact_models.empty());
  enter(name, Entry{std::move(text), std::move(make)});
}

std::vector<std::string> physics_names() {
  std::vector<std::string> names = registered_names<Entry>();
  std::stable_partition(names.begin(), names.end(), [](const std::string& name) { return name == kDefaultPhysics; });
  return names;
}

const PhysicsText& physics_text(const std::string& physics) { return entry_of(physics).text; }

std::vector<std::string> contact_models_of(const std::string& physics) {
  std::vector<std::string> names;
  for (const PhysicsText::ContactModel& model : physics_text(physics).contact_models) names.push_back(model.name);
  return names;
}

std::unique_ptr<BlockPhysics> make_physics(const std::string& name, const Model& nominal) {
  const Entry& entry = entry_of(name);
  contact_model_index(nominal.contact_model, name, contact_models_of(name));
  for (const Body& body : nominal.bodies) {
    if (entry.text.knows_rotors || body.armature == 0) continue;
    throw InputError(
        fmt::format("physics: {}: does not know rotors of drives, and joint {} has one; take lanes", name, body.joint));
  }
  return entry.make(nominal);
}

}  // namespace graze
