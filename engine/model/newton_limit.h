#pragma once

#include <cstddef>

namespace graze {

struct Model;

/// Degrees of freedom, of the robot and of movable objects, beyond which the lanes sweep only, or use newton_tree.h,
/// which forms no matrix: Newton's matrix and its elimination cost too much (our choice).
inline constexpr std::size_t kMostNewtonDofs = 160;

/// Degrees of freedom on some body's way to its base from which on newton_tree.h comes first: our choice, found on
/// chains that lie limp. Campaigns of those with 18 and 30 take as long as without, with 66 two thirds.
inline constexpr int kDeepTree = 24;

/// Whether it does: some body is that far, and no joint follows another.
bool is_deep_tree(const Model& model);

}  // namespace graze
