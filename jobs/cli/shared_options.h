#pragma once
// Arguments that several verbs have, with one name and one help text.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace graze {

/// The archive that the verb reads, its next argument in place. `name`: as its help calls it.
CLI::Option* add_archive(CLI::App& verb, std::string& archive, const std::string& name = "archive");
/// --policy, as often as there are globs; chosen_names() says which policies they choose.
CLI::Option* add_policies(CLI::App& verb, std::vector<std::string>& policies);

/// --trust, of verbs that simulate.
void add_trust(CLI::App& verb);

}  // namespace graze
