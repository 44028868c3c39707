#pragma once
// Text in lines that fit: paragraphs and tables of help, broken between words.

#include <string>
#include <string_view>
#include <vector>

namespace graze {

/// No limit: a paragraph, or a row of a table, is one line. So is what goes to a file or a pipe, for grep and scripts.
constexpr std::size_t kUnlimited = 0;

/// How many characters a line of standard output may have: what the environment's COLUMNS says, else what the terminal
/// is wide; kUnlimited if it is neither told nor a terminal.
std::size_t output_width();

/// `text` padded with blanks to `width` characters.
std::string padded(const std::string& text, std::size_t width);

/// `text` in lines of at most `width` characters; a longer word has a line of its own. kUnlimited:
/// one line.
std::vector<std::string> lines_of(std::string_view text, std::size_t width);

/// The lines of `text` each wrapped to `width`, the rest of a line that is wrapped indented by `indent` more than its
/// beginning.
std::string wrapped(std::string_view text, std::size_t width, std::size_t indent = 0);

/// Columns with `gap` blanks between them and two in front, cells wrapped within their columns. The first column is
/// never broken; the widest of the others give way first.
std::string columns_text(const std::vector<std::vector<std::string>>& rows, std::size_t width, std::size_t gap = 2);

}  // namespace graze
