#include "engine/model/urdf_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "engine/model/limits.h"
#include "engine/model/urdf_spelling.h"
#include "engine/model/xacro.h"
#include "engine/settings/settings.h"

namespace graze {

using tinyxml2::XMLElement;

namespace {

/// Edge or radius of a shape that has none: large beside rounding, small beside a foot.
constexpr double kPointSize = 1e-3;  // m

bool infinite(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const std::vector<std::string_view> words = words_of(text);
  return words.size() == 1 && (words[0] == "inf" || words[0] == "+inf" || words[0] == "infinity");
}

/// A number with a comma, semicolon or full stop behind it, which parsers in C pass over.
std::optional<double> without_sign_behind(std::string_view word) {
  if (word.size() < 2 || std::string_view(",;.").find(word.back()) == std::string_view::npos) return std::nullopt;
  return parse_number(word.substr(0, word.size() - 1));
}

}  // namespace

int line_of(const XMLElement& element) {
  const tinyxml2::XMLNode* node = &element;
  while (node->GetLineNum() == 0 && node->Parent()) node = node->Parent();
  return node->GetLineNum();
}

std::optional<double> parse_number(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::vector<std::string_view> words_of(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r\n";
  std::vector<std::string_view> out;
  for (std::size_t begin = text.find_first_not_of(kSpace); begin != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kSpace, begin), text.size());
    out.push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(kSpace, end);
  }
  return out;
}

std::string number_text(const std::vector<double>& numbers) { return fmt::format("{}", fmt::join(numbers, " ")); }

std::string UrdfValues::required(const XMLElement& e, const char* attribute, const std::string& where) {
  const char* text = e.Attribute(attribute);
  if (!text || !*text) {
    problems_.refuse(line_of(e), fmt::format("{}: <{}> needs a non-empty {}{}", where, e.Name(), attribute,
                                             misspelt_attribute(e, attribute)));
    return "";
  }
  const std::size_t size = std::strlen(text);
  if (size > kMaxAttributeBytes) {
    problems_.stop(line_of(e), fmt::format("{}: <{}> {}: {}: {} bytes; at most {}", where, e.Name(), attribute,
                                           clipped(text, 40), size, kMaxAttributeBytes));
  }
  if (std::strstr(text, "$(") || std::strstr(text, "${")) {
    problems_.stop(line_of(e), fmt::format("{}: <{}> {}: '{}' is an expression of xacro; {}", where, e.Name(),
                                           attribute, clipped(text, 80), xacro_advice(problems_.name())));
  }
  return text;
}

void UrdfValues::print(const char* attribute, const std::vector<double>& numbers) {
  printer_.PushAttribute(attribute, number_text(numbers).c_str());
}

std::optional<std::vector<double>> UrdfValues::parsed(XMLElement& e, const char* attribute, const std::string& text,
                                                      const std::string& where) {
  std::vector<double> out;
  bool mended = false;
  for (std::string_view word : words_of(text)) {
    std::optional<double> value = parse_number(word);
    const std::string what = fmt::format("{}: <{}> {}: '{}' is not a number", where, e.Name(), attribute, word);
    if (!value && (value = without_sign_behind(word))) {
      problems_.repair(line_of(e), what, fmt::format("takes {}", *value));
      mended = true;
    }
    if (!value) {
      problems_.refuse(line_of(e), what);
      return std::nullopt;
    }
    out.push_back(*value);
  }
  if (mended) e.SetAttribute(attribute, number_text(out).c_str());
  return out;
}

/// Whether what was meant can be told: too many numbers, one factor for all axes, angles or coordinates without the
/// zeros behind them.
bool UrdfValues::brought_to_three(XMLElement& e, const char* attribute, const std::string& text,
                                  std::vector<double>& numbers, const std::string& where) {
  const std::size_t given = numbers.size();
  const bool origin = std::strcmp(e.Name(), "origin") == 0;
  std::string how;
  if (given > 3) {
    how = "takes the first 3";
    numbers.resize(3);
  } else if (given == 1 && std::strcmp(attribute, "scale") == 0) {
    how = "takes it for all 3 axes";
    numbers.assign(3, numbers[0]);
  } else if (origin) {
    how = "takes 0 for those that lack";
    numbers.resize(3, 0);
  } else {
    return false;
  }
  problems_.repair(line_of(e),
                   fmt::format("{}: <{}> {}: \"{}\" has {} number{}; it needs 3", where, e.Name(), attribute, text,
                               given, given == 1 ? "" : "s"),
                   how);
  e.SetAttribute(attribute, number_text(numbers).c_str());
  return true;
}

