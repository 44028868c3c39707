#pragma once
// How the option parser lays out the help of a verb: lines that fit, examples as they are typed.

#include <CLI/CLI.hpp>
#include <memory>

namespace graze {

/// For CLI::App::formatter(); lines have at most `width` characters (jobs/cli/wrapped_text.h), but for examples, which
/// are indented and are to be copied.
std::shared_ptr<CLI::Formatter> help_format(std::size_t width);

}  // namespace graze
