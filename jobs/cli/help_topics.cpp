#include "jobs/cli/help_topics.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "engine/physics.h"
#include "jobs/cli/description_text.h"
#include "jobs/cli/key_topics.h"
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

std::string scenarios_help(std::size_t width) {
  std::vector<std::pair<std::string, std::string>> rows;
  for (const std::string& name : shipped_scenarios()) rows.emplace_back(name, name_line(name));
  if (rows.empty()) return "No scenarios were found; GRAZE_DATA names the folder that holds scenarios/ and robots/.\n";
  return list_text("Scenarios that come with the program, to be called by their names:", rows,
                   fmt::format("graze check NAME tells what is in one. The files: {}. More: docs/scenario.md",
                               (data_folder() / "scenarios").string()),
                   width);
}

/// On a shipped scenario, by its name.
std::optional<std::string> scenario_help(const std::string& topic, std::size_t width) {
  const std::vector<std::string> names = shipped_scenarios();
  if (std::find(names.begin(), names.end(), topic) == names.end()) return std::nullopt;
  return wrapped(fmt::format("{0}, a scenario that comes with the program: {1}\nThe file: {2}\n"
                             "graze check {0} tells what is in it, graze run {0} runs it.\n",
                             topic, name_line(topic), (data_folder() / "scenarios" / (topic + ".yaml")).string()),
                 width);
}

std::string topics_help(std::size_t width) {
  std::vector<std::pair<std::string, std::string>> rows = {
      {"VERB", "a verb's options, with examples (graze --help lists the verbs)"},
      {"scenarios", "those that come with the program; graze help NAME tells of one"}};
  for (const ComponentGroup& group : component_groups()) {
    rows.emplace_back(group.topic, fmt::format("what there is; graze help NAME tells of one {}", group.one));
  }
  rows.emplace_back("units", "quantities with the units that may stand behind a number");
  rows.emplace_back("schema", "the JSON Schema of a scenario, for editors");
  rows.emplace_back("KEY or PATH", "a key as it stands in a file: environment, uncertain, over, time.step, gait.duty");
  return list_text("graze help TOPIC … tells of each in turn:", rows, "More: docs/commands.md.", width);
}

std::string physics_help(std::size_t width) {
  std::vector<std::pair<std::string, std::string>> rows;
  for (const std::string& name : physics_names()) {
    const PhysicsText& text = physics_text(name);
    rows.emplace_back(name, text.help);
    for (const auto& [model, help] : text.contact_models) rows.emplace_back("  " + model, help);
  }
  return list_text("Back ends, what steps the bodies ('physics'), each with its contact models ('contact.model'):",
                   rows, "The first of each is the default. What they do and where they end: docs/physics.md.", width);
}

}  // namespace

std::vector<std::string> help_topics() {
  std::vector<std::string> out = {"scenarios"};
  for (const ComponentGroup& group : component_groups()) out.push_back(group.topic);
  for (const char* more : {"units", "schema", "help"}) out.emplace_back(more);
  return out;
}

std::vector<std::string> component_topics() {
  std::vector<std::string> out;
  for (const ComponentGroup& group : component_groups()) {
    out.push_back(group.one);
    for (const Component& component : group.all) out.push_back(component.name);
  }
  for (const auto& more : {shipped_scenarios(), key_topics()}) out.insert(out.end(), more.begin(), more.end());
  return out;
}

namespace {

/// On a kind of components or all components of a name.
std::optional<std::string> components_help(const std::string& topic, std::size_t width) {
  std::string out;
  for (const ComponentGroup& group : component_groups()) {
    if (topic == group.topic || topic == group.one) return group_help(group, width);
    for (const Component& component : group.all) {
      if (component.name == topic) out += (out.empty() ? "" : "\n") + component_help(group, component, width);
    }
  }
  if (topic == "control") {  // the key of a policy, beside the section
    out += "\n" + wrapped(
                      "Below a policy's name, control holds the tracker that follows it: control: {TRACKER: {…}}, "
                      "as control: {joint_pd: {kp: 20}}. graze help trackers lists them.\n",
                      width);
  }
  if (out.empty()) return std::nullopt;
  return out;
}

/// A name of the documentation's, of which the program itself has nothing to say.
std::optional<std::string> page_help(const std::string& topic, std::size_t width) {
  const std::filesystem::path docs = docs_folder(), page = docs / (topic + ".md");
  const bool plain = topic.find_first_not_of("abcdefghijklmnopqrstuvwxyz_") == std::string::npos;
  std::error_code unknown;
  if (docs.empty() || topic.empty() || !plain || !std::filesystem::is_regular_file(page, unknown)) return std::nullopt;
  const std::string more = topic == "controllers"
                               ? " Controllers of your own are policies: graze help library (C, C++), python, network."
                               : "";
  return wrapped(fmt::format("A page of the documentation tells of it: {}.{}\n", page.string(), more), width);
}

}  // namespace

std::optional<std::string> help_on(const std::string& topic, std::size_t width) {
  if (topic == "help") return topics_help(width);
  if (topic == "scenarios") return scenarios_help(width);
  if (topic == "schema") return scenario_schema();
  if (topic == "physics") return physics_help(width);
  constexpr std::string_view kTable = "table:";  // for docs/, which alone ask for it
  if (topic.starts_with(kTable)) return docs_table(topic.substr(kTable.size()));
  for (const auto& kind : {components_help, map_help, scenario_help, key_help, page_help}) {
    if (const auto out = kind(topic, width)) return out;
  }
  return std::nullopt;
}

}  // namespace graze
