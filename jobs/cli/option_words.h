#pragma once
// The words of a command line against the options of its verb, before the option parser reads them. It would take an
// option for a value, make an unknown option's value an argument, and name neither the place nor the nearest right
// answer.

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

namespace graze {

/// Throws InputError if the first word is no verb of `app` (nor an option of its own), or one of the others is an
/// option that the verb does not have, an empty value, an option in a value's place, or an option for the second
/// time that may be given once. A verb that allows extra words passes them on to `run`, and so has its options, too.
void check_words(const CLI::App& app, const std::vector<std::string>& words);

/// `graze help TOPIC …`: what is told of each topic (jobs/cli/help_topics.h) or verb, one after the other, in lines of
/// at most `width` characters; nothing if the words ask for no topic. Throws InputError with the nearest if one of them
/// is neither.
std::optional<std::string> topics_asked_for(const CLI::App& app, const std::vector<std::string>& words,
                                            std::size_t width);

/// The words that ask for what help there is in them: `help`, `help VERB`, `VERB … --help`; else the words as they are.
std::vector<std::string> as_help(const std::vector<std::string>& words);

/// A mistake that only the option parser could find, in the words of all others.
std::string parse_error_text(const CLI::App& app, const CLI::ParseError& error);

}  // namespace graze
