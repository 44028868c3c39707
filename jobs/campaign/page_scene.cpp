#include "jobs/campaign/page_scene.h"

#include <algorithm>
#include <map>

#include "engine/model/measures.h"

namespace graze {
namespace {

const char* kind_name(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::box:
      return "box";
    case ShapeKind::sphere:
      return "sphere";
    case ShapeKind::cylinder:
      return "cylinder";
    case ShapeKind::capsule:
      return "capsule";
    case ShapeKind::mesh:
      return "mesh";
    case ShapeKind::plane:
      return "plane";
    case ShapeKind::heightfield:
      return "heightfield";
  }
  return "";
}

Json mesh_json(const Mesh& mesh, NumberForm form) {
  std::vector<double> vertices;
  Json triangles = Json::array();
  for (const Vec3& p : mesh.vertices) vertices.insert(vertices.end(), p.data(), p.data() + 3);
  for (const Eigen::Vector3i& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) triangles.push_back(t[i]);
  }
  return {{"vertices", numbers(vertices, form)}, {"triangles", triangles}};
}

/// Each thing once, by its address.
template <class Thing>
class Numbered {
 public:
  Json index(const std::shared_ptr<const Thing>& thing) {
    if (!thing) return nullptr;
    const auto [at, fresh] = index_.emplace(thing.get(), things_.size());
    if (fresh) things_.push_back(thing.get());
    return at->second;
  }
  const std::vector<const Thing*>& things() const { return things_; }

 private:
  std::map<const Thing*, std::size_t> index_;
  std::vector<const Thing*> things_;
};

}  // namespace

Json scene_json(const Model& model, NumberForm form) {
  Numbered<Mesh> meshes;
  Numbered<HeightGrid> grids;
  Json colliders = Json::array(), bodies = Json::array(), mesh_list = Json::array(), grid_list = Json::array();
  for (const Body& body : model.bodies) bodies.push_back({{"name", body.name}, {"parent", body.parent}});
  for (const Collider& one : model.colliders) {
    colliders.push_back({{"name", one.name},
                         {"body", one.body},
                         {"object", one.is_object},
                         {"kind", kind_name(one.shape.kind)},
                         {"mesh", meshes.index(one.shape.mesh)},
                         {"grid", grids.index(one.shape.grid)}});
  }
  for (const Mesh* mesh : meshes.things()) mesh_list.push_back(mesh_json(*mesh, form));
  for (const HeightGrid* grid : grids.things()) {
    grid_list.push_back({{"nx", grid->nx}, {"ny", grid->ny}, {"height", numbers(grid->height, form)}});
  }
  return {{"bodies", bodies},
          {"colliders", colliders},
          {"meshes", mesh_list},
          {"grids", grid_list},
          {"weight", short_number(robot_weight(model))},
          {"floating_base", model.floating_base}};
}

Json bodies_json(const TraceFrames& frames, NumberForm form) {
  Json shapes = Json::array(), poses = Json::array(), pairs = Json::array(), frame = Json::array();
  Json grounds = Json::object();
  for (const FrameShape& shape : frames.shapes) {
    const Quat r(shape.X_BG.linear());
    const Vec3 p = shape.X_BG.translation();
    const std::vector<double> row = {shape.size.x(), shape.size.y(), shape.size.z(), p.x(), p.y(),
                                     p.z(),          r.x(),          r.y(),          r.z(), r.w()};
    if (shape.ground) grounds[std::to_string(shapes.size())] = numbers(shape.ground->height, form);
    shapes.push_back(numbers(row, NumberForm::plain));
  }
  for (const std::vector<double>& row : frames.poses) poses.push_back(numbers(row, form));
  std::vector<double> points, normals, impulses;
  for (const FrameContact& contact : frames.contacts) {
    frame.push_back(contact.frame);
    pairs.push_back(contact.a);
    pairs.push_back(contact.b);
    points.insert(points.end(), contact.p_W.data(), contact.p_W.data() + 3);
    normals.insert(normals.end(), contact.n_W.data(), contact.n_W.data() + 3);
    impulses.push_back(contact.normal_impulse);
  }
  return {{"shapes", shapes},
          {"grounds", grounds},  // heights by collider, where the particle has its own
          {"poses", poses},
          {"contacts",
           {{"frame", frame},
            {"pairs", pairs},
            {"points", numbers(points, form)},
            {"normals", numbers(normals, form)},
            {"impulses", numbers(impulses, form)}}}};
}

}  // namespace graze
