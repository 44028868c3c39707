#pragma once
// What a name that is none of those there are may have meant, when it may be a glob or a part of a longer name.

#include <string>
#include <string_view>
#include <vector>

namespace graze {

/// For a name or glob that matches none of `names`: "; did you mean hip?"; if none is near, a name or (where `globs`
/// may stand) a glob that has the word in it, "; did you mean '*_hip*' (FR_hip_joint, …)?"; else "; there are: hip,
/// knee".
std::string similar_names(std::string_view word, const std::vector<std::string>& names, bool globs);

}  // namespace graze
