#pragma once
// Text as HDF5 and its readers want it, and as a terminal may have it.

#include <cstddef>
#include <string>
#include <string_view>

namespace graze {

/// True for all bytes of a character but its first.
constexpr bool continues_character(char byte) { return (static_cast<unsigned char>(byte) & 0xC0) == 0x80; }

/// Characters of a UTF-8 text, for columns; they are not bytes.
std::size_t width_of(std::string_view text);

/// `text` as valid UTF-8 without NUL: each byte that cannot stand where it stands becomes U+FFFD.
std::string valid_utf8(std::string_view text);

/// `text` with everything escaped that would do something to a terminal or hide what stands there: controls (C0, DEL,
/// C1) and marks that turn the direction of writing or end a line as \u001b, bytes that are no UTF-8 as \xff. Within
/// strings of JSON that is the same text. For names: one line.
std::string printable(std::string_view text);
/// The same for texts of several lines: line ends and tabs stay.
std::string printable_lines(std::string_view text);
/// The same for a message: lines after the first are indented, so that none of them can pose as another message.
std::string printable_message(std::string_view text);

}  // namespace graze
