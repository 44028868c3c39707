// Pictures in space: paths of the base from above, from the side and obliquely, and robots as they stood from time to
// time.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/plots_played.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

using FlatPoint = std::pair<double, double>;  // m, along both axes of a panel

/// Isometric: x goes to the right and up, y to the left and up, z up, all in their length.
FlatPoint seen(PathView view, const PlotPoint& p) {
  if (view == PathView::above) return {p[0], p[1]};
  if (view == PathView::side) return {p[0], p[2]};
  const double cos30 = std::sqrt(0.75);
  return {cos30 * (p[0] - p[1]), 0.5 * (p[0] + p[1]) + p[2]};
}

/// Lines through points of the world, one behind the other.
class SeenLines {
 public:
  SeenLines(PathView view, PlotSeries look) : view_(view), out_(std::move(look)) {}
  void add(const std::vector<PlotPoint>& line) {
    for (const PlotPoint& p : line) add_flat(seen(view_, p));
    if (!line.empty()) add_flat({std::nan(""), std::nan("")});
  }
  bool empty() const { return out_.x.empty(); }
  PlotSeries take() { return std::move(out_); }

 private:
  void add_flat(const FlatPoint& p) {
    out_.x.push_back(p.first);
    out_.y.push_back(p.second);
  }
  PathView view_;
  PlotSeries out_;
};

PlotPanel empty_panel(PathView view, const std::string& title) {
  PlotPanel out{title, {"x [m]"}, {view == PathView::side ? "z [m]" : "y [m]"}};
  out.one_scale = true;
  out.height = view == PathView::side ? 160 : 380;
  if (view != PathView::isometric) return out;
  for (PlotAxis* axis : {&out.x, &out.y}) {  // numbers along them would be of nothing
    axis->title.clear();
    axis->labels = {{0, ""}};
    axis->grid = false;
  }
  return out;
}

