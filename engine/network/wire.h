#pragma once
// Reads the wire format of protocol buffers, which ONNX files have: fields of a number and a value. Every length is
// checked against the bytes that are there, so that no file can lead a reader astray.

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace graze {

/// What is wrong with a network's file, in one line; whoever knows the place in the scenario puts it in front. Names in
/// the file may be anybody's: control characters are spelled out, a newline as \n.
class NetworkError : public std::runtime_error {
 public:
  explicit NetworkError(const std::string& what) : std::runtime_error(spelled(what)) {}

 private:
  static std::string spelled(const std::string& text);
};

/// The fields of one message, one after the other.
class WireReader {
 public:
  /// `bytes` outlives this. `message`: its name, for errors.
  WireReader(std::string_view bytes, const char* message) : rest_(bytes), message_(message) {}

  /// Goes to the next field, past the one before whether it was read or not; false at the end. Throws NetworkError, as
  /// all below.
  bool next();
  int field() const { return field_; }

  /// The field's value, which must be of that kind.
  std::int64_t integer() const;
  double single() const;  // a float
  std::string_view bytes() const;
  std::string text() const { return std::string(bytes()); }

  /// Adds the values of a repeated field, written one by one or packed.
  void integers(std::vector<std::int64_t>& out) const;
  void singles(std::vector<double>& out) const;
  void doubles(std::vector<double>& out) const;

 private:
  enum class Kind { varint = 0, fixed64 = 1, bytes = 2, fixed32 = 5 };
  [[noreturn]] void fail(const char* what) const;
  std::uint64_t varint(std::string_view& from) const;
  std::string_view take(std::string_view& from, std::uint64_t count) const;

  std::string_view rest_;
  const char* message_;
  int field_ = 0;
  Kind kind_ = Kind::varint;
  std::uint64_t number_ = 0;  // of a varint
  std::string_view value_;    // of the others
};

/// Numbers as they stand in memory of a little-endian machine.
double single_at(std::string_view bytes, std::size_t at);
double double_at(std::string_view bytes, std::size_t at);
std::int64_t int64_at(std::string_view bytes, std::size_t at);
std::int32_t int32_at(std::string_view bytes, std::size_t at);

}  // namespace graze
