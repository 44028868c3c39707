#pragma once
// A picture of a campaign as data: panels with axes and what is drawn in them, a legend, sentences. What the numbers
// mean is decided where a figure is made (plots.h), how they look where its script is written (plots_script.h).

#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace graze {

/// Colours by their role; both themes have one for each (those of the report's page).
enum class PlotColor {
  ink,
  soft,
  rule,
  panel,
  success,
  known,
  unknown,
  invalid,
  pale,     // of what is not significant
  policy_0  // … policy_0 + 7
};
inline constexpr std::size_t kPolicyColors = 8;
/// Of the i-th policy of a campaign; they come again after eight.
inline PlotColor policy_color(std::size_t i) {
  return static_cast<PlotColor>(static_cast<std::size_t>(PlotColor::policy_0) + i % kPolicyColors);
}

/// Marks that are told apart without their colours.
enum class PlotMark { circle, cross, triangle, square, diamond };

struct PlotAxis {
  std::string title;
  /// Its range; NaN: that of what is drawn, and a little more.
  double low = std::numeric_limits<double>::quiet_NaN(), high = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::pair<double, std::string>> labels = {};  // in place of numbers
  bool grid = true;
  bool zero = false;  // a line at 0
};

/// One set of data in one colour.
struct PlotSeries {
  enum class Kind {
    line,   // through x, y; NaN breaks it; low, high: a band
    marks,  // at x, y
    tall,   // at x, y with a bar from low to high
    wide,   // at x, y with a bar from low to high along x
    boxes   // from x to high, along y from y to low
  };
  Kind kind = Kind::line;
  PlotColor color = PlotColor::ink;
  std::vector<double> x, y, low = {}, high = {};
  PlotMark mark = PlotMark::circle;
  double width = 1.8;  // of lines; marks: diameter; px
  bool dashed = false;
  bool faint = false;  // see-through: there are many
};

/// Words at a place of a panel's axes.
struct PlotWords {
  double x = 0, y = 0;
  std::string text;
  PlotColor color = PlotColor::soft;
};

struct PlotPanel {
  std::string title;
  PlotAxis x, y;
  std::vector<PlotSeries> series = {};
  std::vector<PlotWords> words = {};  // begin at their place
  std::string instead = {};           // a sentence where there is nothing to draw
  double height = 260;                // px, between the axes
  bool one_scale = false;             // along both axes
};

struct PlotLegend {
  enum class Kind { box, line, dashed, mark };
  std::string text;
  PlotColor color = PlotColor::ink;
  Kind kind = Kind::box;
  PlotMark mark = PlotMark::circle;
};

/// Boxes and arrows in px from the upper left, below the legend: trees.
struct PlotDrawing {
  struct Box {
    double left, top, right, bottom;
    PlotColor fill = PlotColor::panel;
    bool outline = false;
  };
  struct Arrow {
    double x_from, y_from, x_to, y_to, width;
  };
  struct Text {
    double x, y;  // of its left end, half its height
    std::string text;
    double size = 11;
    PlotColor color = PlotColor::ink;
    bool bold = false;
    double room = 1e9;  // px that it may take
  };
  struct Mark {
    double x, y;
    PlotColor color;
  };
  std::vector<Box> boxes;
  std::vector<Arrow> arrows;
  std::vector<Text> texts;
  std::vector<Mark> diamonds;
  double height = 0;
};

struct Figure {
  std::string name;  // of the picture: "success"
  std::string title, subtitle = {};
  std::vector<PlotLegend> legend = {};
  PlotDrawing drawing = {};
  std::vector<PlotPanel> panels = {};
  std::size_t columns = 1;              // that panels stand in
  std::vector<std::string> notes = {};  // below everything
  double width = 800;                   // px, at which letters are 11 … 16 px high
};

}  // namespace graze
