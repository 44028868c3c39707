#pragma once
// Concave collision meshes as convex parts.

#include <memory>
#include <string>
#include <vector>

#include "engine/model/world.h"
#include "engine/settings/settings.h"

namespace graze {

/// A concave mesh of one piece, of which there are no parts.
class ConcavePiece : public InputError {
 public:
  ConcavePiece(const std::string& what, std::string lacks) : InputError(what), lacks_(std::move(lacks)) {}
  /// "there is no folder grip_parts"
  const std::string& lacks() const { return lacks_; }

 private:
  std::string lacks_;
};

/// The convex hulls of the parts that a collision mesh is made of, in order:
///   1. of the mesh files in the folder beside it that is called as it is, without its ending and with "_parts" behind:
///      "gripper_parts" of "gripper.stl"; in the order of their names;
///   2. without such a folder, of the objects in the file (objects and groups of OBJ, solids of STL, nodes of DAE),
///   those
///      that are not convex by their pieces;
///   3. of a file of one object, of its pieces: those triangles that hang together by common corners.
/// Flat parts of a file enclose nothing and are left out. A mesh of one piece that (nearly) is convex is one part.
/// Throws ConcavePiece for a concave mesh of one piece, and InputError for more than kMaxMeshHulls parts, and for files
/// that cannot be read. `doubts`: parts of several that are not convex themselves are added, in words.
std::vector<std::shared_ptr<const Mesh>> convex_parts(const std::string& file, std::vector<std::string>& doubts);

}  // namespace graze