std::vector<double> UrdfValues::read(XMLElement& e, const char* attribute, std::size_t count, const std::string& where,
                                     double otherwise) {
  const std::vector<double> stand_in(count, otherwise);
  const std::string text = required(e, attribute, where);
  if (text.empty()) return stand_in;
  std::optional<std::vector<double>> given = parsed(e, attribute, text, where);
  if (!given) return stand_in;
  if (given->size() == count || (count == 3 && brought_to_three(e, attribute, text, *given, where))) return *given;
  problems_.refuse(line_of(e), fmt::format("{}: <{}> {}: \"{}\" has {} number{}; it needs {}", where, e.Name(),
                                           attribute, text, given->size(), given->size() == 1 ? "" : "s", count));
  return stand_in;
}

std::vector<double> UrdfValues::numbers(XMLElement& e, const char* attribute, std::size_t count,
                                        const std::string& where, double otherwise) {
  const std::vector<double> out = read(e, attribute, count, where, otherwise);
  print(attribute, out);
  return out;
}

double UrdfValues::number(XMLElement& e, const char* attribute, const std::string& where) {
  return numbers(e, attribute, 1, where)[0];
}

double UrdfValues::non_negative(XMLElement& e, const char* attribute, const std::string& where) {
  const double value = number(e, attribute, where);
  if (value < 0) {
    problems_.refuse(line_of(e),
                     fmt::format("{}: <{}> {}: {} is negative; it must be >= 0", where, e.Name(), attribute, value));
  }
  return value;
}

void UrdfValues::bound(XMLElement& limit, const char* attribute, const std::string& where) {
  const char* text = limit.Attribute(attribute);
  std::string problem;
  if (!text) {
    problem = fmt::format("needs a non-empty {}{}", attribute, misspelt_attribute(limit, attribute));
  } else if (infinite(text)) {
    problem = fmt::format("{}: '{}' is not a number", attribute, text);
  } else if (const auto value = parse_number(text); value && *value < 0) {
    problem = fmt::format("{}: {} is negative; it must be >= 0", attribute, *value);
  }
  if (!problem.empty()) {
    const std::string none = number_text({kNoBound});
    problems_.repair(line_of(limit), fmt::format("{}: <limit> {}", where, problem),
                     fmt::format("writes {}, which is no limit", none));
    limit.SetAttribute(attribute, none.c_str());
  }
  non_negative(limit, attribute, where);
}

void UrdfValues::sizes(XMLElement& e, const char* attribute, std::size_t count, const std::string& where) {
  std::vector<double> all = read(e, attribute, count, where, 1);
  bool mended = false;
  for (double& value : all) {
    const std::string what =
        fmt::format("{}: <{}> {}: {} is not positive; sizes must be > 0", where, e.Name(), attribute, value);
    if (value < 0) problems_.refuse(line_of(e), what);
    check_length(e, attribute, value, where);
    if (value != 0) continue;
    problems_.repair(line_of(e), what, fmt::format("takes {:g} m", kPointSize));
    value = kPointSize;
    mended = true;
  }
  if (mended) e.SetAttribute(attribute, number_text(all).c_str());
  print(attribute, all);
}

void UrdfValues::check_length(const XMLElement& e, const char* attribute, double value, const std::string& where) {
  const std::string problem = length_problem(value);
  if (!problem.empty()) {
    problems_.refuse(line_of(e), fmt::format("{}: <{}> {}: {}", where, e.Name(), attribute, problem));
  }
}

/// No one writes more than a turn, which says nothing more than its remainder.
void UrdfValues::doubt_rpy(const XMLElement& origin, const std::vector<double>& rpy, const std::string& where) {
  constexpr double kMost = 2 * M_PI * (1 + 1e-3);  // rounded to 3 digits
  const auto large = std::find_if(rpy.begin(), rpy.end(), [](double a) { return std::abs(a) > kMost; });
  if (large == rpy.end()) return;
  problems_.doubt(line_of(origin),
                  fmt::format("{}: <origin> rpy: {} rad is more than a turn; URDF has radians: is it meant in degrees "
                              "({:.6g} rad)?",
                              where, *large, *large * M_PI / 180));
}

std::array<double, 3> UrdfValues::origin(XMLElement& parent, const std::string& where) {
  std::array<double, 3> rpy{};
  XMLElement* origin = parent.FirstChildElement("origin");
  if (!origin) return rpy;
  printer_.OpenElement("origin");
  for (const char* attribute : {"xyz", "rpy"}) {
    const char* text = origin->Attribute(attribute);
    if (!text) continue;
    if (words_of(text).empty()) {
      problems_.repair(line_of(*origin), fmt::format("{}: <origin> needs a non-empty {}", where, attribute),
                       "takes \"0 0 0\"");
      origin->DeleteAttribute(attribute);
      continue;
    }
    const std::vector<double> three = numbers(*origin, attribute, 3, where);
    if (attribute[0] == 'r') {
      doubt_rpy(*origin, three, where);
      std::copy(three.begin(), three.end(), rpy.begin());
    } else {
      for (double value : three) check_length(*origin, attribute, value, where);
    }
  }
  printer_.CloseElement();
  return rpy;
}

}  // namespace graze
