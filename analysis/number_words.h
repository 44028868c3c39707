#pragma once
// Numbers in words, for people.

#include <cstddef>
#include <string>

namespace graze {

struct Interval;

/// "0.1234 .. 0.5678"
std::string interval_text(const Interval& interval, int digits = 4);

/// "1 parameter is", "3 parameters are"
std::string counted(std::size_t n, const char* one, const char* several);

/// A p-value: "0.0039", with `digits` digits at most; "< 1e-300" below that, where doubles end and it would come out as
/// 0, which no test can show; "-": NaN.
std::string p_text(double p, int digits = 2);
/// "p = 0.0039", "p < 1e-300".
std::string p_equation(double p, int digits = 2);

}  // namespace graze
