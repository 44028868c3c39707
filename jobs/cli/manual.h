#pragma once
// Manual pages, made from the texts of --help.

#include <CLI/CLI.hpp>
#include <map>
#include <string>

namespace graze {

/// Pages in the language of man(7) by file name: "graze.1", and of each verb "graze-VERB.1". `app`: with all verbs.
std::map<std::string, std::string> manual_pages(const CLI::App& app);

/// Writes them into a folder, which is made. Throws MachineError.
void write_manual(const CLI::App& app, const std::string& folder);

}  // namespace graze
