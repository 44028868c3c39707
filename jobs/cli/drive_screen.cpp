#include "jobs/cli/drive_screen.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace graze {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kLinesOfText = 7;        // above and below the map
constexpr double kColumnsOfReach = 4;  // columns from the base to its farthest foot
constexpr double kRowOfColumns = 2;    // a character is about twice as high as wide
constexpr double kBetweenDots = 0.05;  // m, of the path
constexpr std::size_t kMostDots = 2000;
constexpr double kLeastReach = 1e-3;  // m
constexpr double kLeastZoom = 0.1, kMostZoom = 10;

/// A grid of characters; y grows to the left, as in the robot's world when x points up.
class CharacterMap {
 public:
  CharacterMap(int columns, int rows, const Vec3& centre, double column)
      : columns_(columns), rows_(rows), centre_(centre), column_(column) {
    cells_.assign(static_cast<std::size_t>(columns * rows), ' ');
  }
  void put(const Vec3& point, char c) {
    const int column = columns_ / 2 - static_cast<int>(std::lround((point.y() - centre_.y()) / column_));
    const int row = rows_ / 2 - static_cast<int>(std::lround((point.x() - centre_.x()) / (column_ * kRowOfColumns)));
    if (column >= 0 && column < columns_ && row >= 0 && row < rows_) at(row, column) = c;
  }
  /// Of the middle of each cell.
  template <class Inside>
  void fill(char c, const Inside& inside) {
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column) {
        const int ahead = rows_ / 2 - row, aside = columns_ / 2 - column;  // cells, as put() counts them
        const Vec3 point = centre_ + Vec3(ahead * column_ * kRowOfColumns, aside * column_, 0);
        if (inside(point)) at(row, column) = c;
      }
    }
  }
  std::string text() const {
    std::string out;
    for (int row = 0; row < rows_; ++row) {
      out.append(cells_, static_cast<std::size_t>(row * columns_), static_cast<std::size_t>(columns_));
      out += '\n';
    }
    return out;
  }

 private:
  char& at(int row, int column) { return cells_[static_cast<std::size_t>(row * columns_ + column)]; }
  int columns_, rows_;
  Vec3 centre_;
  double column_;  // m
  std::string cells_;
};

/// Whether a point of the ground lies below or within a fixed object, seen from above.
bool covers(const Collider& one, const Vec3& point) {
  const Vec3 p = one.X_BG.inverse() * Vec3(point.x(), point.y(), one.X_BG.translation().z());
  switch (one.shape.kind) {
    case ShapeKind::box:
      return std::abs(p.x()) <= one.shape.size.x() / 2 && std::abs(p.y()) <= one.shape.size.y() / 2;
    case ShapeKind::sphere:
    case ShapeKind::cylinder:
    case ShapeKind::capsule:
      return (point - one.X_BG.translation()).head<2>().norm() <= one.shape.size.x();
    default:
      return false;
  }
}

char arrow(double yaw) {
  static constexpr std::array<char, 8> kArrows = {'^', '\\', '<', '/', 'v', '\\', '>', '/'};
  const double eighths = yaw / (std::numbers::pi / 4);
  return kArrows[static_cast<std::size_t>((static_cast<int>(std::lround(eighths)) % 8 + 8) % 8)];
}

/// Where the first policy that goes to waypoints would go by itself.
std::vector<Vec3> waypoints_of(const Scenario& scenario) {
  std::vector<Vec3> out;
  for (const PolicySpec& policy : scenario.policies) {
    const auto gait = policy.settings.find("gait");
    const auto way = gait ? gait->find("waypoints") : std::nullopt;
    if (!out.empty() || !way) continue;
    for (const Settings& point : way->at("points").items()) {
      const std::vector<double> xy = point.numbers(2, Quantity::length);
      out.emplace_back(xy[0], xy[1], 0);
    }
  }
  return out;
}

}  // namespace

DriveScreen::DriveScreen(const Scenario& scenario) : scenario_(scenario), waypoints_(waypoints_of(scenario)) {}

void DriveScreen::zoom(double factor) { zoom_ = std::clamp(zoom_ * factor, kLeastZoom, kMostZoom); }

void DriveScreen::remember(const DriveSight& sight) {
  if (path_.empty() || (path_.back() - sight.position).head<2>().norm() > kBetweenDots) path_.push_back(sight.position);
  if (path_.size() > kMostDots) path_.erase(path_.begin());
  if (reach_ > 0) return;
  reach_ = kLeastReach;
  for (const DriveSight::Foot& foot : sight.feet) {
    reach_ = std::max(reach_, (foot.position - sight.position).head<2>().norm());
  }
}

std::string DriveScreen::map(const DriveSight& sight, int columns, int rows) {
  CharacterMap out(columns, rows, sight.position, reach_ / kColumnsOfReach / zoom_);
  for (const Collider& one : scenario_.model.colliders) {
    if (one.is_object && one.body < 0) out.fill('#', [&](const Vec3& point) { return covers(one, point); });
  }
  for (const Vec3& point : path_) out.put(point, '.');
  for (std::size_t i = 0; i < waypoints_.size(); ++i) out.put(waypoints_[i], static_cast<char>('1' + i % 9));
  for (const DriveSight::Foot& foot : sight.feet) out.put(foot.position, foot.touches ? '@' : 'o');
  out.put(sight.position, arrow(sight.yaw));
  return out.text();
}

std::string DriveScreen::lines(const DriveSession& session, int columns, int rows, double pace, bool car,
                               const std::string& message) {
  const DriveSight& sight = session.sight();
  remember(sight);
  const CommandRow& wanted = session.command();
  std::string out = fmt::format("{}   {:.2f} s   {}\n", scenario_.name, sight.time,
                                pace > 0.97 ? "in real time" : fmt::format("at {:.2f} of real time", pace));
  out += fmt::format("{:<9} forward {:+.2f} m/s   strafe {:+.2f} m/s   turn {:+.2f} rad/s   {}\n", "wanted",
                     wanted.forward, wanted.strafe, wanted.turn, car ? "like a car" : "holonomic");
  out += fmt::format("{:<9} forward {:+.2f} m/s   strafe {:+.2f} m/s   turn {:+.2f} rad/s\n", "is", sight.velocity.x(),
                     sight.velocity.y(), sight.velocity.z());
  out += fmt::format("{:<9} x {:+.2f} m   y {:+.2f} m   height {:.3f} m   heading {:+.0f} deg   tilt {:.1f} deg\n",
                     "at", sight.position.x(), sight.position.y(), sight.position.z(), sight.yaw / kDegree,
                     sight.tilt / kDegree);
  out += fmt::format("{:<9}", "feet");
  for (const DriveSight::Foot& foot : sight.feet) out += fmt::format(" {} {} ", foot.touches ? '@' : 'o', foot.name);
  out += '\n' + map(sight, std::max(columns, 1), std::max(rows - kLinesOfText, 1));
  for (std::size_t i = 0; i < session.policies().size() && i < 9; ++i) {
    const bool tried = session.tried() && *session.tried() == i;
    out += fmt::format("{} {}{}  ", i + 1, session.policies()[i],
                       i == session.policy() ? " (now)"
                       : tried               ? " (being tried)"
                                             : "");
  }
  out += "arrows/WASD  , . strafe  space stops  c car  + - zoom  q ends\n";
  out += message;
  return out;
}

}  // namespace graze
