#include "engine/model/mesh_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

#include "engine/model/limits.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

constexpr std::string_view kBlank = " \t\r\n\v\f";

/// The first word of a text, which is taken off it.
std::string_view take_word(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(kBlank));
  text.remove_prefix(word.size());
  return word;
}

/// None: not a number. May be infinite.
std::optional<double> number_in(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || word.empty()) return std::nullopt;
  if (error == std::errc::result_out_of_range)
    return word.find("e-") == word.npos && word.find("E-") == word.npos ? HUGE_VAL : 0;
  return value;
}

[[noreturn]] void refuse_line(const std::string& file, std::size_t line, const std::string& what) {
  throw InputError(fmt::format("{}:{}: {}", file, line, what));
}

constexpr std::size_t kHead = 84, kTriangle = 50;  // bytes of a binary STL file

/// What the head of one says of whole bytes of kHead.
std::uint32_t triangles_of(const std::string& bytes) {
  std::uint32_t triangles = 0;
  std::memcpy(&triangles, bytes.data() + kHead - sizeof triangles, sizeof triangles);
  return triangles;
}
std::size_t length_told(const std::string& bytes) { return kHead + kTriangle * std::size_t{triangles_of(bytes)}; }

/// Words of an STL text, with the lines on which they stand.
class StlText {
 public:
  StlText(std::string_view text, const std::string& file) : rest_(text), file_(file) {}

  void run() {
    bool open = false;
    std::size_t vertices = 0;
    for (std::string word = next(); !word.empty(); word = next()) {
      if (word == "solid" || word == "endsolid") {
        open = word == "solid";
        rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));  // its name
      } else if (word == "facet") {
        vertices = 0;
      } else if (word == "vertex") {
        ++vertices;
        const std::string problem = vertex_problem(rest_);
        if (!problem.empty()) refuse_line(file_, line_, "vertex: " + problem);
      } else if (word == "endfacet" && vertices != 3) {
        refuse_line(file_, line_, fmt::format("a facet of {} vertices; each has three", vertices));
      }
    }
    if (open) refuse_line(file_, line_, "the file ends before its solid does ('endsolid'): it is cut off");
  }

 private:
  std::string next() {
    const std::size_t blank = std::min(rest_.find_first_not_of(kBlank), rest_.size());
    line_ +=
        static_cast<std::size_t>(std::count(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(blank), '\n'));
    std::string word(take_word(rest_));
    for (char& c : word) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return word;
  }

  std::string_view rest_;
  const std::string& file_;
  std::size_t line_ = 1;
};

}  // namespace

std::string vertex_problem(std::string_view words) {
  words = words.substr(0, words.find('\n'));
  for (int k = 0; k < 3; ++k) {
    const std::string_view word = take_word(words);
    if (word.empty()) return fmt::format("{} coordinates; a vertex has three", k);
    const auto value = number_in(word);
    if (!value) return fmt::format("'{}' is not a number", clipped(fit_for_a_line(word), 40));
    if (!std::isfinite(*value) || !std::isfinite(static_cast<float>(*value))) {
      return fmt::format("{} is not finite, or too large to be read", clipped(word, 40));
    }
  }
  return "";
}

bool is_binary_stl(const std::string& bytes) { return bytes.size() >= kHead && bytes.size() == length_told(bytes); }

void check_stl(const std::string& bytes, const std::string& file) {
  std::string_view text = bytes;
  const bool is_text = text.find('\0') == std::string_view::npos;
  if (is_text) return StlText(text, file).run();
  if (bytes.size() < kHead) {
    throw InputError(
        fmt::format("{}: {} bytes; a binary STL file has at least {}: it is cut off", file, bytes.size(), kHead));
  }
  const std::size_t told = length_told(bytes);
  throw InputError(
      fmt::format("{}: a binary STL file of {} triangles, as its head says, has {} bytes, and this one {}: it is {}",
                  file, triangles_of(bytes), told, bytes.size(), bytes.size() < told ? "cut off" : "damaged"));
}

void check_ply_faces(const std::string& bytes, const std::string& file) {
  struct Element {
    double count;
    bool of_lists;  // begins with one
  };
  std::vector<Element> elements;
  std::string_view text = bytes;
  std::size_t number = 0;
  const auto next_line = [&] {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    ++number;
    return line;
  };
  bool first_property = false;
  while (!text.empty()) {
    std::string_view line = next_line();
    const std::string_view word = take_word(line), kind = take_word(line);
    if (word == "end_header") break;
    if (word == "format" && kind != "ascii") return;
    if (word == "element") elements.push_back({number_in(take_word(line)).value_or(0), false}), first_property = true;
    if (word == "property" && first_property && !elements.empty()) {
      elements.back().of_lists = kind == "list";
      first_property = false;
    }
  }
  for (const Element& element : elements) {
    for (double i = 0; i < element.count && !text.empty(); ++i) {
      std::string_view line = next_line();
      if (!element.of_lists) continue;
      const std::string_view word = take_word(line);
      if (number_in(word).value_or(0) <= static_cast<double>(kMaxPolygon)) continue;
      refuse_line(
          file, number,
          fmt::format("a face of {} corners; at most {}: cut it into triangles", clipped(word, 20), kMaxPolygon));
    }
  }
}

std::string fit_for_a_line(std::string_view said) {
  constexpr std::size_t kMost = 200;
  std::string out(clipped(said, kMost));
  std::replace_if(
      out.begin(), out.end(), [](char c) { return std::iscntrl(static_cast<unsigned char>(c)) != 0; }, ' ');
  return out;
}

}  // namespace graze
