#include "scenarios/components.h"

#include "engine/control/policy.h"
#include "engine/model/channels.h"
#include "engine/physics.h"
#include "scenarios/distributions.h"
#include "scenarios/keys.h"
#include "scenarios/shapes.h"
#include "scenarios/witnesses.h"

namespace graze {
namespace {

template <class Kinds>
std::vector<Component> of_kinds(const Kinds& kinds) {
  std::vector<Component> out;
  for (const auto& kind : kinds) out.push_back({kind.name, kind.text, {}});
  return out;
}

std::vector<Component> policies() {
  std::vector<Component> out;
  for (const std::string& name : policy_names()) out.push_back({name, policy_text(name), {}});
  return out;
}

std::vector<Component> trackers() {
  std::vector<Component> out;
  for (const std::string& name : tracker_names()) out.push_back({name, tracker_text(name), {}});
  return out;
}

std::vector<Component> witnesses() {
  std::vector<Component> out;
  for (const WitnessKind& kind : witness_kinds()) out.push_back({kind.name, kind.text, kind.unit});
  return out;
}

std::vector<Component> distributions() {
  std::vector<Component> out = of_kinds(distribution_kinds());
  out.push_back({"noise", noise_description(), {}});
  out.push_back({"cone", cone_description(), {}});
  return out;
}

std::vector<Component> back_ends() {
  std::vector<Component> out;
  for (const std::string& name : physics_names()) {
    std::string models;
    for (const std::string& model : contact_models_of(name)) models += (models.empty() ? "" : ", ") + model;
    out.push_back({name, {physics_text(name).help, {}, {}, {}, "Contact models: " + models + "."}, {}});
  }
  return out;
}

std::vector<Component> contact_models() {
  std::vector<Component> out;
  for (const std::string& name : physics_names()) {
    for (const auto& [model, help] : physics_text(name).contact_models) {
      out.push_back({model, {help, {}, {}, {}, "Of physics: " + name + "."}, {}});
    }
  }
  return out;
}

/// In the order of a scenario.
std::vector<Component> sections() {
  std::vector<Component> out;
  for (const char* name :
       {"scenario",     "robot",      "hull",        "initial", "object", "contact", "pair",
        "disturbance",  "time",       "actuators",   "control", "spread", "jitter",  "correlated",
        "sampling",     "task",       "requirement", "record",  "phases", "design",  "design_variable",
        "design_total", "design_task"}) {
    out.push_back({name, section_of(name), {}});
  }
  return out;
}

}  // namespace

const std::vector<ComponentGroup>& component_groups() {
  static const std::vector<ComponentGroup> groups = {
      {"sections", "section", "Sections of a scenario:", "More: docs/scenario.md.", sections()},
      {"policies", "policy", "Policies, what a robot wants, each with a tracker under 'control':",
       "graze help trackers tells what follows them. More: docs/control.md, Policies.", policies()},
      {"trackers", "tracker", "Trackers, how the joints get there, each under 'control' of a policy:",
       "graze help policies tells what they follow. More: docs/control.md, Trackers.", trackers()},
      {"sensors", "sensor", "Sensors and actuators, whose channels err as 'uncertain' says:",
       "More: docs/control.md, Actuators and sensors.", of_kinds(channel_families())},
      {"shapes", "shape", "Shapes of the objects of an environment:", "More: docs/scenario.md, environment.",
       of_kinds(shape_forms())},
      {"distributions", "distribution", "Distributions of uncertain parameters:", "More: docs/scenario.md, uncertain.",
       distributions()},
      {"witnesses", "witness", "Witnesses, what requirements, measures and objectives are made of:",
       "graze help objective tells how they are put together. More: docs/scenario.md, task.", witnesses()},
      {"objectives",
       "objective",
       "Objectives:",
       "More: docs/scenario.md, task.",
       {{"objective", section_of("predicate"), {}}}},
      {"physics", "back end", "Back ends, what steps the bodies ('physics'):",
       "graze help contact_models lists what each can have. More: docs/physics.md.", back_ends()},
      {"contact_models", "contact model", "Contact models ('contact.model'):",
       "The first of each back end is its default. More: docs/physics.md.", contact_models()},
  };
  return groups;
}

}  // namespace graze
