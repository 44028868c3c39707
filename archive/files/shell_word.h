#pragma once
// Commands that messages and tables give to be pasted into a shell.

#include <string>

namespace graze {

/// A word as a shell reads it back: as it is if it has plain characters only, else in single quotes; as $'a\nb', which
/// bash, ksh, zsh and POSIX.1-2024 read, if it holds what a terminal does not show as it is (archive/files/utf8.h).
std::string shell_word(const std::string& word);

/// The same for a path: "./-a.graze" is not taken for an option.
std::string shell_path(const std::string& path);

/// "--policy still", or "--policy=-still", which is not taken for an option.
std::string shell_option(const std::string& name, const std::string& value);

}  // namespace graze
