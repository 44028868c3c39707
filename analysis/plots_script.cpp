#include "analysis/plots_script.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "analysis/plots_layout.h"
#include "analysis/plots_text.h"

namespace graze {
namespace {

// Those of analysis/web/src/style.css, in the order of PlotColor; `pale` is not on the page.
constexpr std::array<const char*, 17> kLight = {"#1b1f24", "#59636e", "#e1e5ea", "#f6f7f9", "#0077bb", "#cc3311",
                                                "#e69f00", "#8a939d", "#c3cad2", "#4477aa", "#d1495b", "#228833",
                                                "#b8860b", "#33a3cc", "#aa3377", "#7a6a58", "#555f6b"};
constexpr std::array<const char*, 17> kDark = {"#e6e9ed", "#9aa5b1", "#2f363f", "#1c2026", "#45a5e6", "#f0694c",
                                               "#f2b632", "#79828c", "#4a535e", "#77aadd", "#ee8090", "#55bb66",
                                               "#ddcc55", "#77d5f0", "#dd77bb", "#b5a48f", "#98a3af"};
constexpr const char *kLightPaper = "#ffffff", *kDarkPaper = "#14171b";

// Diameter of a mark of gnuplot's size 1, px.
constexpr double kPointOfSvg = 15, kPointOfPng = 7;

int point_type(PlotMark mark) {
  switch (mark) {
    case PlotMark::circle:
      return 7;
    case PlotMark::cross:
      return 2;
    case PlotMark::triangle:
      return 9;
    case PlotMark::square:
      return 5;
    case PlotMark::diamond:
      return 13;
  }
  return 7;
}

/// Writes the commands of one figure.
class ScriptWriter {
 public:
  ScriptWriter(const Figure& figure, const PlotStyle& style)
      : figure_(figure), style_(style), layout_(plot_layout(figure, style)) {}

  std::string text() {
    for (const PlotPanel& panel : figure_.panels) {
      for (const PlotSeries& one : panel.series) add_data(one);
    }
    begin();
    add_page();
    std::size_t block = 0;
    for (std::size_t i = 0; i < figure_.panels.size(); ++i) add_panel(figure_.panels[i], layout_.panels[i], block);
    add("unset multiplot\n");
    return std::move(out_);
  }

 private:
  template <class... Values>
  void add(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(out_), format, std::forward<Values>(values)...);
  }
  std::string rgb(PlotColor color) const { return plot_rgb(color, style_.theme); }
  double px(double length) const { return length * layout_.scale; }
  /// gnuplot takes sizes of fonts as pixels in SVG, as points of 1/72 inch at 96 pixels per inch in PNG.
  double font_size(double size) const {
    constexpr double kPointsPerPixel = 0.75;
    return px(size) * (style_.format == PlotStyle::Format::svg ? 1 : kPointsPerPixel);
  }
  double point_size(double diameter) const {
    return px(diameter) / (style_.format == PlotStyle::Format::svg ? kPointOfSvg : kPointOfPng);
  }
  std::string at(double x, double y) const {
    return fmt::format("screen {:.6f}, screen {:.6f}", x / layout_.width, 1 - y / layout_.height);
  }

  // Data: numbers alone, so that nothing in them can end a block.
  void add_data(const PlotSeries& one) {
    const bool band = one.kind == PlotSeries::Kind::line && !one.low.empty();
    if (band) {
      add("$d{} << EOD\n", next_++);
      for (std::size_t i = 0; i < one.x.size(); ++i) add_row({one.x[i], one.low[i], one.high[i]}, false);
      add("EOD\n");
    }
    add("$d{} << EOD\n", next_++);
    bool any = false;
    for (std::size_t i = 0; i < one.x.size(); ++i) {
      std::vector<double> row = {one.x[i], one.y[i]};
      const bool spread = one.kind == PlotSeries::Kind::tall || one.kind == PlotSeries::Kind::wide;
      if (spread) row.insert(row.end(), {one.low[i], one.high[i]});
      // boxxyerror: a point within, and the four sides.
      if (one.kind == PlotSeries::Kind::boxes) row = {one.x[i], one.y[i], one.x[i], one.high[i], one.y[i], one.low[i]};
      any = add_row(row, one.kind == PlotSeries::Kind::line && any) || any;
    }
    add("EOD\n");
    drawn_.push_back(any);
  }
  /// Where a number is missing a blank line, if it shall break what is drawn, or nothing.
  bool add_row(const std::vector<double>& row, bool breaks) {
    for (const double x : row) {
      if (std::isfinite(x)) continue;
      if (breaks) add("\n");
      return false;
    }
    for (std::size_t i = 0; i < row.size(); ++i) add("{}{:.7g}", i > 0 ? " " : "", row[i]);
    add("\n");
    return true;
  }

