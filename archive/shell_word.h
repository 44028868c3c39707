#pragma once
// Commands that messages and tables give to be pasted into a shell.

#include <string>

namespace graze {

/// A word as a shell reads it back: as it is if it has plain characters only, else in single quotes.
std::string shell_word(const std::string& word);

}  // namespace graze
