#pragma once
// Where the parts of a figure stand: px from the upper left corner, before everything is scaled.

#include <string>
#include <utility>
#include <vector>

#include "analysis/plots_figure.h"
#include "analysis/plots_script.h"

namespace graze {

inline constexpr double kPlotBorder = 18, kTitleSize = 17, kTextSize = 12, kSmallSize = 11;  // px

/// One panel: its axes' ranges, its ticks, and the rectangle between the axes.
struct PlacedPanel {
  double left = 0, top = 0, right = 0, bottom = 0;
  double x_low = 0, x_high = 1, y_low = 0, y_high = 1;
  std::vector<std::pair<double, std::string>> x_ticks, y_ticks;
};

struct PlotLayout {
  double width = 0, height = 0;  // px
  double scale = 1;              // px of the picture for each of these
  struct Place {
    double x, y;  // middle of the left end
  };
  std::vector<Place> legend;
  double drawing_top = 0;
  std::vector<PlacedPanel> panels;
  std::vector<std::string> notes;  // lines
  double notes_top = 0;
};

PlotLayout plot_layout(const Figure& figure, const PlotStyle& style);

}  // namespace graze
