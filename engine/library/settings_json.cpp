#include "engine/library/settings_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>

#include "engine/settings/unit_quantity.h"

namespace graze {

std::string json_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      out += c;
    }
  }
  return out + "\"";
}

namespace {

/// What looks like a number but is none would be a text to the controller, which took its own default then.
void refuse_unit(const Settings& value, const std::string& text) {
  const auto written = split_number(text);
  const bool hex = text.starts_with("0x") || text.starts_with("0X");
  if (hex) value.fail(fmt::format("{}: numbers are decimal here", text));
  if (!written || written->unit.empty()) return;
  const auto quantity = quantity_of_unit(written->unit);
  if (!quantity) return;
  value.fail(
      fmt::format("{}: the controller gets numbers as they are written, without units; write {:.12g}, which is SI",
                  text, *to_si(*quantity, written->value, written->unit)));
}

/// Neither has JSON a word for these.
void refuse_infinite(const Settings& value, std::string text, std::errc read) {
  const bool too_large = read == std::errc::result_out_of_range;
  if (text.starts_with('+') || text.starts_with('-')) text.erase(0, 1);
  constexpr std::array<std::string_view, 6> kWords = {".inf", ".Inf", ".INF", ".nan", ".NaN", ".NAN"};
  if (!too_large && std::ranges::find(kWords, text) == kWords.end()) return;
  value.fail(fmt::format("{}: the controller gets finite numbers (up to 1.8e308, and no closer to 0 than 2.2e-308); {}",
                         value.text(), too_large ? "write another one" : "leave the setting out, or write a text"));
}

/// "1.0" and "1e3" are no whole numbers, which in Python are another type, and "10000000000000001" is one whatever a
/// double makes of it.
std::string json_number(const std::string& text, double number) {
  const bool whole = text.find_first_not_of("+-0123456789") == std::string::npos;
  std::string out = fmt::format("{}", number);
  if (!whole) return out.find_first_of(".e") == std::string::npos ? out + ".0" : out;
  if (out.find_first_of(".e") == std::string::npos) return out;
  const std::size_t first = text.find_first_not_of("+-0");
  return (text.starts_with('-') ? "-" : "") + text.substr(first);  // too long for a double
}

std::string json_scalar(const Settings& value) {
  const std::string text = value.text();
  if (value.is_quoted()) return json_text(text);
  if (text == "true" || text == "false") return text;
  double number = 0;
  const char* const begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, text.data() + text.size(), number);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  if (whole && number - number == 0) return json_number(text, number);
  refuse_infinite(value, text, whole ? std::errc() : error);
  refuse_unit(value, text);
  return json_text(text);
}

}  // namespace

std::string settings_json(const Settings& settings) {
  if (settings.is_null()) return "null";
  if (settings.is_scalar()) return json_scalar(settings);
  std::string out;
  if (settings.is_list()) {
    for (const Settings& item : settings.items()) out += (out.empty() ? "" : ", ") + settings_json(item);
    return "[" + out + "]";
  }
  for (const auto& [key, value] : settings.entries()) {
    out += (out.empty() ? "" : ", ") + json_text(key) + ": " + settings_json(value);
  }
  return "{" + out + "}";
}

}  // namespace graze
