#include "analysis/plots_layout.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "analysis/plots_text.h"

namespace graze {
namespace {

constexpr double kTitleLine = 26, kSubtitleLine = 20, kLegendLine = 20, kLegendMark = 26, kLegendGap = 20;
constexpr double kNoteLine = 15, kNotesGap = 0;
constexpr double kPanelTitle = 24, kPanelGap = 22, kColumnGap = 26, kTickLine = 20, kAxisTitle = 20;
constexpr double kLeastShare = 0.55;     // of a panel's height, where a picture must be low
constexpr double kMostForLabels = 0.45;  // of a panel's width

void widen(double& low, double& high, const std::vector<double>& values) {
  for (const double x : values) {
    if (!std::isfinite(x)) continue;
    low = std::min(low, x);
    high = std::max(high, x);
  }
}

/// The range of what is drawn and a little more, unless the axis has its own.
std::pair<double, double> range_of(const PlotPanel& panel, bool along_x) {
  const PlotAxis& axis = along_x ? panel.x : panel.y;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const PlotSeries& one : panel.series) {
    const bool boxes = one.kind == PlotSeries::Kind::boxes;
    const bool spread_along_x = boxes || one.kind == PlotSeries::Kind::wide;
    widen(low, high, along_x ? one.x : one.y);
    if (boxes ? along_x : spread_along_x == along_x) widen(low, high, one.high);
    if (boxes ? !along_x : spread_along_x == along_x) widen(low, high, one.low);
  }
  if (!(low <= high)) low = 0, high = 1;
  constexpr double kPad = 0.04;
  const double more = low == high ? std::max(std::abs(low) * 0.1, 1e-6) : (high - low) * kPad;
  return {std::isnan(axis.low) ? low - more : axis.low, std::isnan(axis.high) ? high + more : axis.high};
}

double label_width(const PlacedPanel& placed) {
  double out = 0;
  for (const auto& [at, text] : placed.y_ticks) out = std::max(out, plot_width(text, kSmallSize));
  return out;
}

/// Where the rows of the legend end.
double place_legend(const Figure& figure, double top, PlotLayout& out) {
  if (figure.legend.empty()) return top + kLegendLine / 2;
  double x = kPlotBorder, y = top + kLegendLine / 2;
  for (const PlotLegend& one : figure.legend) {
    const double width = kLegendMark + plot_width(one.text, kTextSize);
    if (x > kPlotBorder && x + width > out.width - kPlotBorder) {
      x = kPlotBorder;
      y += kLegendLine;
    }
    out.legend.push_back({x, y});
    x += width + kLegendGap;
  }
  return y + kLegendLine / 2 + 4;
}

double head_height(const Figure& figure) {
  return kPlotBorder + kTitleLine + (figure.subtitle.empty() ? 0 : kSubtitleLine);
}

double around_panel(const PlotPanel& panel) {
  return (panel.title.empty() ? 0 : kPanelTitle) + kTickLine + (panel.x.title.empty() ? 0 : kAxisTitle);
}

/// Rows of panels: what stands around the axes, and the axes.
struct PanelRow {
  double around = 0, height = 0;
};

std::vector<PanelRow> rows_of(const Figure& figure) {
  std::vector<PanelRow> out;
  for (std::size_t i = 0; i < figure.panels.size(); ++i) {
    if (i % figure.columns == 0) out.emplace_back();
    out.back().around = std::max(out.back().around, around_panel(figure.panels[i]));
    out.back().height = std::max(out.back().height, figure.panels[i].height);
  }
  return out;
}

/// What everything takes if panels have this share of their height.
double total_height(const Figure& figure, const PlotLayout& layout, double share) {
  PlotLayout trial;
  trial.width = layout.width;
  double out = place_legend(figure, head_height(figure), trial) + figure.drawing.height;
  for (const PanelRow& row : rows_of(figure)) out += row.around + share * row.height + kPanelGap;
  const auto notes = static_cast<double>(layout.notes.size());
  return out + (notes > 0 ? kNotesGap + notes * kNoteLine : 0) + kPlotBorder - 8;
}

std::vector<std::string> note_lines(const Figure& figure, double width) {
  std::vector<std::string> out;
  for (const std::string& note : figure.notes) {
    for (std::string& line : plot_lines(note, kSmallSize, width - 2 * kPlotBorder)) out.push_back(std::move(line));
  }
  return out;
}

/// Sizes of the whole; returns the share of their height that panels have.
double place_page(const Figure& figure, const PlotStyle& style, PlotLayout& out) {
  out.width = figure.width;
  out.notes = note_lines(figure, out.width);
  const double nice = total_height(figure, out, 1);
  if (style.width == 0) {
    out.height = std::ceil(nice);
    out.scale = style.format == PlotStyle::Format::png ? 2 : 1;
    return 1;
  }
  const double least = total_height(figure, out, kLeastShare);
  out.scale = std::min(style.width / figure.width, style.height / least);
  out.width = style.width / out.scale;
  out.height = style.height / out.scale;
  out.notes = note_lines(figure, out.width);
  const double fixed = total_height(figure, out, 0), all = total_height(figure, out, 1);
  return all > fixed ? (out.height - fixed) / (all - fixed) : 1;
}

/// One unit has the same length along both axes.
void equalise(PlacedPanel& out) {
  const double aspect = (out.bottom - out.top) / (out.right - out.left);
  const double span = std::max(out.x_high - out.x_low, (out.y_high - out.y_low) / aspect);
  const double x = (out.x_low + out.x_high) / 2, y = (out.y_low + out.y_high) / 2;
  out.x_low = x - span / 2;
  out.x_high = x + span / 2;
  out.y_low = y - span * aspect / 2;
  out.y_high = y + span * aspect / 2;
}

void place_ticks(const PlotPanel& panel, PlacedPanel& out) {
  constexpr double kAcross = 90, kUp = 52;  // px between ticks
  out.x_ticks =
      panel.x.labels.empty() ? plot_ticks(out.x_low, out.x_high, (out.right - out.left) / kAcross) : panel.x.labels;
  const double room = out.x_ticks.empty() ? 0 : (out.right - out.left) / static_cast<double>(out.x_ticks.size());
  for (auto& [at, text] : out.x_ticks) text = plot_fitted(text, kSmallSize, std::max(room, 40.0));
  out.y_ticks =
      panel.y.labels.empty() ? plot_ticks(out.y_low, out.y_high, (out.bottom - out.top) / kUp) : panel.y.labels;
}

void place_panels(const Figure& figure, double top, double share, PlotLayout& out) {
  const std::vector<PanelRow> rows = rows_of(figure);
  const auto columns = static_cast<double>(figure.columns);
  const double cell = (out.width - 2 * kPlotBorder - (columns - 1) * kColumnGap) / columns;
  double widest = 0;
  for (std::size_t i = 0; i < figure.panels.size(); ++i) {
    const PlotPanel& panel = figure.panels[i];
    PlacedPanel& one = out.panels.emplace_back();
    std::tie(one.x_low, one.x_high) = range_of(panel, true);
    std::tie(one.y_low, one.y_high) = range_of(panel, false);
    const std::size_t row = i / figure.columns;
    double y = top;
    for (std::size_t k = 0; k < row; ++k) y += rows[k].around + share * rows[k].height + kPanelGap;
    one.top = y + (panel.title.empty() ? 0 : kPanelTitle);
    one.bottom = one.top + share * rows[row].height;
    one.left = kPlotBorder + static_cast<double>(i % figure.columns) * (cell + kColumnGap);
    one.right = one.left + cell;
    place_ticks(panel, one);
    widest = std::max(widest, label_width(one) + (panel.y.title.empty() ? 0 : kAxisTitle));
  }
  const double labels = std::min(kMostForLabels * cell, widest + 10);
  for (std::size_t i = 0; i < figure.panels.size(); ++i) {
    PlacedPanel& one = out.panels[i];
    one.left += labels;
    one.right -= 6;
    if (figure.panels[i].one_scale) equalise(one);
    place_ticks(figure.panels[i], one);
    const double room = labels - 10 - (figure.panels[i].y.title.empty() ? 0 : kAxisTitle);
    for (auto& [at, text] : one.y_ticks) text = plot_fitted(text, kSmallSize, room + 1);
  }
}

}  // namespace

PlotLayout plot_layout(const Figure& figure, const PlotStyle& style) {
  PlotLayout out;
  const double share = place_page(figure, style, out);
  out.drawing_top = place_legend(figure, head_height(figure), out);
  place_panels(figure, out.drawing_top + figure.drawing.height, share, out);
  const auto notes = static_cast<double>(out.notes.size());
  out.notes_top = out.height - kPlotBorder + 8 - notes * kNoteLine;
  return out;
}

}  // namespace graze
