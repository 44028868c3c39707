#pragma once
// How much a Collada (DAE) file asks for, before a library takes it apart.

#include <string>

namespace graze {

/// A DAE file says of nodes that they are used again, and these may hold others that are: a few lines can stand for any
/// number of copies; and the library trusts its indices and counts. Throws InputError with file and line for a file
/// that is not XML, whose nodes hold themselves, or that stands for more than kMaxMeshParts nodes, or a hundred in each
/// other, or with an index or count that is none.
void check_dae_size(const std::string& bytes, const std::string& file);

}  // namespace graze
