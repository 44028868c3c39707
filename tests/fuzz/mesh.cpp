// Claim: any bytes are a mesh of finite vertices, with a convex hull that holds them, or are refused with an
// InputError. The first byte of an input says which kind of file the rest is.

#include <cstdint>
#include <cstdlib>
#include <string>

#include "engine/model/convex_hull.h"
#include "engine/model/mesh_parts.h"
#include "engine/model/urdf.h"
#include "engine/settings/inputs.h"
#include "engine/settings/settings.h"
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/xml_mutator.h"

namespace {

/// Those that are looked into before assimp is, and two that it takes alone.
const char* name_of(std::uint8_t kind) {
  switch (kind) {
    case 'o':
      return "/m.obj";
    case 's':
      return "/m.stl";
    case 'd':
      return "/m.dae";
    case 'p':
      return "/m.ply";
    default:
      return "/m.off";
  }
}

void check(const graze::Mesh& mesh) {
  for (const graze::Vec3& vertex : mesh.vertices) {
    if (!vertex.allFinite()) std::abort();
  }
  for (const Eigen::Vector3i& t : mesh.triangles) {
    if (t.minCoeff() < 0 || t.maxCoeff() >= static_cast<int>(mesh.vertices.size())) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string name = name_of(data[0]);
  const graze::InputReplay files({{name, {reinterpret_cast<const char*>(data) + 1, size - 1}}}, "/");
  try {
    const auto mesh = graze::load_mesh(name);
    check(*mesh);
    check(*graze::collision_hull(*mesh));
  } catch (const graze::InputError&) {
  }
  try {
    std::vector<std::string> doubts;
    for (const auto& part : graze::convex_parts(name, doubts)) check(*part);
  } catch (const graze::InputError&) {
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  graze::fuzz::Dice dice(seed);
  if (size < 2 || data[0] != 'd' || dice.one_in(4)) return LLVMFuzzerMutate(data, size, most);
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  return graze::fuzz::put("d" + graze::fuzz::mutated_xml(text, dice), data, size, most);
}
