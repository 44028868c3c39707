#pragma once
// Assimp, loaded when the first mesh file is read. To load it costs more than all else that a program without meshes
// does to begin: a quarter of its page faults.

#include <string>

struct aiScene;

namespace graze {

class AssimpLibrary {
 public:
  /// Loads it where that has not been done. Throws MachineError if it is not installed.
  static const AssimpLibrary& get();

  /// Whether files of this kind, such as ".stl", can be read.
  bool reads(const std::string& kind) const;
  /// What a file holds, as its nodes have it. `name`: the file's, without folders; `said`: why there is nothing. No
  /// other file is opened. What is returned is never given back: this is for a child process.
  const aiScene* read(const std::string& name, const std::string& bytes, std::string& said) const;
  /// The same with its faces cut into triangles. All of them must have corners.
  const aiScene* triangulate(const aiScene& scene, std::string& said) const;

 private:
  AssimpLibrary();
  struct Functions;
  const Functions* functions_;
};

}  // namespace graze
