#include "analysis/plots_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "archive/files/utf8.h"

namespace graze {
namespace {

// Advance widths of DejaVu Sans, which is among the widest, as shares of the size.
constexpr double kNarrow = 0.40, kUsual = 0.62, kCapital = 0.70, kBroad = 0.98;
constexpr std::string_view kNarrowOnes = "iljtfrI.,:;'|!()[]/ -", kBroadOnes = "mwMW%@";

double advance(char c) {
  if (static_cast<unsigned char>(c) >= 0xE3) return 1;  // lead byte of East Asian and other wide characters
  if (kNarrowOnes.find(c) != std::string_view::npos) return kNarrow;
  if (kBroadOnes.find(c) != std::string_view::npos) return kBroad;
  return c >= 'A' && c <= 'Z' ? kCapital : kUsual;
}

}  // namespace

std::string plot_quoted(std::string_view text) {
  std::string out = "'";
  for (const char c : printable(text)) out += c == '\'' ? "’" : std::string(1, c);
  return out + "'";
}

double plot_width(std::string_view text, double size) {
  double out = 0;
  for (const char c : text) out += continues_character(c) ? 0 : size * advance(c);
  return out;
}

std::string plot_fitted(const std::string& text, double size, double room) {
  const std::string shown = printable(text);
  if (plot_width(shown, size) <= room) return shown;
  constexpr std::string_view kMore = "…";
  std::size_t end = shown.size();
  while (end > 0 && plot_width(std::string_view(shown).substr(0, end), size) + size > room) {
    do --end;
    while (end > 0 && continues_character(shown[end]));
  }
  return shown.substr(0, end) + std::string(kMore);
}

std::vector<std::string> plot_lines(const std::string& text, double size, double room) {
  std::vector<std::string> out;
  std::string line;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    if (!line.empty() && plot_width(line + " " + word, size) > room) out.push_back(std::exchange(line, ""));
    line += (line.empty() ? "" : " ") + word;
    begin = end + 1;
  }
  if (!line.empty()) out.push_back(line);
  for (std::string& one : out) one = plot_fitted(one, size, room);
  return out;
}

std::string plot_number(double x, int digits) {
  if (!std::isfinite(x)) return "–";
  std::string text = fmt::format("{:.{}g}", x == 0 ? 0.0 : x, digits);
  if (const std::size_t e = text.find('e'); e != std::string::npos) {
    const int power = std::stoi(text.substr(e + 1));
    text = fmt::format("{}e{}", text.substr(0, e), power);
  }
  std::string out;
  for (const char c : text) out += c == '-' ? "−" : std::string(1, c);
  return out;
}

std::string plot_titled(const std::string& name, const std::string& unit) {
  return unit.empty() || unit == "1" ? name : fmt::format("{} [{}]", name, unit);
}

std::vector<std::pair<double, std::string>> plot_ticks(double low, double high, double count) {
  const double span = high - low, raw = span / std::max(1.0, count);
  if (!(raw > 0) || !std::isfinite(raw)) return {{low, plot_number(low)}};
  const double power = std::pow(10, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double m : {5, 2, 1}) {
    if (m * power >= raw * 0.999) step = m * power;
  }
  // As many as tell neighbours apart.
  const double largest = std::max(std::abs(low), std::abs(high));
  const int digits = std::clamp(static_cast<int>(std::ceil(std::log10(largest / step))) + 1, 4, 12);
  std::vector<std::pair<double, std::string>> out;
  for (double i = std::ceil(low / step - 1e-9); i * step <= high + 1e-9 * span && out.size() < 100; ++i) {
    out.emplace_back(i * step, plot_number(i * step, digits));
  }
  return out;
}

}  // namespace graze
