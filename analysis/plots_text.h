#pragma once
// Words and numbers of pictures: how long they are, and how gnuplot is told of them.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace graze {

/// A text as gnuplot's language has it: in single quotes, in which nothing is a command, a format or an escape. A quote
/// within becomes an apostrophe (U+2019): gnuplot 5.4 takes a doubled one for the end where a text begins with it.
/// Controls and what is no UTF-8 are escaped as printable() does.
std::string plot_quoted(std::string_view text);

/// About how long a text is, px, in a sans-serif font of that size; rather too long than too short.
double plot_width(std::string_view text, double size);
/// A text, or as much of its beginning as has room, with "…".
std::string plot_fitted(const std::string& text, double size, double room);
/// Lines of a paragraph.
std::vector<std::string> plot_lines(const std::string& text, double size, double room);

/// With so many significant digits, as short as may be: "−0.25", "3e−5".
std::string plot_number(double x, int digits = 4);
/// "name [unit]"; without a unit if it is 1 or empty.
std::string plot_titled(const std::string& name, const std::string& unit);
/// Round numbers within [low, high], about `count` of them, with their texts.
std::vector<std::pair<double, std::string>> plot_ticks(double low, double high, double count);

}  // namespace graze
