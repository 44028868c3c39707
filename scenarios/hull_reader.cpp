#include "scenarios/hull_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "scenarios/names.h"

namespace graze {

std::vector<Key> hull_keys() {
  return {{"vertices",
           {Form::whole(Bound::positive)},
           Default::value("128"),
           "of its hull, at most, for contact; at least 8. They may leave a larger error than the next line"},
          {"error",
           {Form::number(Quantity::length, Bound::positive)},
           Default::words("the smaller of 1 mm and 1 % of the size"),
           "how far the hull may reach out of the simpler one"},
          {"exact", {Form::flag()}, Default::value("false"), "the whole hull, however many vertices it has"}};
}

std::vector<Key> robot_hull_keys() {
  std::vector<Key> out = hull_keys();
  out.push_back({"hulls",
                 {Form::flag(), Form::texts(-1, "LINK"), Form::text("LINK")},
                 Default::value("false"),
                 "concave meshes as several hulls, of all links or of these: of the meshes in a folder `gripper_parts` "
                 "beside `gripper.stl`, or of the objects or separate pieces in the file"});
  return out;
}

HullSettings read_hull(const Settings& map) {
  HullSettings out;
  out.exact = map.flag_or("exact", false);
  if (const auto vertices = map.find("vertices")) {
    const long long count = vertices->integer();
    constexpr long long kFewest = HullSettings::kFewest;
    if (count < kFewest) vertices->fail(fmt::format("{}: a hull has at least {} vertices, as a box", count, kFewest));
    out.vertices = static_cast<std::size_t>(count);
  }
  if (const auto error = map.find("error")) out.error = error->positive(Quantity::length);
  for (const char* bound : {"vertices", "error"}) {
    if (out.exact && map.has(bound)) map.at(bound).fail_key("does not go with 'exact: true', which keeps all vertices");
  }
  return out;
}

namespace {

/// The globs of `hulls`, with where they stand; none for all links.
std::vector<Settings> globs_of(const Settings& hulls) {
  if (hulls.is_list()) return hulls.items();
  const std::string text = hulls.text();
  return text == "true" || text == "false" ? std::vector<Settings>() : std::vector<Settings>{hulls};
}

}  // namespace

std::vector<std::string> read_split(const Settings& mesh) {
  if (mesh.is_scalar()) {
    mesh.choice({"hulls"});
    return {};
  }
  const auto hulls = mesh.find("hulls");
  if (!hulls) return {};
  if (hulls->is_list() && hulls->items().empty()) {
    hulls->fail("names no link; it must name at least one, or be 'false' for none and 'true' for all");
  }
  std::vector<std::string> out;
  for (const Settings& glob : globs_of(*hulls)) out.push_back(glob.text());
  return out;
}

bool splits_all(const Settings& mesh) {
  if (mesh.is_scalar()) return true;
  const auto hulls = mesh.find("hulls");
  return hulls && globs_of(*hulls).empty() && !hulls->is_list() && hulls->flag();
}

void check_split(const Settings& mesh, const Robot& robot) {
  const auto hulls = mesh.is_scalar() ? std::nullopt : mesh.find("hulls");
  if (!hulls) return;
  std::vector<std::string> links;
  for (const Link& link : robot.links) {
    const auto is_mesh = [](const Geometry& one) { return one.shape.kind == ShapeKind::mesh; };
    if (std::any_of(link.collisions.begin(), link.collisions.end(), is_mesh)) links.push_back(link.name);
  }
  for (const Settings& glob : globs_of(*hulls)) match_names(glob, glob.text(), links, "link with a collision mesh");
}

}  // namespace graze
