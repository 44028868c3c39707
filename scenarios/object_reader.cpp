// Shapes and poses of environment objects.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "engine/model/convex_hull.h"
#include "engine/model/direction.h"
#include "engine/model/mesh_parts.h"
#include "engine/model/mesh_size.h"
#include "engine/model/rotation.h"
#include "engine/model/urdf.h"
#include "engine/settings/merged.h"
#include "engine/settings/units.h"
#include "engine/settings/warnings.h"
#include "scenarios/csv.h"
#include "scenarios/hull_reader.h"
#include "scenarios/limits.h"
#include "scenarios/shapes.h"
#include "scenarios/spectrum.h"
#include "scenarios/world_reader.h"

namespace graze {
namespace {

std::vector<double> positive_numbers(const Settings& settings, int n) {
  std::vector<double> out = checked_lengths(settings, n);
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (out[i] > 0) continue;
    item_place(settings, i).fail(fmt::format("{:g} m: must be > 0; a size of nothing is no shape", out[i]));
  }
  return out;
}

double positive_length(const Settings& settings) {
  return checked_length(settings, settings.positive(Quantity::length));
}

Shape read_box(const Described& own) {
  const std::vector<double> size = positive_numbers(own.settings(), 3);
  return {ShapeKind::box, {size[0], size[1], size[2]}, nullptr, nullptr};
}

Shape read_sphere(const Described& own) {
  return {ShapeKind::sphere, {positive_length(own.settings()), 0, 0}, nullptr, nullptr};
}

Shape read_round(const Described& own, ShapeKind kind) {
  if (!own.settings().is_map()) {
    const std::vector<double> size = positive_numbers(own.settings(), 2);
    return {kind, {size[0], size[1], 0}, nullptr, nullptr};
  }
  const double radius = positive_length(own.at("radius")), length = positive_length(own.at("length"));
  return {kind, {radius, length, 0}, nullptr, nullptr};
}

Shape read_cylinder(const Described& own) { return read_round(own, ShapeKind::cylinder); }
Shape read_capsule(const Described& own) { return read_round(own, ShapeKind::capsule); }

/// Refuses a mesh that its scale, or the file alone, makes too large.
void check_extent(const Settings& where, const Shape& shape) {
  const std::string problem = length_problem(largest_coordinate(shape));
  if (!problem.empty()) where.fail(fmt::format("the mesh reaches as far as {}", problem));
}

/// Of a scale: `1 cm` is meant as the factor that makes metres of numbers in cm, and is not one.
void refuse_length(const Settings& scale) {
  for (const Settings& item : scale.items()) {
    const std::string text = item.is_scalar() ? item.text() : "";
    const auto written = split_number(text);  // looks into the text
    const auto metres =
        written && !written->unit.empty() ? to_si(Quantity::length, written->value, written->unit) : std::nullopt;
    if (metres)
      item.fail(fmt::format("{}: a scale is a factor and has no unit of length; did you mean {:g}?", text, *metres));
  }
}

/// Its convex hull, or, where `split`, the hulls of its convex parts.
std::vector<Shape> read_hulls(const Described& own, bool split) {
  const Settings& s = own.settings();
  Vec3 size = Vec3::Ones();
  Settings file = s;
  if (s.is_map()) {
    file = own.at("file");
    if (const auto scale = own.find("scale")) {
      refuse_length(*scale);
      const std::vector<double> factors = scale->numbers(scale->is_list() ? 3 : 1);
      for (int i = 0; i < 3; ++i) size[i] = factors[factors.size() == 3 ? i : 0];
      if (!(size.minCoeff() > 0)) scale->fail(fmt::format("{:g}: scale factors must be > 0", size.minCoeff()));
    }
  }
  const std::string path = file.resolve_file(file.text());
  const HullSettings hull = s.is_map() ? read_hull(s) : HullSettings();
  std::vector<Shape> out;
  try {
    std::vector<std::string> doubts;
    for (const auto& mesh : split ? convex_parts(path, doubts) : std::vector{collision_hull(*load_mesh(path))}) {
      out.push_back({ShapeKind::mesh, size, mesh, nullptr, simplified_hull(*mesh, size, hull)});
    }
    for (const std::string& doubt : doubts) warn(file, doubt);
  } catch (const ConcavePiece& piece) {
    file.fail(fmt::format("{}, or leave out 'hulls' for one hull", piece.what()));
  } catch (const InputError& e) {
    file.fail(e.what());
  }
  for (const Shape& shape : out) check_extent(s.is_map() ? s.find("scale").value_or(file) : file, shape);
  return out;
}

Shape read_mesh(const Described& own) { return read_hulls(own, false).front(); }

std::shared_ptr<const HeightGrid> read_heights(const Settings& s) {
  std::vector<std::vector<double>> rows;
  if (s.has("csv")) {
    rows = read_grid(s.at("csv"), kMaxHeights);
  } else {
    for (const Settings& row : s.at("heights").items()) rows.push_back(row.numbers(-1, Quantity::length));
  }
  auto grid = std::make_shared<HeightGrid>();
  grid->ny = static_cast<int>(rows.size());
  grid->nx = rows.empty() ? 0 : static_cast<int>(rows[0].size());
  if (grid->nx < 2 || grid->ny < 2)
    s.fail(fmt::format("a grid of {} x {} heights; at least 2 x 2", grid->ny, grid->nx));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (static_cast<int>(rows[i].size()) != grid->nx) {
      s.fail(fmt::format("row {} has {} heights, the first has {}; all must have as many", i + 1, rows[i].size(),
                         grid->nx));
    }
    grid->height.insert(grid->height.end(), rows[i].begin(), rows[i].end());
  }
  return grid;
}

