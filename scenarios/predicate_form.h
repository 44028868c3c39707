#pragma once
// How predicates are written: which keys make one, and what is refused because it cannot be meant.

#include <string>
#include <utility>
#include <vector>

#include "engine/settings/settings.h"

namespace graze {

/// The predicates that are made of others.
const std::vector<std::string>& inner_keys();
/// Witnesses before `keys`.
std::vector<std::string> with_names(std::vector<std::string> keys);
bool is_witness(const std::string& key);
bool is_predicate_key(const std::string& key);
/// Whether a map has a key that makes it a predicate.
bool names_a_predicate(const Settings& settings);

/// `objective: {over: {}}`, which may be a name without a predicate; what is near a witness is left to allow().
void refuse_empty_name(const std::string& key, const Settings& value);
/// `objective: {stands: {…}, far: {…}}`, as where a scenario adds one to that of what it includes.
void refuse_several(const std::vector<std::pair<std::string, Settings>>& entries);
/// What puts predicates together, or asks for them at some time, in a requirement or a measure.
void refuse_predicate(const Settings& settings);
/// `{nto: {height: …}}`: what is taken as a name, and is hardly meant as one, would turn the verdict around.
void check_objective_name(const std::string& name, const Settings& meant);

}  // namespace graze