  void begin() {
    const bool svg = style_.format == PlotStyle::Format::svg;
    const auto whole = [](double x) { return std::lround(x); };
    add("set encoding utf8\n");
    add("set terminal {} size {},{} font '{},{:.2f}' background '{}' noenhanced{}\n", svg ? "svg" : "pngcairo",
        whole(px(layout_.width)), whole(px(layout_.height)), family(), font_size(kTextSize),
        style_.theme == PlotStyle::Theme::light ? kLightPaper : kDarkPaper, svg ? " name 'graze'" : "");
    add("set multiplot\nunset key\nset tics nomirror scale 0\nset samples 2\n");
  }
  std::string family() const { return style_.format == PlotStyle::Format::svg ? "sans-serif" : "Sans"; }

  void label(double x, double y, const std::string& text, double size, PlotColor color, const char* where = "left",
             bool bold = false, bool turned = false) {
    if (text.empty()) return;
    add("set label {} at {} {}{} noenhanced front font '{}{},{:.2f}' tc rgb '{}'\n", plot_quoted(text), at(x, y), where,
        turned ? " rotate by 90" : "", family(), bold ? ":Bold" : "", font_size(size), rgb(color));
  }
  void mark(double x, double y, PlotMark shape, double diameter, PlotColor color) {
    add("set label '' at {} point pt {} ps {:.3f} lw {:.2f} lc rgb '{}' front\n", at(x, y), point_type(shape),
        point_size(diameter), px(1.4), rgb(color));
  }
  void line(double x0, double y0, double x1, double y1, PlotColor color, double width, bool dashed = false) {
    add("set arrow from {} to {} nohead lw {:.2f} lc rgb '{}'{} front\n", at(x0, y0), at(x1, y1), px(width), rgb(color),
        dashed ? " dt 2" : "");
  }
  void box(const PlotDrawing::Box& one) {
    add("set object rectangle from {} to {} behind fc rgb '{}' fs solid {}\n", at(one.left, one.top),
        at(one.right, one.bottom), rgb(one.fill),
        one.outline ? fmt::format("border lc rgb '{}' lw {:.2f}", rgb(PlotColor::rule), px(1.2)) : "noborder");
  }

  /// Everything that stands in no panel.
  void add_page() {
    add("set lmargin at screen 0\nset rmargin at screen 1\nset tmargin at screen 1\nset bmargin at screen 0\n");
    add("set border 0\nunset tics\nset xrange [0:1]\nset yrange [0:1]\n");
    const double room = layout_.width - 2 * kPlotBorder;
    label(kPlotBorder, kPlotBorder + 10, plot_fitted(figure_.title, kTitleSize * 1.06, room), kTitleSize,
          PlotColor::ink, "left", true);
    label(kPlotBorder, kPlotBorder + 33, plot_fitted(figure_.subtitle, kTextSize, room), kTextSize, PlotColor::soft);
    for (std::size_t i = 0; i < figure_.legend.size(); ++i) add_legend(figure_.legend[i], layout_.legend[i]);
    add_drawing();
    constexpr double kNoteLine = 15;
    for (std::size_t i = 0; i < layout_.notes.size(); ++i) {
      label(kPlotBorder, layout_.notes_top + kNoteLine * (static_cast<double>(i) + 0.5), layout_.notes[i], kSmallSize,
            PlotColor::soft);
    }
    add("plot NaN notitle\nunset label\nunset arrow\nunset object\n");
  }
  void add_legend(const PlotLegend& one, PlotLayout::Place place) {
    const double x = place.x + 9;
    switch (one.kind) {
      case PlotLegend::Kind::box:
        box({x - 6, place.y - 6, x + 6, place.y + 6, one.color});
        break;
      case PlotLegend::Kind::line:
      case PlotLegend::Kind::dashed:
        line(x - 9, place.y, x + 9, place.y, one.color, 2.4, one.kind == PlotLegend::Kind::dashed);
        break;
      case PlotLegend::Kind::mark:
        mark(x, place.y, one.mark, 8, one.color);
    }
    constexpr double kBehindMark = 16;
    label(x + kBehindMark, place.y, plot_fitted(one.text, kTextSize, layout_.width - x - 2 * kPlotBorder), kTextSize,
          PlotColor::ink);
  }
  void add_drawing() {
    const double down = layout_.drawing_top;
    for (PlotDrawing::Box one : figure_.drawing.boxes) {
      one.top += down;
      one.bottom += down;
      box(one);
    }
    for (const PlotDrawing::Arrow& one : figure_.drawing.arrows) {
      add("set arrow from {} to {} head filled size screen {:.6f},18,60 lw {:.2f} lc rgb '{}' back\n",
          at(one.x_from, one.y_from + down), at(one.x_to, one.y_to + down), 9 / layout_.width, px(one.width),
          rgb(PlotColor::soft));
    }
    for (const PlotDrawing::Text& one : figure_.drawing.texts) {
      label(one.x, one.y + down, plot_fitted(one.text, one.size * (one.bold ? 1.06 : 1), one.room), one.size, one.color,
            "left", one.bold);
    }
    for (const PlotDrawing::Mark& one : figure_.drawing.diamonds) {
      mark(one.x, one.y + down, PlotMark::diamond, 12, one.color);
    }
  }

