#pragma once
// Descriptions as text, for `graze help`, and as Markdown, for the tables of docs/. Lines of help have at most `width`
// characters (jobs/cli/wrapped_text.h).

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "jobs/cli/wrapped_text.h"
#include "scenarios/components.h"

namespace graze {

/// "gait, a policy: walks …", the table of its keys, and what else must be known.
std::string component_help(const ComponentGroup& group, const Component& component, std::size_t width = kUnlimited);
/// The group's components with a line each.
std::string group_help(const ComponentGroup& group, std::size_t width = kUnlimited);
/// The table of some keys: key, value, default, meaning.
std::string keys_text(const std::vector<KeyRow>& keys, std::size_t width = kUnlimited);

/// A row for each component: how it is written, the unit of a witness, what it is.
std::string group_table(const ComponentGroup& group);
/// A row for each key: how it is written, its default, what it is.
std::string key_table(const Component& component);
/// Of "policies" the rows of that kind, of "policy gait" those of its keys: what tests/docs/tables.py puts into docs/.
/// Nothing if there is none.
std::optional<std::string> docs_table(const std::string& name);

/// Two columns and what stands above and below.
std::string list_text(const std::string& title, const std::vector<std::pair<std::string, std::string>>& rows,
                      const std::string& more, std::size_t width = kUnlimited);

}  // namespace graze