/// Refuses heights that are too large, once they are scaled, at the cell.
void check_heights(const Settings& s, const HeightGrid& grid, double factor) {
  for (std::size_t i = 0; i < grid.height.size(); ++i) {
    const std::string problem = length_problem(grid.height[i] * factor);
    if (problem.empty()) continue;
    const std::size_t row = i / static_cast<std::size_t>(grid.nx), column = i % static_cast<std::size_t>(grid.nx);
    const Settings where = s.has("csv") ? s.at("csv") : item_place(item_place(s.at("heights"), row), column);
    where.fail(fmt::format("height [{}][{}]{}: {}", row, column, factor == 1 ? "" : fmt::format(" times {:g}", factor),
                           problem));
  }
}

Shape read_heightfield(const Described& own) {
  const Settings& s = own.settings();
  const std::vector<double> size = positive_numbers(own.at("size"), 2);
  if (const auto spectrum = own.find("spectrum")) {
    if (s.has("scale")) s.at("scale").fail_key("does not go with 'spectrum', whose 'rms' says how high the ground is");
    return read_spectrum(*spectrum, size[0], size[1]);
  }
  if (const auto scale = own.find("scale")) refuse_length(*scale);
  const double factor = own.number("scale");
  Shape shape{ShapeKind::heightfield, {size[0], size[1], factor}, nullptr, read_heights(s)};
  check_heights(s, *shape.grid, factor);
  return shape;
}

Vec3 read_normal(const Settings& s) {
  if (s.is_scalar()) {
    const std::string axis = s.choice({"x", "y", "z"});
    return axis == "x" ? Vec3::UnitX() : axis == "y" ? Vec3::UnitY() : Vec3::UnitZ();
  }
  const std::vector<double> n = s.numbers(3);
  const Vec3 normal = direction(Vec3(n[0], n[1], n[2]));
  if (normal.isZero()) s.fail("the normal has no length");
  return normal;
}

/// Which way it faces read_object_pose() tells.
Shape read_plane(const Described& own) {
  read_normal(own.settings());
  return {ShapeKind::plane, Vec3::Zero(), nullptr, nullptr};
}

Description mesh_description() {
  Description out{"the convex hull of a mesh file",
                  {{"file", {Form::text("FILE")}, Default::required(), "OBJ or STL"},
                   {"scale",
                    {Form::number(Quantity::dimensionless, Bound::positive), Form::numbers(3)},
                    Default::value("1"),
                    "a factor, or one for each axis: 0.01 for a file in cm"}},
                  {},
                  {Form::text("FILE")},
                  "A file alone is its name."};
  for (const Key& key : hull_keys()) out.keys.push_back(key);
  out.keys.push_back({"hulls",
                      {Form::flag()},
                      Default::value("false"),
                      "a concave mesh as several hulls, as for `robot.mesh`: parts `NAME`, `NAME.1`, … of one object"});
  return out;
}

