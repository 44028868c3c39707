#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

namespace graze {

/// Throws std::invalid_argument with the rule that a value breaks.
template <typename... Args>
[[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) {
  throw std::invalid_argument(fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace graze
