#include "jobs/cli/help_topics.h"

#include <fmt/format.h>

#include <utility>

#include "engine/physics.h"
#include "jobs/cli/description_text.h"
#include "jobs/cli/scenario_schema.h"
#include "jobs/cli/shipped.h"
#include "scenarios/components.h"

namespace graze {
namespace {

/// A scenario that cannot be read is listed all the same; `graze check` says what is wrong.
std::string name_line(const std::string& scenario) {
  try {
    return Settings::load((data_folder() / "scenarios" / (scenario + ".yaml")).string()).text_or("name", "");
  } catch (const InputError&) {
    return "";
  }
}

std::string scenarios_help() {
  std::vector<std::pair<std::string, std::string>> rows;
  for (const std::string& name : shipped_scenarios()) rows.emplace_back(name, name_line(name));
  if (rows.empty()) return "No scenarios were found; GRAZE_DATA names the folder that holds scenarios/ and robots/.\n";
  return list_text("Scenarios that come with the program, to be called by their names:", rows,
                   fmt::format("graze check NAME tells what is in one. The files: {}. More: docs/scenario.md",
                               (data_folder() / "scenarios").string()));
}

std::string physics_help() {
  std::vector<std::pair<std::string, std::string>> rows;
  for (const std::string& name : physics_names()) {
    const PhysicsText& text = physics_text(name);
    rows.emplace_back(name, text.help);
    for (const auto& [model, help] : text.contact_models) rows.emplace_back("  " + model, help);
  }
  return list_text("Back ends, what steps the bodies ('physics'), each with its contact models ('contact.model'):",
                   rows, "The first of each is the default. What they do and where they end: docs/physics.md.");
}

}  // namespace

std::vector<std::string> help_topics() {
  std::vector<std::string> out = {"scenarios"};
  for (const ComponentGroup& group : component_groups()) out.push_back(group.topic);
  out.push_back("schema");
  return out;
}

std::vector<std::string> component_topics() {
  std::vector<std::string> out;
  for (const ComponentGroup& group : component_groups()) {
    out.push_back(group.one);
    for (const Component& component : group.all) out.push_back(component.name);
  }
  return out;
}

std::optional<std::string> help_on(const std::string& topic) {
  if (topic == "scenarios") return scenarios_help();
  if (topic == "schema") return scenario_schema();
  if (topic == "physics") return physics_help();
  constexpr std::string_view kTable = "table:";  // for docs/, which alone ask for it
  if (topic.starts_with(kTable)) return docs_table(topic.substr(kTable.size()));
  std::string out;
  for (const ComponentGroup& group : component_groups()) {
    if (topic == group.topic || topic == group.one) return group_help(group);
    for (const Component& component : group.all) {
      if (component.name == topic) out += (out.empty() ? "" : "\n") + component_help(group, component);
    }
  }
  if (out.empty()) return std::nullopt;
  return out;
}

}  // namespace graze
