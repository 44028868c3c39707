#include "analysis/report_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>

namespace graze {
namespace {

constexpr std::uint16_t kNone = 65535;

Json packed(std::span<const double> values) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double x : values) {
    if (!std::isfinite(x)) continue;
    low = std::min(low, x);
    high = std::max(high, x);
  }
  if (low > high) low = high = 0;  // there is none
  // Halved: the whole may be beyond the largest number.
  const double half = high / 2 - low / 2;
  std::string bytes;
  bytes.reserve(2 * values.size());
  for (const double x : values) {
    const double share = half > 0 ? (x / 2 - low / 2) / half : 0;
    const std::uint16_t code = std::isfinite(x) ? static_cast<std::uint16_t>(std::lround(share * (kNone - 1))) : kNone;
    bytes += static_cast<char>(code & 0xffu);
    bytes += static_cast<char>(code >> 8u);
  }
  return {{"n", values.size()}, {"lo", low}, {"hi", high}, {"u16", base64(bytes)}};
}

}  // namespace

Json short_number(double x) {
  if (!std::isfinite(x)) return nullptr;
  return std::strtod(fmt::format("{:.6g}", x).c_str(), nullptr);
}

Json numbers(std::span<const double> values, NumberForm form) {
  if (form == NumberForm::packed) return packed(values);
  Json out = Json::array();
  for (const double x : values) out.push_back(short_number(x));
  return out;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      three = three << 8u | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    }
    for (std::size_t k = 0; k < 4; ++k) out += k <= count ? kDigits[three >> (18 - 6 * k) & 63u] : '=';
  }
  return out;
}

}  // namespace graze
