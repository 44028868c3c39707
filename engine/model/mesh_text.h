#pragma once
// What text mesh files say, looked at before a library reads them: it leaves out what it does not understand, and makes
// another shape of the rest.

#include <string>
#include <string_view>

namespace graze {

/// What is wrong with words that must be three finite numbers (and may be followed by others), or "".
std::string vertex_problem(std::string_view words);

/// A binary STL file is as long as its head says: 84 bytes and 50 for each triangle.
bool is_binary_stl(const std::string& bytes);

/// Refuses STL files that are no such file and cut off: binary ones of another length; text whose facets have not three
/// vertices of three numbers, or whose last solid does not end. Throws InputError with file and line.
void check_stl(const std::string& bytes, const std::string& file);

/// Refuses faces of a PLY text file that claim more corners than a polygon may have. Throws InputError with file and
/// line.
void check_ply_faces(const std::string& bytes, const std::string& file);

/// A library's message, fit for a line: clipped, and without control characters.
std::string fit_for_a_line(std::string_view said);

}  // namespace graze
