#include "jobs/cli/help_topics.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/control/policy.h"
#include "engine/physics.h"
#include "jobs/cli/shipped.h"
#include "scenarios/witnesses.h"

namespace graze {
namespace {

using Rows = std::vector<std::pair<std::string, std::string>>;

std::string table(const std::string& title, const Rows& rows, const std::string& more) {
  std::size_t width = 0;
  for (const auto& [name, help] : rows) width = std::max(width, name.size());
  std::string out = title + "\n\n";
  for (const auto& [name, help] : rows) {
    out += help.empty() ? fmt::format("  {}\n", name) : fmt::format("  {:{}}  {}\n", name, width, help);
  }
  return out + "\n" + more + "\n";
}

/// A scenario that cannot be read is listed all the same; `graze check` says what is wrong.
std::string name_line(const std::string& scenario) {
  try {
    return Settings::load((data_folder() / "scenarios" / (scenario + ".yaml")).string()).text_or("name", "");
  } catch (const InputError&) {
    return "";
  }
}

std::string scenarios_help() {
  Rows rows;
  for (const std::string& name : shipped_scenarios()) rows.emplace_back(name, name_line(name));
  if (rows.empty()) return "No scenarios were found; GRAZE_DATA names the folder that holds scenarios/ and robots/.\n";
  return table("Scenarios that come with the program, to be called by their names:", rows,
               fmt::format("graze check NAME tells what is in one. The files: {}. More: docs/scenario.md",
                           (data_folder() / "scenarios").string()));
}

std::string policies_help() {
  Rows rows;
  for (const std::string& name : policy_names()) rows.emplace_back(name, policy_text(name).help);
  return table("Policies, what a robot wants, each with a tracker under 'control':", rows,
               "Their keys: docs/control.md, Policies. graze help trackers tells what follows them.");
}

std::string trackers_help() {
  Rows rows;
  for (const std::string& name : tracker_names()) rows.emplace_back(name, tracker_text(name).help);
  return table("Trackers, how the joints get there, each under 'control' of a policy:", rows,
               "Their keys: docs/control.md, Trackers. graze help policies tells what they follow.");
}

std::string witnesses_help() {
  Rows rows;
  for (const WitnessKind& kind : witness_kinds()) rows.emplace_back(kind.name, kind.help);
  return table("Witnesses, what requirements, measures and objectives are made of:", rows,
               "Their keys and margins: docs/scenario.md, task.");
}

std::string physics_help() {
  Rows rows;
  for (const std::string& name : physics_names()) {
    const PhysicsText& text = physics_text(name);
    rows.emplace_back(name, text.help);
    for (const auto& [model, help] : text.contact_models) rows.emplace_back("  " + model, help);
  }
  return table("Back ends, what steps the bodies ('physics'), each with its contact models ('contact.model'):", rows,
               "The first of each is the default. What they do and where they end: docs/physics.md.");
}

}  // namespace

const std::vector<std::string>& help_topics() {
  static const std::vector<std::string> topics = {"scenarios", "policies", "trackers", "witnesses", "physics"};
  return topics;
}

std::optional<std::string> help_on(const std::string& topic) {
  if (topic == "scenarios") return scenarios_help();
  if (topic == "policies") return policies_help();
  if (topic == "trackers") return trackers_help();
  if (topic == "witnesses") return witnesses_help();
  if (topic == "physics") return physics_help();
  return std::nullopt;
}

}  // namespace graze