  void add_panel(const PlotPanel& panel, const PlacedPanel& placed, std::size_t& block) {
    add("set lmargin at screen {:.6f}\nset rmargin at screen {:.6f}\nset tmargin at screen {:.6f}\n",
        placed.left / layout_.width, placed.right / layout_.width, 1 - placed.top / layout_.height);
    add("set bmargin at screen {:.6f}\n", 1 - placed.bottom / layout_.height);
    add("set xrange [{:.9g}:{:.9g}]\nset yrange [{:.9g}:{:.9g}]\n", placed.x_low, placed.x_high, placed.y_low,
        placed.y_high);
    add("set border 1 lw {:.2f} lc rgb '{}'\n", px(1), rgb(PlotColor::soft));
    add_axes(panel, placed);
    const double width = placed.right - placed.left;
    label(placed.left, placed.top - 13, plot_fitted(panel.title, 13, width), 13, PlotColor::ink, "left", true);
    const double middle = (placed.left + placed.right) / 2, centre = (placed.top + placed.bottom) / 2;
    std::vector<std::string> sentence = plot_lines(panel.instead, kTextSize, 0.9 * width);
    for (std::size_t i = 0; i < sentence.size(); ++i) {
      const double line = static_cast<double>(i) - (static_cast<double>(sentence.size()) - 1) / 2;
      label(middle, centre + 17 * line, sentence[i], kTextSize, PlotColor::soft, "center");
    }
    for (const PlotWords& one : panel.words) {
      label(x_of(placed, one.x), y_of(placed, one.y), one.text, kSmallSize, one.color);
    }
    add_plot(panel, block);
    add("unset label\nunset arrow\nunset object\n");
  }
  static double x_of(const PlacedPanel& p, double x) {
    return p.left + (x - p.x_low) / (p.x_high - p.x_low) * (p.right - p.left);
  }
  static double y_of(const PlacedPanel& p, double y) {
    return p.bottom - (y - p.y_low) / (p.y_high - p.y_low) * (p.bottom - p.top);
  }

