#pragma once
// Reads the attributes of a URDF's elements: each is checked, repaired where that is possible, and printed into the
// clean document. A value that cannot be used is told and replaced by a stand-in, so that reading goes on.

#include <tinyxml2.h>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/model/urdf_problems.h"

namespace graze {

/// What stands for "no limit" where URDF wants a number: far above any motor, and readable by every program.
inline constexpr double kNoBound = 1e9;  // N m, N, rad/s or m/s

/// Where an element stands; of one that a repair has put in, where its parent stands.
int line_of(const tinyxml2::XMLElement& element);

/// A whole decimal number, finite.
std::optional<double> parse_number(std::string_view text);

/// What lies between spaces.
std::vector<std::string_view> words_of(std::string_view text);

/// "0.1 0.2 0.3": digits from which the same numbers are read again.
std::string number_text(const std::vector<double>& numbers);

class UrdfValues {
 public:
  explicit UrdfValues(UrdfProblems& problems) : problems_(problems), printer_(nullptr, true) {}

  /// A text that must be there, or "". Throws InputError for an expression of xacro: then all of the file is xacro's.
  std::string required(const tinyxml2::XMLElement& e, const char* attribute, const std::string& where);
  /// `count` numbers; where they cannot be read, `count` times `otherwise`.
  std::vector<double> numbers(tinyxml2::XMLElement& e, const char* attribute, std::size_t count,
                              const std::string& where, double otherwise = 0);
  double number(tinyxml2::XMLElement& e, const char* attribute, const std::string& where);
  /// A number that the clean document does not get.
  double unprinted(tinyxml2::XMLElement& e, const char* attribute, const std::string& where, double otherwise) {
    return read(e, attribute, 1, where, otherwise)[0];
  }
  /// A number >= 0.
  double non_negative(tinyxml2::XMLElement& e, const char* attribute, const std::string& where);
  /// An effort or velocity: a number >= 0, or none where the file has none or an infinite one.
  void bound(tinyxml2::XMLElement& limit, const char* attribute, const std::string& where);
  /// Edges, radii and lengths of a shape: numbers > 0. One of 0 is repaired to 1 mm.
  void sizes(tinyxml2::XMLElement& e, const char* attribute, std::size_t count, const std::string& where);
  void check_length(const tinyxml2::XMLElement& e, const char* attribute, double value, const std::string& where);
  /// Reads `parent`'s <origin>, if it has one; returns its rpy.
  std::array<double, 3> origin(tinyxml2::XMLElement& parent, const std::string& where);

  UrdfProblems& problems() { return problems_; }
  /// The clean document.
  tinyxml2::XMLPrinter& printer() { return printer_; }

 private:
  std::optional<std::vector<double>> parsed(tinyxml2::XMLElement& e, const char* attribute, const std::string& text,
                                            const std::string& where);
  bool brought_to_three(tinyxml2::XMLElement& e, const char* attribute, const std::string& text,
                        std::vector<double>& numbers, const std::string& where);
  std::vector<double> read(tinyxml2::XMLElement& e, const char* attribute, std::size_t count, const std::string& where,
                           double otherwise);
  void print(const char* attribute, const std::vector<double>& numbers);
  void doubt_rpy(const tinyxml2::XMLElement& origin, const std::vector<double>& rpy, const std::string& where);

  UrdfProblems& problems_;
  tinyxml2::XMLPrinter printer_;
};

}  // namespace graze
