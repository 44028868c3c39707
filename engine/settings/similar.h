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

/// How many letters must be changed, put in, left out or swapped with their neighbour to make the one word the other;
/// upper and lower case are the same.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace graze