std::vector<ShapeForm> own_forms() {
  const Form length = Form::number(Quantity::length, Bound::positive);
  const auto lengths = [](int n) { return Form::numbers(n, Quantity::length, Bound::positive); };
  const std::vector<Key> round = {{"radius", {length}, Default::required(), "of the circle"},
                                  {"length", {length}, Default::required(), "along z; of a capsule without its caps"}};
  return {
      {"plane",
       {"its normal, an axis or a vector; solid below", {}, {}, {Form::word({"x", "y", "z"}), Form::numbers(3)}},
       read_plane},
      {"box", {"its edge lengths, `[x, y, z]`", {}, {}, {lengths(3)}}, read_box},
      {"sphere", {"its radius", {}, {}, {length}}, read_sphere},
      {"cylinder",
       {"a cylinder about its z axis", round, {}, {lengths(2)}, "`[radius, length]` is short for the map."},
       read_cylinder},
      {"capsule",
       {"a cylinder about its z axis with half a sphere at both ends",
        round,
        {},
        {lengths(2)},
        "`[radius, length]` is short for the map."},
       read_capsule},
      {"mesh", mesh_description(), read_mesh},
      {"heightfield",
       {"terrain of heights on a grid about its middle, solid below",
        {{"size", {lengths(2)}, Default::required(), "extent `[x, y]`"},
         {"csv", {Form::text("FILE")}, {}, "heights: row along y, column along x"},
         {"heights", {Form::rows(-1, Quantity::length)}, {}, "`[[…], …]`: row along y, column along x"},
         {"spectrum", {Form::map(spectrum_description())}, {}, spectrum_description().help},
         {"scale",
          {Form::number(Quantity::dimensionless, Bound::positive)},
          Default::value("1"),
          "factor of the heights: 0.01 for heights in cm"}},
        {{"csv", "heights", "spectrum"}}},
       read_heightfield},
  };
}

/// The key of the one shape that an object has.
std::string shape_key(const Settings& object) {
  std::optional<SettingsEntry> kind;
  for (const SettingsEntry& entry : object.entries()) {
    if (kind_of(shape_forms(), entry.first) == nullptr) continue;
    if (kind) {
      entry.second.fail_key(
          fmt::format("a second shape beside '{}'; an object has one{}", kind->first, replace_hint(*kind, entry)));
    }
    kind.emplace(entry);
  }
  if (!kind) object.fail(fmt::format("names no shape; one of: {}", fmt::join(names_of(shape_forms()), ", ")));
  return kind->first;
}

}  // namespace

Settings shape_settings(const Settings& object) { return object.at(shape_key(object)); }

const std::vector<ShapeForm>& shape_forms() {
  static const std::vector<ShapeForm> forms = with_registered(own_forms());
  return forms;
}

std::vector<Shape> read_shapes(const Settings& object) {
  const ShapeForm& form = *kind_of(shape_forms(), shape_key(object));
  const Settings shape = object.at(form.name);
  const Described own(shape, form.text);
  if (form.name == "mesh" && shape.is_map() && shape.flag_or("hulls", false)) return read_hulls(own, true);
  return {form.read(own)};
}

Pose read_object_pose(const Settings& object, const Shape& shape) {
  Pose X_WO = Pose::Identity();
  if (const auto position = object.find("position")) {
    const std::vector<double> p = checked_lengths(*position, 3);
    X_WO.translation() = Vec3(p[0], p[1], p[2]);
  }
  if (const auto rpy = object.find("rpy")) {
    const std::vector<double> angles = rpy->numbers(3, Quantity::angle);
    X_WO.linear() = rotation_from_rpy({angles[0], angles[1], angles[2]});
  }
  if (shape.kind == ShapeKind::plane) {
    const Vec3 normal = read_normal(object.at("plane"));
    X_WO.linear() = X_WO.linear() * Quat::FromTwoVectors(Vec3::UnitZ(), normal).toRotationMatrix();
  }
  return X_WO;
}

}  // namespace graze