  /// Grid, ticks and titles, drawn by hand: gnuplot takes the texts of its own ticks for formats of numbers.
  void add_axes(const PlotPanel& panel, const PlacedPanel& placed) {
    const auto grid = [&](double x0, double y0, double x1, double y1) {
      add("set arrow from {} to {} nohead lw {:.2f} lc rgb '{}' back\n", at(x0, y0), at(x1, y1), px(1),
          rgb(PlotColor::rule));
    };
    for (const auto& [value, text] : placed.x_ticks) {
      const double x = x_of(placed, value);
      if (panel.x.grid) grid(x, placed.bottom, x, placed.top);
      label(x, placed.bottom + 12, text, kSmallSize, PlotColor::soft, "center");
    }
    for (const auto& [value, text] : placed.y_ticks) {
      const double y = y_of(placed, value);
      if (panel.y.grid) grid(placed.left, y, placed.right, y);
      label(placed.left - 7, y, text, kSmallSize, PlotColor::soft, "right");
    }
    const double across = placed.right - placed.left, up = placed.bottom - placed.top;
    label((placed.left + placed.right) / 2, placed.bottom + 31, plot_fitted(panel.x.title, kTextSize, across),
          kTextSize, PlotColor::ink, "center");
    const double widest = placed.left - y_title_room(placed);
    label(widest, (placed.top + placed.bottom) / 2, plot_fitted(panel.y.title, kTextSize, up + 20), kTextSize,
          PlotColor::ink, "center", false, true);
    if (panel.x.zero && placed.x_low < 0 && placed.x_high > 0) {
      line(x_of(placed, 0), placed.bottom, x_of(placed, 0), placed.top, PlotColor::ink, 1, true);
    }
    if (panel.y.zero && placed.y_low < 0 && placed.y_high > 0) {
      line(placed.left, y_of(placed, 0), placed.right, y_of(placed, 0), PlotColor::ink, 1, true);
    }
  }
  static double y_title_room(const PlacedPanel& placed) {
    double widest = 0;
    for (const auto& [value, text] : placed.y_ticks) widest = std::max(widest, plot_width(text, kSmallSize));
    return widest + 19;
  }

  void add_plot(const PlotPanel& panel, std::size_t& block) {
    std::string bands, rest;
    for (const PlotSeries& one : panel.series) {
      const bool band = one.kind == PlotSeries::Kind::line && !one.low.empty();
      const std::size_t data = block + (band ? 1 : 0);
      const bool any = drawn_.at(series_++);
      if (any && band) {
        bands += fmt::format(
            ", $d{} using 1:2:3 with filledcurves fc rgb '{}' fs transparent solid 0.18 noborder "
            "notitle",
            block, rgb(one.color));
      }
      if (any) rest += fmt::format(", $d{} {} notitle", data, with(one));
      block = data + 1;
    }
    const std::string all = bands + rest;
    add("plot {}\n", all.empty() ? "NaN notitle" : all.substr(2));
  }
  std::string with(const PlotSeries& one) const {
    const std::string color = fmt::format("lc rgb '{}{}'", one.faint ? "#50" : "#", rgb(one.color).substr(1));
    const std::string points =
        fmt::format("pt {} ps {:.3f} lw {:.2f} {}", point_type(one.mark), point_size(one.width), px(1.6), color);
    switch (one.kind) {
      case PlotSeries::Kind::line:
        return fmt::format("with lines lw {:.2f}{} {}", px(one.width), one.dashed ? " dt 2" : "", color);
      case PlotSeries::Kind::marks:
        return "with points " + points;
      case PlotSeries::Kind::tall:
        return "with yerrorbars " + points;
      case PlotSeries::Kind::wide:
        return "with xerrorbars " + points;
      case PlotSeries::Kind::boxes:
        break;
    }
    return fmt::format("with boxxyerror fc rgb '{}' fs solid noborder", rgb(one.color));
  }

  const Figure& figure_;
  const PlotStyle& style_;
  const PlotLayout layout_;
  std::string out_;
  std::size_t next_ = 0, series_ = 0;
  std::vector<bool> drawn_;  // [series]: it has data
};

}  // namespace

std::string finished_svg(std::string drawn) {
  // gnuplot takes what it calls a bold font for the name of a family, which no reader has.
  constexpr std::string_view kBold = "font-family=\"sans-serif:Bold\" font-size=";
  constexpr std::string_view kRight = "font-family=\"sans-serif\" font-weight=\"bold\" font-size=";
  for (std::size_t at = drawn.find(kBold); at != std::string::npos; at = drawn.find(kBold, at + kRight.size())) {
    drawn.replace(at, kBold.size(), kRight);
  }
  return drawn;
}

std::string plot_rgb(PlotColor color, PlotStyle::Theme theme) {
  return (theme == PlotStyle::Theme::light ? kLight : kDark).at(static_cast<std::size_t>(color));
}

std::string gnuplot_script(const Figure& figure, const PlotStyle& style) { return ScriptWriter(figure, style).text(); }

}  // namespace graze
