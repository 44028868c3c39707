#pragma once

#include <cstddef>

namespace graze {

/// Degrees of freedom, of the robot and of movable objects, beyond which the lanes sweep only: Newton's matrix and its
/// elimination cost too much (our choice).
inline constexpr std::size_t kMostNewtonDofs = 160;

}  // namespace graze
