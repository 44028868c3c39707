#pragma once
// Columns of numbers in the data of a page: as they are, or packed to stay small.

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace graze {

using Json = nlohmann::ordered_json;

/// plain: an array of numbers of six digits, null for what is not finite. packed: {"n", "lo", "hi", "u16"}: so many
/// unsigned 16-bit numbers, little endian, in base64; 0 … 65534 stand for lo … hi, 65535 for null. A column of a plot
/// needs no more, and takes a third of the bytes.
enum class NumberForm { plain, packed };

Json numbers(std::span<const double> values, NumberForm form);
/// The number of six digits next to x; null if it is not finite.
Json short_number(double x);
/// RFC 4648, with padding.
std::string base64(std::string_view bytes);

}  // namespace graze
