#pragma once
// How the option parser lays out the help of a verb: lines that fit, examples as they are typed.

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

namespace graze {

/// For CLI::App::formatter(); lines have at most `width` characters (jobs/cli/wrapped_text.h), but for examples, which
/// are indented and are to be copied. `usage`: a line in place of the one that the parser makes, if it is not empty.
std::shared_ptr<CLI::Formatter> help_format(std::size_t width, const std::string& usage = "");

}  // namespace graze
