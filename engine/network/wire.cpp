#include "engine/network/wire.h"

#include <fmt/format.h>

#include <cstring>

namespace graze {

namespace {

template <class T>
T number_at(std::string_view bytes, std::size_t at) {
  T out;
  std::memcpy(&out, bytes.data() + at, sizeof out);
  return out;
}

}  // namespace

std::string NetworkError::spelled(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '\n') {
      out += "\\n";
    } else if (code < 0x20 || code == 0x7f) {
      out += fmt::format("\\x{:02x}", code);
    } else {
      out += c;
    }
  }
  return out;
}

double single_at(std::string_view bytes, std::size_t at) { return number_at<float>(bytes, at); }
double double_at(std::string_view bytes, std::size_t at) { return number_at<double>(bytes, at); }
std::int64_t int64_at(std::string_view bytes, std::size_t at) { return number_at<std::int64_t>(bytes, at); }
std::int32_t int32_at(std::string_view bytes, std::size_t at) { return number_at<std::int32_t>(bytes, at); }

void WireReader::fail(const char* what) const {
  throw NetworkError(fmt::format("is no ONNX file, or a damaged one: {} in a {}", what, message_));
}

std::uint64_t WireReader::varint(std::string_view& from) const {
  std::uint64_t out = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    if (from.empty()) fail("a number that the file's end cuts off");
    const auto byte = static_cast<unsigned char>(from.front());
    from.remove_prefix(1);
    out |= static_cast<std::uint64_t>(byte & 0x7fu) << shift;
    if (byte < 0x80) return out;
  }
  fail("a number of more than 64 bits");
}

std::string_view WireReader::take(std::string_view& from, std::uint64_t count) const {
  if (count > from.size()) fail("a field that is longer than what it stands in");
  const std::string_view out = from.substr(0, count);
  from.remove_prefix(count);
  return out;
}

bool WireReader::next() {
  if (rest_.empty()) return false;
  const std::uint64_t key = varint(rest_);
  if (key >> 3 == 0 || key >> 3 > 0x1fffffff) fail("a field without a number");
  field_ = static_cast<int>(key >> 3);
  kind_ = static_cast<Kind>(key & 7u);
  switch (kind_) {
    case Kind::varint:
      number_ = varint(rest_);
      return true;
    case Kind::fixed64:
      value_ = take(rest_, 8);
      return true;
    case Kind::fixed32:
      value_ = take(rest_, 4);
      return true;
    case Kind::bytes:
      value_ = take(rest_, varint(rest_));
      return true;
  }
  fail("a field of unknown kind");
}

std::int64_t WireReader::integer() const {
  if (kind_ != Kind::varint) fail("no whole number where one must stand");
  return static_cast<std::int64_t>(number_);
}

double WireReader::single() const {
  if (kind_ != Kind::fixed32) fail("no number where one must stand");
  return single_at(value_, 0);
}

std::string_view WireReader::bytes() const {
  if (kind_ != Kind::bytes) fail("no text or message where one must stand");
  return value_;
}

void WireReader::integers(std::vector<std::int64_t>& out) const {
  if (kind_ == Kind::varint) {
    out.push_back(integer());
    return;
  }
  for (std::string_view packed = bytes(); !packed.empty();) out.push_back(static_cast<std::int64_t>(varint(packed)));
}

void WireReader::singles(std::vector<double>& out) const {
  const bool packed = kind_ == Kind::bytes;
  if ((!packed && kind_ != Kind::fixed32) || value_.size() % 4 != 0) fail("numbers that are no floats");
  for (std::size_t at = 0; at < value_.size(); at += 4) out.push_back(single_at(value_, at));
}

void WireReader::doubles(std::vector<double>& out) const {
  const bool packed = kind_ == Kind::bytes;
  if ((!packed && kind_ != Kind::fixed64) || value_.size() % 8 != 0) fail("numbers that are no doubles");
  for (std::size_t at = 0; at < value_.size(); at += 8) out.push_back(double_at(value_, at));
}

}  // namespace graze
