#pragma once
// Options with typed values. One grammar for all verbs, and one style of complaint: the option, what was given, the
// rule, the nearest right answer.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace graze {

/// Reads a whole number of decimal digits (010 is ten). Throws InputError, which says `option`, if it is none or lies
/// outside of [least, most].
std::uint64_t parse_whole(const std::string& text, const std::string& option, std::uint64_t least, std::uint64_t most);

/// Reads a time in seconds, or with a unit ("0.5 s", "500 ms"), that is 0 or within [least, most] s. Throws InputError
/// as parse_whole.
double parse_seconds(const std::string& text, const std::string& option, double least, double most);

/// An option whose one value `read` takes; `read` may throw InputError. It is told the option's long name.
CLI::Option* add_read_option(CLI::App& verb, const std::string& names, const std::string& description,
                             std::function<void(const std::string& text, const std::string& option)> read);

/// An option whose value is a whole number within [least, most]. T: an integer that holds them, or std::optional of
/// one.
template <class T>
CLI::Option* add_whole(CLI::App& verb, const std::string& names, T& value, std::uint64_t least, std::uint64_t most,
                       const std::string& description) {
  return add_read_option(verb, names, description,
                         [&value, least, most](const std::string& text, const std::string& option) {
                           value = static_cast<T>(parse_whole(text, option, least, most));
                         })
      ->type_name(std::to_string(least) + ".." + std::to_string(most));
}

/// An option whose value is one of `choices`.
CLI::Option* add_choice(CLI::App& verb, const std::string& names, std::string& value,
                        const std::vector<std::string>& choices, const std::string& description);

}  // namespace graze