/// A rectangle from above that holds points.
struct SeenFloor {
  double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
  void add(const PlotPoint& p) {
    for (std::size_t k = 0; k < 2; ++k) {
      if (!std::isfinite(p[k])) continue;
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  /// With a third of its longer side about it, 20 cm at least.
  SeenFloor with_surroundings() const {
    const double more = std::max({0.2, (high[0] - low[0]) / 3, (high[1] - low[1]) / 3});
    SeenFloor out = *this;
    for (std::size_t k = 0; k < 2; ++k) out.low[k] -= more, out.high[k] += more;
    return out;
  }
  /// The part of a line within; empty: none (Liang and Barsky).
  std::vector<PlotPoint> part(const PlotPoint& a, const PlotPoint& b) const {
    double from = 0, to = 1;
    for (std::size_t k = 0; k < 2; ++k) {
      const double way = b[k] - a[k];
      if (way == 0 && (a[k] < low[k] || a[k] > high[k])) return {};
      if (way == 0) continue;
      const double s = (low[k] - a[k]) / way, t = (high[k] - a[k]) / way;
      from = std::max(from, std::min(s, t));
      to = std::min(to, std::max(s, t));
    }
    if (from > to) return {};
    const auto at = [&](double t) {
      return PlotPoint{a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
    };
    return {at(from), at(to)};
  }
};

/// What stands about, as far as it is near: a floor may be a box of a hundred metres.
void add_surroundings(PathView view, const PathScene& scene, const SeenFloor& ground, PlotPanel& panel) {
  PlotSeries edge;
  edge.color = PlotColor::ink;
  edge.width = 1;
  SeenLines edges(view, edge);
  const SeenFloor near = ground.with_surroundings();
  for (const std::vector<PlotPoint>& line : scene.outlines) {
    for (std::size_t i = 0; i + 1 < line.size(); ++i) edges.add(near.part(line[i], line[i + 1]));
  }
  if (!edges.empty()) panel.series.push_back(edges.take());
  PlotSeries points = edge;
  points.kind = PlotSeries::Kind::marks;
  points.width = 6;
  for (const PlotPoint& p : scene.waypoints) {
    points.x.push_back(seen(view, p).first);
    points.y.push_back(seen(view, p).second);
  }
  if (!points.x.empty()) panel.series.push_back(std::move(points));
}

/// Heightfields behind the paths, as far as they are near. From above their heights do not show.
void add_nets(PathView view, const PathScene& scene, const SeenFloor& ground, PlotPanel& panel) {
  if (view == PathView::above) return;
  PlotSeries look;
  look.color = PlotColor::soft;
  look.width = 0.35;
  SeenLines net(view, look);
  const SeenFloor near = ground.with_surroundings();
  for (const std::vector<PlotPoint>& line : scene.terrain) {
    for (std::size_t i = 0; i + 1 < line.size(); ++i) net.add(near.part(line[i], line[i + 1]));
  }
  if (!net.empty()) panel.series.insert(panel.series.begin(), net.take());
}

/// Three arrows' worth of lines with their names, `length` each, at the least corner of what is drawn.
void add_axes_cross(PlotPanel& panel) {
  double left = INFINITY, right = -INFINITY, low = INFINITY;
  for (const PlotSeries& one : panel.series) {
    for (std::size_t i = 0; i < one.x.size(); ++i) {
      if (!std::isfinite(one.x[i]) || !std::isfinite(one.y[i])) continue;
      left = std::min(left, one.x[i]);
      right = std::max(right, one.x[i]);
      low = std::min(low, one.y[i]);
    }
  }
  if (!(left < right)) return;
  const double tens = std::pow(10, std::floor(std::log10((right - left) / 4)));
  const double length = tens * ((right - left) / 4 >= 5 * tens ? 5 : (right - left) / 4 >= 2 * tens ? 2 : 1);
  PlotSeries cross;
  cross.color = PlotColor::soft;
  cross.width = 1.2;
  const std::pair<const char*, PlotPoint> axes[] = {
      {"x", {length, 0, 0}}, {"y", {0, length, 0}}, {"z", {0, 0, length}}};
  const double x = left + 0.9 * length, y = low;
  for (const auto& [name, way] : axes) {
    const FlatPoint tip = seen(PathView::isometric, way);
    cross.x.insert(cross.x.end(), {x, x + tip.first, std::nan("")});
    cross.y.insert(cross.y.end(), {y, y + tip.second, std::nan("")});
    panel.words.push_back({x + 1.12 * tip.first, y + 1.12 * tip.second, name});
  }
  panel.words.push_back({x + 0.3 * length, y, fmt::format("{:g} m each", length)});
  panel.series.push_back(std::move(cross));
}

/// Frames that are nearest to 0, every, 2 every …, and each once.
std::vector<std::size_t> frames_at(const std::vector<double>& times, double every) {
  std::vector<std::size_t> out;
  for (std::size_t k = 0; every > 0 && !times.empty() && static_cast<double>(k) * every <= times.back() + 1e-9; ++k) {
    const double want = static_cast<double>(k) * every;
    const auto after = std::lower_bound(times.begin(), times.end(), want);
    auto i = static_cast<std::size_t>(after - times.begin());
    if (i == times.size() || (i > 0 && want - times[i - 1] < times[i] - want)) --i;
    if (out.empty() || out.back() != i) out.push_back(i);
  }
  return out;
}

std::string every_words(double every) { return fmt::format("{:g} s", every); }

/// A body's pose in a frame.
struct SeenPose {
  PlotPoint p;
  std::array<double, 4> q;  // x y z w
  PlotPoint of(const PlotPoint& local) const {
    // p + R local, R of a unit quaternion.
    const auto [x, y, z, w] = q;
    const PlotPoint t = {2 * (y * local[2] - z * local[1]), 2 * (z * local[0] - x * local[2]),
                         2 * (x * local[1] - y * local[0])};
    return {p[0] + local[0] + w * t[0] + y * t[2] - z * t[1], p[1] + local[1] + w * t[1] + z * t[0] - x * t[2],
            p[2] + local[2] + w * t[2] + x * t[1] - y * t[0]};
  }
};

/// Robots of one trace as lines: from each joint to the next and to the middle of what hangs there, boxes by their
/// edges.
class StickRobot {
 public:
  StickRobot(const Json& scene, const Json& bodies) : poses_(bodies["poses"]) {
    for (const Json& body : scene["bodies"]) parents_.push_back(body["parent"].get<int>());
    std::size_t k = 0;
    for (const Json& shape : bodies["shapes"]) {
      const Json& collider = scene["colliders"][k++];
      if (collider["object"].get<bool>() || collider["body"].get<int>() < 0) continue;
      Part part{collider["body"].get<std::size_t>(), collider["kind"].get<std::string>(), {}, {}};
      for (std::size_t i = 0; i < 3; ++i) part.size[i] = shape[i].get<double>();
      for (std::size_t i = 0; i < 3; ++i) part.X.p[i] = shape[3 + i].get<double>();
      for (std::size_t i = 0; i < 4; ++i) part.X.q[i] = shape[6 + i].get<double>();
      parts_.push_back(part);
    }
  }

  void add(std::size_t frame, SeenLines& out, SeenFloor& ground) const {
    for (std::size_t i = 0; i < parents_.size(); ++i) ground.add(pose(i, frame).p);
    for (std::size_t i = 0; i < parents_.size(); ++i) {
      if (parents_[i] >= 0) out.add({pose(static_cast<std::size_t>(parents_[i]), frame).p, pose(i, frame).p});
    }
    for (const Part& part : parts_) add_part(part, pose(part.body, frame), out);
  }

 private:
  struct Part {
    std::size_t body;
    std::string kind;
    PlotPoint size;
    SeenPose X;  // on the body
  };

  SeenPose pose(std::size_t body, std::size_t frame) const {
    const auto number = [&](std::size_t i) {
      const Json& x = poses_[7 * body + i][frame];
      return x.is_null() ? std::nan("") : x.get<double>();
    };
    return {{number(0), number(1), number(2)}, {number(3), number(4), number(5), number(6)}};
  }
  static void add_part(const Part& part, const SeenPose& body, SeenLines& out) {
    const auto at = [&](double x, double y, double z) { return body.of(part.X.of({x, y, z})); };
    if (part.kind != "box") {
      out.add({body.p, at(0, 0, 0)});
      const bool long_one = part.kind == "cylinder" || part.kind == "capsule";
      if (long_one) out.add({at(0, 0, -0.5 * part.size[1]), at(0, 0, 0.5 * part.size[1])});
      return;
    }
    const double x = 0.5 * part.size[0], y = 0.5 * part.size[1], z = 0.5 * part.size[2];
    for (const double h : {-z, z}) out.add({at(-x, -y, h), at(x, -y, h), at(x, y, h), at(-x, y, h), at(-x, -y, h)});
    for (const double u : {-x, x}) {
      for (const double v : {-y, y}) out.add({at(u, v, -z), at(u, v, z)});
    }
  }

  const Json& poses_;  // [7 per body][frame]
  std::vector<int> parents_;
  std::vector<Part> parts_;
};

/// A net over a heightfield: every n-th of its lines along x and along y, so that none has more than so many.
void add_net(const Json& shape, const Json& grid, const Json& heights, const SeenFloor& near, SeenLines& out) {
  constexpr std::size_t kLines = 40;
  const auto nx = grid["nx"].get<std::size_t>(), ny = grid["ny"].get<std::size_t>();
  const auto number = [&](std::size_t i) { return shape[i].get<double>(); };
  const SeenPose X{{number(3), number(4), number(5)}, {number(6), number(7), number(8), number(9)}};
  const auto at = [&](std::size_t ix, std::size_t iy) {
    const double u = static_cast<double>(ix) / static_cast<double>(nx - 1) - 0.5,
                 v = static_cast<double>(iy) / static_cast<double>(ny - 1) - 0.5;
    return X.of({u * number(0), v * number(1), heights[iy * nx + ix].get<double>() * number(2)});
  };
  const std::size_t step = (std::max(nx, ny) + kLines - 1) / kLines;
  for (std::size_t iy = 0; iy < ny; iy += step) {
    for (std::size_t ix = 0; ix + 1 < nx; ++ix) out.add(near.part(at(ix, iy), at(ix + 1, iy)));
  }
  for (std::size_t ix = 0; ix < nx; ix += step) {
    for (std::size_t iy = 0; iy + 1 < ny; ++iy) out.add(near.part(at(ix, iy), at(ix, iy + 1)));
  }
}

/// Puts the terrain that all traces of a panel stood on behind them. Returns whether some of it is left out, because
/// each had its own.
bool add_terrain(const Json& scene, const std::vector<const Json*>& traces, const SeenFloor& ground, PlotPanel& panel) {
  PlotSeries look;
  look.color = PlotColor::soft;
  look.width = 0.35;
  SeenLines net(PathView::isometric, look);
  bool left_out = false;
  std::size_t k = 0;
  for (const Json& collider : scene["colliders"]) {
    const std::size_t at = k++;
    if (collider["kind"] != "heightfield" || traces.empty()) continue;
    const Json &bodies = (*traces.front())["bodies"], &grid = scene["grids"][collider["grid"].get<std::size_t>()];
    const std::string number = std::to_string(at);
    const bool own = bodies["grounds"].contains(number);
    left_out = left_out || (own && traces.size() > 1);
    if (own && traces.size() > 1) continue;
    add_net(bodies["shapes"][at], grid, own ? bodies["grounds"][number] : grid["height"], ground.with_surroundings(),
            net);
  }
  if (!net.empty()) panel.series.insert(panel.series.begin(), net.take());
  return left_out;
}

void note_movable(const PathScene& scene, Figure& out) {
  constexpr std::size_t kNamed = 5;
  if (scene.movable.empty()) return;
  const std::size_t named = std::min(kNamed, scene.movable.size());
  const std::string more =
      scene.movable.size() > named ? fmt::format(" and {} more", scene.movable.size() - named) : "";
  out.notes.push_back(
      fmt::format("Movable objects are not drawn: {}{}; the pages of graze report and graze view have them.",
                  fmt::join(scene.movable.begin(), scene.movable.begin() + named, ", "), more));
}

void note_what_is_drawn(const PathScene& scene, const PathRequest& request, Figure& out) {
  if (scene.own_grounds && request.view != PathView::above) {
    out.notes.push_back("Each robot had ground of its own, which is not drawn.");
  }
  if (request.every > 0) out.notes.push_back(fmt::format("A small mark every {}.", every_words(request.every)));
  note_movable(scene, out);
}

}  // namespace

Figure path_figure(const Json& page, const std::vector<std::string>& policies, const PathScene& scene,
                   const PathRequest& request) {
  static const std::map<PathView, std::pair<std::string, std::string>> kNames = {
      {PathView::above, {"plan", "Path of the base from above"}},
      {PathView::side, {"side", "Path of the base from the side"}},
      {PathView::isometric, {"isometric", "Path of the base"}}};
  const auto& [name, title] = kNames.at(request.view);
  const PlayedTraces traces(page, policies, request.by, name);
  const std::vector<PlayedChannel> channels = played_channels(page);
  const auto is_x = [](const PlayedChannel& one) { return one.group == "position" && one.name.ends_with(".x"); };
  const auto at = std::find_if(channels.begin(), channels.end(), is_x);
  const auto x = static_cast<std::size_t>(at - channels.begin());
  if (!base_floats(page) || x + 2 >= channels.size()) {
    throw InputError(name + ": the robot's base is fixed and has no path; channel shows its joints against time");
  }
  Figure out{name, title};
  out.legend = traces.legend();
  out.legend.push_back({"end", PlotColor::soft, PlotLegend::Kind::mark});
  if (!scene.waypoints.empty()) out.legend.push_back({"waypoint", PlotColor::ink, PlotLegend::Kind::mark});
  PlotPanel panel = empty_panel(request.view, "");
  SeenFloor ground;
  for (const PlotPoint& p : scene.waypoints) ground.add(p);
  for (const Json* trace : traces.list()) {
    const std::vector<double> px = played_row(*trace, x), py = played_row(*trace, x + 1),
                              pz = played_row(*trace, x + 2);
    PlotSeries path = traces.line(*trace);
    for (std::size_t i = 0; i < px.size(); ++i) {
      const FlatPoint flat = seen(request.view, {px[i], py[i], pz[i]});
      path.x.push_back(flat.first);
      path.y.push_back(flat.second);
      ground.add({px[i], py[i], pz[i]});
    }
    PlotSeries moments = path, end = path;
    moments.kind = end.kind = PlotSeries::Kind::marks;
    end.faint = false;
    end.width = 6;
    moments.width = 3.5;
    moments.x.clear();
    moments.y.clear();
    for (const std::size_t i : frames_at(played_times(*trace), request.every)) {
      moments.x.push_back(path.x[i]);
      moments.y.push_back(path.y[i]);
    }
    if (!path.x.empty()) {
      end.x = {path.x.back()};
      end.y = {path.y.back()};
    }
    panel.series.push_back(std::move(path));
    if (request.every > 0) panel.series.push_back(std::move(moments));
    panel.series.push_back(std::move(end));
  }
  add_nets(request.view, scene, ground, panel);
  add_surroundings(request.view, scene, ground, panel);
  if (request.view == PathView::isometric) add_axes_cross(panel);
  out.panels.push_back(std::move(panel));
  out.notes.push_back(traces.note());
  note_what_is_drawn(scene, request, out);
  return out;
}

Figure lapse_figure(const Json& page, const std::vector<std::string>& policies, const PathScene& scene, double every) {
  const PlayedTraces traces(page, policies, PlotBy::outcome, "lapse");
  Figure out{"lapse", fmt::format("Robots every {}", every_words(every))};
  out.legend = traces.legend();
  bool grounds_differ = false;
  for (const std::string& policy : policies) {
    std::vector<const Json*> shown;
    PlotPanel panel = empty_panel(PathView::isometric, policies.size() > 1 ? policy : "");
    SeenFloor ground;
    for (const Json* trace : traces.list()) {
      if ((*trace)["policy"] != policy || !trace->contains("bodies")) continue;
      const StickRobot robot(page["scene"], (*trace)["bodies"]);
      PlotSeries look = traces.line(*trace);
      look.width = 0.6;
      SeenLines lines(PathView::isometric, look);
      for (const std::size_t frame : frames_at(played_times(*trace), every)) robot.add(frame, lines, ground);
      panel.series.push_back(lines.take());
      shown.push_back(trace);
    }
    if (panel.series.empty()) continue;
    grounds_differ |= add_terrain(page["scene"], shown, ground, panel);
    add_surroundings(PathView::isometric, scene, ground, panel);
    add_axes_cross(panel);
    out.panels.push_back(std::move(panel));
  }
  if (out.panels.size() > 1) {
    out.columns = 2;
    out.width = 1000;
    for (PlotPanel& panel : out.panels) panel.height = 300;
  }
  out.notes.push_back(traces.note());
  if (grounds_differ) out.notes.push_back("Each robot had ground of its own, which is drawn where there is one robot.");
  note_movable(scene, out);
  return out;
}

}  // namespace graze
