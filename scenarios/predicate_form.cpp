#include "scenarios/predicate_form.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "engine/settings/warnings.h"
#include "scenarios/keys.h"
#include "scenarios/witnesses.h"

namespace graze {

const std::vector<std::string>& inner_keys() {
  static const std::vector<std::string> keys = {"all", "any", "not"};
  return keys;
}

std::vector<std::string> with_names(std::vector<std::string> keys) {
  const std::vector<std::string> names = witness_names();
  keys.insert(keys.begin(), names.begin(), names.end());
  return keys;
}

bool is_witness(const std::string& key) {
  const std::vector<std::string> names = witness_names();
  return std::find(names.begin(), names.end(), key) != names.end();
}

void refuse_empty_name(const std::string& key, const Settings& value) {
  const std::vector<std::string> known = with_names(predicate_description().names());
  if (!nearest(key, known).empty() || !(value.is_map() || value.is_null())) return;
  value.allow(known);  // a name, and what stands under it is misspelt
  value.fail_key(
      fmt::format("is no witness, and as the objective's name it needs a predicate: {}: {{WITNESS: …}}; "
                  "witnesses: {}",
                  key, fmt::join(witness_names(), ", ")));
}

void refuse_several(const std::vector<std::pair<std::string, Settings>>& entries) {
  const auto named = [](const auto& one) { return !is_predicate_key(one.first) && names_a_predicate(one.second); };
  if (entries.size() < 2 || !std::all_of(entries.begin(), entries.end(), named)) return;
  std::vector<std::string> names;
  for (const auto& [name, predicate] : entries) names.push_back(name);
  entries[1].second.fail_key(
      fmt::format("is a second objective, and a scenario has one: {}; several predicates make one by all: [{{…}}, "
                  "{{…}}], and '{}: ~' takes away what an include brings",
                  fmt::join(names, ", "), names.front()));
}

void refuse_predicate(const Settings& settings) {
  const std::vector<std::string> own = requirement_description().names();
  for (const std::string& key : predicate_description().names()) {
    if (!settings.is_map() || !settings.has(key) || std::find(own.begin(), own.end(), key) != own.end()) continue;
    settings.at(key).fail_key(
        fmt::format("belongs to objectives; a requirement or a measure is one witness, which holds at every step: "
                    "write several of them, or task: {{objective: {{{}: …}}}}",
                    key));
  }
}

void check_objective_name(const std::string& name, const Settings& meant) {
  if (name.empty()) meant.fail_key("an objective needs a name, or none and no map around it");
  // One predicate under 'all' or 'any' is judged as it is alone, and a list under their like is refused.
  const std::string near = nearest(name, {"not", "once", "always"});
  if (near.empty()) return;
  const bool inner = near == "not";
  warn(meant, fmt::format("'{}' is taken as the objective's name, so the predicate is judged without it; did you "
                          "mean '{}'{}?",
                          name, near, inner ? "" : ", which stands beside the witness"));
}

bool is_predicate_key(const std::string& key) {
  const std::vector<std::string> keys = with_names(inner_keys());
  return std::find(keys.begin(), keys.end(), key) != keys.end();
}

bool names_a_predicate(const Settings& settings) {
  if (!settings.is_map()) return false;
  for (const auto& [key, value] : settings.entries()) {
    if (is_predicate_key(key)) return true;
  }
  return false;
}

}  // namespace graze
