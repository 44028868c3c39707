#pragma once
// How much a mesh file asks for, before a library takes it apart, and how large what it holds is.

#include <string>
#include <string_view>

#include "engine/model/world.h"

namespace graze {

/// Refuses OBJ and STL files that would take too much memory or time: more vertices, faces, corners of one face or
/// parts than engine/model/limits.h allows. `file` stands in the message, and its end says which kind it is. Throws
/// InputError with file and line.
void check_mesh_size(const std::string& bytes, const std::string& file);

/// Refuses a PLY file whose head does not end: the library would look for its end for ever. Throws InputError.
void check_ply_head(const std::string& bytes, const std::string& file);

/// The first whole number in a text that is too large for an index, or nothing. A library that reads 4294967297 in 32
/// bits finds 1.
std::string_view large_index(std::string_view text);

/// How far the scaled vertices of a mesh lie from its origin at most, along an axis, m.
double largest_coordinate(const Shape& mesh);

}  // namespace graze
