#pragma once
// A figure as a gnuplot script (gnuplot 5.4 or later), which draws on its standard output. Names come from archives,
// which may be anybody's: they stand in single quotes on a terminal without enhanced text, numbers in blocks of data.

#include <string>

#include "analysis/plots_figure.h"

namespace graze {

struct PlotStyle {
  enum class Format { svg, png };
  enum class Theme { light, dark };
  Format format = Format::svg;
  Theme theme = Theme::light;
  /// px; 0: the figure's own, twice that for PNG. Letters grow with the width; they are smaller where the height has no
  /// room for them.
  int width = 0, height = 0;
};

/// The same figure and style give the same text. Text that has no room is cut with "…".
std::string gnuplot_script(const Figure& figure, const PlotStyle& style);

/// What gnuplot drew as SVG, with what it cannot say put right.
std::string finished_svg(std::string drawn);

/// A colour as "#rrggbb".
std::string plot_rgb(PlotColor color, PlotStyle::Theme theme);

}  // namespace graze
