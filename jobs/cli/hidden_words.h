#pragma once
// Words that no help lists, for shells and the build.

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

namespace graze {

/// `complete -- WORDS` prints what a shell may offer (jobs/cli/completion.h), `manual FOLDER` writes the manual pages.
/// Returns the exit code, nothing if the words are others.
std::optional<int> hidden_words(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace graze
