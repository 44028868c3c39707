#pragma once
// Columns and grids of numbers from CSV files that a scenario names.

#include <string>
#include <vector>

#include "engine/settings/settings.h"

namespace graze {

/// Rows of numbers of a file without a header (a grid of heights). Separators: comma, semicolon, white space; empty
/// lines and lines that begin with # are passed over. All rows have as many numbers. Throws InputError at `where`, or
/// with the file's line; also for more than `most` numbers, and for a line with comma and semicolon, one of which is
/// meant as a decimal comma.
std::vector<std::vector<double>> read_grid(const Settings& where, std::size_t most);

/// The numbers below `column` (a name of the header line) of `file`, in `unit` if one is given: the keys of
/// `settings`. Throws InputError.
std::vector<double> read_column(const Settings& settings, Quantity quantity);

}  // namespace graze
