// Witnesses of where links are and how they move. All margins are in SI units; several links: the least margin.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/model/kinematics.h"
#include "scenarios/keys.h"
#include "scenarios/names.h"
#include "scenarios/witnesses.h"

namespace graze {
namespace {

std::vector<int> read_frames(const Settings& settings, const Model& nominal) {
  const Settings link = settings.at("link");
  return match_names(link, link.text(), frame_names(nominal), "link");
}

Vec3 origin(const WitnessInput& in, int frame) {
  const Frame& f = in.model.frames[frame];
  return in.state.pose(f.body, in.lane) * f.X_BF.translation();
}

/// Angle between the link's z axis and the world's, against the largest that is allowed.
class Tilt : public Witness {
 public:
  Tilt(std::vector<int> frames, double below) : frames_(std::move(frames)), below_(below) {}

  double evaluate(const WitnessInput& in) const override {
    double largest = 0;
    for (const int frame : frames_) {
      const Frame& f = in.model.frames[frame];
      const Vec3 z_W = in.state.pose(f.body, in.lane).linear() * f.X_BF.linear().col(2);
      largest = std::max(largest, std::atan2(std::hypot(z_W.x(), z_W.y()), z_W.z()));
    }
    return below_ - largest;
  }

 private:
  std::vector<int> frames_;
  double below_;  // rad
};

/// The origins of all frames lie in a box of the world (sides may be open).
class Region : public Witness {
 public:
  Region(std::vector<int> frames, const Vec3& above, const Vec3& below)
      : frames_(std::move(frames)), above_(above), below_(below) {}

  double evaluate(const WitnessInput& in) const override {
    double least = std::numeric_limits<double>::infinity();
    for (const int frame : frames_) {
      const Vec3 p_W = origin(in, frame);
      least = std::min({least, (p_W - above_).minCoeff(), (below_ - p_W).minCoeff()});
    }
    return least;
  }

 private:
  std::vector<int> frames_;
  Vec3 above_, below_;  // m; infinite where open
};

/// Speed of the frames' origins.
class Speed : public Witness {
 public:
  Speed(std::vector<int> frames, double below) : frames_(std::move(frames)), below_(below) {}

  double evaluate(const WitnessInput& in) const override {
    std::vector<Pose> X_WB(in.model.bodies.size());
    for (std::size_t b = 0; b < X_WB.size(); ++b) X_WB[b] = in.state.pose(static_cast<int>(b), in.lane);
    const Eigen::VectorXd v = in.state.v.column(in.lane);
    double largest = 0;
    for (const int frame : frames_) {
      const int body = in.model.frames[frame].body;
      if (body < 0) continue;
      largest = std::max(largest, (point_jacobian(in.model, X_WB, body, origin(in, frame)) * v).norm());
    }
    return below_ - largest;
  }

 private:
  std::vector<int> frames_;
  double below_;  // m/s
};

constexpr double kOpen = std::numeric_limits<double>::infinity();

/// `{above: …, below: …}`, at least one of them.
void read_range(const Settings& settings, double& above, double& below) {
  above = settings.number_or("above", -kOpen, Quantity::length);
  below = settings.number_or("below", kOpen, Quantity::length);
  if (!settings.has("above") && !settings.has("below")) settings.fail("needs 'above', 'below' or both");
  if (above > below)
    settings.fail(fmt::format("above {:g} m lies over below {:g} m: nothing is between", above, below));
}

std::string range_text(const char* axis, double above, double below) {
  std::string out;
  if (std::isfinite(above)) out += fmt::format(" {} > {:g} m", axis, above);
  if (std::isfinite(below)) out += fmt::format(" {} < {:g} m", axis, below);
  return out;
}

}  // namespace

ReadWitness read_tilt(const Settings& settings, const Model& nominal) {
  settings.allow(keys_of("tilt"));
  const std::vector<int> frames = read_frames(settings, nominal);
  const Settings limit = settings.at("below");
  const double below = limit.positive(Quantity::angle);
  return {std::make_shared<Tilt>(frames, below),
          fmt::format("tilt of {} below {:g} rad", settings.at("link").text(), below), "rad"};
}

ReadWitness read_height(const Settings& settings, const Model& nominal) {
  settings.allow(keys_of("height"));
  const std::vector<int> frames = read_frames(settings, nominal);
  Vec3 above = Vec3::Constant(-kOpen), below = Vec3::Constant(kOpen);
  read_range(settings, above.z(), below.z());
  return {std::make_shared<Region>(frames, above, below),
          settings.at("link").text() + range_text("z", above.z(), below.z()), "m"};
}

ReadWitness read_position(const Settings& settings, const Model& nominal) {
  settings.allow(keys_of("position"));
  const std::vector<int> frames = read_frames(settings, nominal);
  Vec3 above = Vec3::Constant(-kOpen), below = Vec3::Constant(kOpen);
  std::string text = settings.at("link").text();
  constexpr const char* kAxes[] = {"x", "y", "z"};
  bool any = false;
  for (int i = 0; i < 3; ++i) {
    const auto range = settings.find(kAxes[i]);
    if (!range) continue;
    range->allow(keys_of("region"));
    read_range(*range, above[i], below[i]);
    text += range_text(kAxes[i], above[i], below[i]);
    any = true;
  }
  if (!any) settings.fail("needs one of x, y, z, e.g. y: {below: -0.2 m}");
  return {std::make_shared<Region>(frames, above, below), text, "m"};
}

ReadWitness read_speed(const Settings& settings, const Model& nominal) {
  settings.allow(keys_of("speed"));
  const std::vector<int> frames = read_frames(settings, nominal);
  const double below = settings.at("below").positive(Quantity::velocity);
  return {std::make_shared<Speed>(frames, below),
          fmt::format("speed of {} below {:g} m/s", settings.at("link").text(), below), "m/s"};
}

}  // namespace graze
