#pragma once
// A figure as a file: drawn by gnuplot, written whole or not at all.

#include <filesystem>
#include <string>

#include "analysis/plots_script.h"

namespace graze {

/// Of a picture that another verb is asked for by --plot FILE. Throws InputError if the name is that of no picture, or
/// a file is in the way, MachineError if gnuplot is missing.
PlotStyle picture_style(const std::string& file, bool force);
/// The bytes of the file. Throws MachineError as drawn_by_gnuplot().
std::string drawn_figure(const Figure& figure, const PlotStyle& style, const std::filesystem::path& path);
/// Writes them and tells it on standard output (`tell`). Throws MachineError, and InputError if a file is in the way.
void write_picture(const std::filesystem::path& path, bool force, const std::string& bytes, bool tell = true);

}  // namespace graze
