#include "jobs/cli/hull_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>

#include "analysis/text_table.h"
#include "archive/files/utf8.h"
#include "engine/model/hull.h"

namespace graze {

namespace {

/// Calls f(collider, hull) for each collision mesh.
template <class F>
void each_mesh(const Model& model, const F& f) {
  for (const Collider& collider : model.colliders) {
    if (collider.shape.kind == ShapeKind::mesh) f(collider, *hull_of(collider.shape));
  }
}

}  // namespace

std::string hull_table(const Model& model) {
  std::vector<std::vector<std::string>> rows = {{"collision mesh", "file", "vertices of its hull", "kept", "error"}};
  each_mesh(model, [&](const Collider& collider, const Hull& hull) {
    rows.push_back({collider.name, std::filesystem::path(collider.shape.mesh->file).filename().string(),
                    std::to_string(hull.of), std::to_string(hull.corners.size()),
                    hull.error > 0 ? fmt::format("{:.2g} mm", 1e3 * hull.error) : "-"});
  });
  return rows.size() > 1 ? "\n" + text_table(rows, 2) : "";
}

nlohmann::json hulls_as_json(const Model& model) {
  nlohmann::json out = nlohmann::json::array();
  each_mesh(model, [&](const Collider& collider, const Hull& hull) {
    out.push_back({{"part", collider.name},
                   {"file", collider.shape.mesh->file},
                   {"vertices", hull.corners.size()},
                   {"of", hull.of},
                   {"error", hull.error}});
  });
  return out;
}

nlohmann::json objects_as_json(const World& world) {
  nlohmann::json out = nlohmann::json::array();
  for (const Object& object : world.objects) {
    if (!object.movable) continue;
    const Vec3 com = object.inertia.com();
    const Mat3 inertia = object.inertia.inertia_about_com();
    nlohmann::json rows = nlohmann::json::array();
    for (int i = 0; i < 3; ++i) rows.push_back({inertia(i, 0), inertia(i, 1), inertia(i, 2)});
    out.push_back({{"name", object.name},
                   {"parts", 1 + object.more.size()},
                   {"mass", object.inertia.mass},
                   {"com", {com.x(), com.y(), com.z()}},
                   {"inertia", rows}});
  }
  return out;
}

std::string object_masses(const World& world) {
  constexpr std::size_t kMost = 4;
  std::vector<std::string> out;
  for (const Object& object : world.objects) {
    if (!object.movable) continue;
    if (out.size() == kMost) {
      out.push_back("…");
      break;
    }
    out.push_back(fmt::format("{} {:.3g} kg", printable(object.name), object.inertia.mass));
  }
  return out.empty() ? "" : fmt::format(" ({})", fmt::join(out, ", "));
}

}  // namespace graze
