#include "analysis/number_words.h"

#include <fmt/format.h>

#include <cmath>

#include "analysis/score.h"

namespace graze {

std::string interval_text(const Interval& interval, int digits) {
  return fmt::format("{:.{}f} .. {:.{}f}", interval.low, digits, interval.high, digits);
}

std::string counted(std::size_t n, const char* one, const char* several) {
  return fmt::format("{} {}", n, n == 1 ? one : several);
}

std::string p_text(double p, int digits) {
  if (std::isnan(p)) return "-";
  return p < 1e-300 ? "< 1e-300" : fmt::format("{:.{}g}", p, digits);
}

std::string p_equation(double p, int digits) {
  const std::string text = p_text(p, digits);
  return text.starts_with('<') ? "p " + text : "p = " + text;
}

}  // namespace graze
