#include "engine/control/gait_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "engine/control/gait_doubts.h"
#include "engine/control/gait_timing.h"
#include "engine/model/measures.h"
#include "engine/model/rotation.h"
#include "engine/settings/units.h"

namespace graze {

namespace {

constexpr double kReachOfStretched = 0.95;  // published: a leg is not used beyond 95 % of its length
constexpr double kCarryingShare = 0.02;     // of the robot's weight: a foot that presses more than this carries

/// Frame of the foot on a leaf body: the one farthest from the body's own origin.
int outermost_frame(const Model& model, int body) {
  int best = -1;
  for (int f = 0; f < static_cast<int>(model.frames.size()); ++f) {
    if (model.frames[f].body != body) continue;
    const auto distance = [&](int g) { return model.frames[g].X_BF.translation().norm(); };
    if (best < 0 || distance(f) > distance(best)) best = f;
  }
  return best;
}

/// Feet of a robot whose legs end in leaf bodies: front before hind, left before right, as they stand at first.
std::vector<int> default_feet(const ControlContext& context, const Settings& settings) {
  const Model& model = context.nominal;
  std::vector<std::pair<Vec3, int>> feet;
  for (const int body : model.actuated) {
    const bool leaf =
        std::none_of(model.bodies.begin(), model.bodies.end(), [&](const Body& other) { return other.parent == body; });
    const int frame = outermost_frame(model, body);
    if (!leaf || frame < 0) continue;
    const Chain chain(model, frame);
    feet.emplace_back(chain.position(chain.select(context.initial.q)), frame);
  }
  if (feet.size() < 2 || feet.size() > kMaxFeet) {
    settings.fail(fmt::format("the robot has {} limbs; name those that are legs as `feet: [LINK, …]`", feet.size()));
  }
  std::stable_sort(feet.begin(), feet.end(), [](const auto& a, const auto& b) {
    const bool a_front = a.first.x() > 0, b_front = b.first.x() > 0;
    return a_front != b_front ? a_front : a.first.y() > b.first.y();
  });
  std::vector<int> frames;
  for (const auto& [position, frame] : feet) frames.push_back(frame);
  return frames;
}

std::string did_you_mean(const std::string& near) { return near.empty() ? "" : "; did you mean " + near + "?"; }

std::vector<int> read_feet(const ControlContext& context, const Settings& settings) {
  const std::optional<Settings> list = settings.find("feet");
  if (!list) return default_feet(context, settings);
  std::vector<std::string> names;
  for (const Frame& frame : context.nominal.frames) names.push_back(frame.name);
  std::vector<int> frames;
  for (const Settings& item : list->items()) {
    const int frame = context.nominal.frame(item.text());
    if (frame < 0) {
      const std::string near = nearest(item.text(), names);
      item.fail(fmt::format("'{}' is no link of the robot{}", item.text(), did_you_mean(near)));
    }
    frames.push_back(frame);
  }
  if (frames.empty() || frames.size() > kMaxFeet) list->fail(fmt::format("must name 1 to {} links", kMaxFeet));
  return frames;
}

Leg make_leg(const Model& model, int frame, const Settings& settings) try {
  Leg leg{frame, Chain(model, frame), Vec3::Zero(), 0, {}};
  const Chain::Skeleton zero = leg.chain.skeleton(Chain::Values::Zero(leg.chain.size()));
  // The first joint of a three-joint leg turns the leg about the body's long axis; the leg hangs from the second.
  const std::size_t hip = leg.chain.size() >= 3 ? 1 : 0;
  leg.hip = zero.origin[hip];
  for (std::size_t i = hip; i < zero.origin.size(); ++i) {
    const Vec3& next = i + 1 < zero.origin.size() ? zero.origin[i + 1] : zero.tip;
    leg.reach += kReachOfStretched * (next - zero.origin[i]).norm();
  }
  for (int f = 0; f < static_cast<int>(model.frames.size()); ++f) {
    if (model.frames[f].body == model.frames[frame].body) leg.body_frames.push_back(f);
  }
  return leg;
} catch (const std::invalid_argument& error) {
  settings.fail(std::string("feet: ") + error.what());
}

/// A fraction per foot; one number stands for all.
std::vector<double> read_fractions(const Settings& settings, std::size_t feet) {
  std::vector<double> values = settings.numbers(-1);
  if (values.size() == 1) values.assign(feet, values.front());
  if (values.size() != feet) {
    settings.fail(fmt::format("has {} values; one per foot ({}) or one for all must stand here", values.size(), feet));
  }
  for (const double value : values) {
    if (!(value >= 0 && value <= 1)) {
      settings.fail(fmt::format("{} is not a fraction of the gait; it must lie within 0 and 1 (0 % and 100 %){}", value,
                                percent_meant(fmt::format("{}", value))));
    }
  }
  return values;
}

GaitTiming read_timing(const Settings& settings, std::size_t feet) {
  const double period = settings.at("duration").positive(Quantity::time);
  const std::vector<double> duty = read_fractions(settings.at("duty"), feet);
  for (const double value : duty) {
    if (value <= 0) settings.at("duty").fail("0 leaves no stance; a duty factor must be > 0");
  }
  if (settings.has("liftoff") == settings.has("touchdown")) {
    settings.fail("either `liftoff` or `touchdown` must give the timing of the feet, and not both");
  }
  if (settings.has("touchdown")) return make_timing(read_fractions(settings.at("touchdown"), feet), duty, period);
  std::vector<double> touchdown = read_fractions(settings.at("liftoff"), feet);
  for (std::size_t i = 0; i < feet; ++i) touchdown[i] -= duty[i];
  return make_timing(touchdown, duty, period);
}

/// True if the value carries a unit of length ("30 cm"), false for a plain number or a percentage.
bool is_absolute(const Settings& value) {
  const std::string text = value.text();
  return !text.empty() && std::isalpha(static_cast<unsigned char>(text.back())) != 0;
}

/// A coordinate of a foot from `length` or `width`: relative, a factor on the hip's own coordinate; absolute, half the
/// distance between front and hind (left and right) feet on the hip's side. Default: below the hip.
double place(const std::optional<Settings>& value, double hip) {
  if (!value) return hip;
  if (is_absolute(*value)) return std::copysign(0.5 * value->positive(Quantity::length), hip);
  return value->positive() * hip;
}

/// The base's height above its feet: relative to the shortest leg's reach (default 0.9), or absolute, m.
double read_height(const std::optional<Settings>& value, const std::vector<Leg>& legs) {
  double shortest = legs.front().reach;
  for (const Leg& leg : legs) shortest = std::min(shortest, leg.reach);
  if (!value) return 0.9 * shortest;
  return is_absolute(*value) ? value->positive(Quantity::length) : value->positive() * shortest;
}

/// Foot origins in the level frame (Table 17: stance length and width, base linear offset).
void read_stance(const Settings& settings, const std::vector<Leg>& legs, const Mat3& R_GB, GaitParameters& p) {
  const Settings stance = settings.find("stance").value_or(settings);
  const bool given = settings.has("stance");
  if (given) stance.allow({"length", "width", "height", "offset"});
  const auto key = [&](const char* name) { return given ? stance.find(name) : std::nullopt; };
  const double height = read_height(key("height"), legs);
  Vec3 offset = Vec3::Zero();
  if (const auto list = key("offset")) {
    const std::vector<double> xy = list->numbers(2, Quantity::length);
    offset = {xy[0], xy[1], 0};
  }
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const Vec3& hip = legs[i].hip;
    const Vec3 origin = Vec3(place(key("length"), hip.x()), place(key("width"), hip.y()), -height) - offset;
    Vec3::Map(p.origin[i]) = origin;
    Vec3::Map(p.hip[i]) = hip;
    p.reach[i] = legs[i].reach;
    const double distance = (R_GB.transpose() * origin - hip).norm();
    if (distance > legs[i].reach) {
      stance.fail(fmt::format(
          "foot {} would stand {:.4g} m from its hip; its reach is {:.4g} m, so lower the height or narrow the stance",
          i + 1, distance, legs[i].reach));
    }
  }
}

}  // namespace

std::vector<std::string> gait_keys() {
  return {"velocity",    "waypoints", "duration",       "duty",          "liftoff", "touchdown",
          "step_height", "overshoot", "stance",         "orientation",   "settle",  "redirect",
          "global_up",   "recovery",  "max_foot_speed", "contact_force", "feet"};
}

GaitSetup read_gait(const ControlContext& context, const Settings& settings) {
  GaitSetup setup;
  for (const int frame : read_feet(context, settings)) {
    setup.legs.push_back(make_leg(context.nominal, frame, settings));
  }
  GaitParameters& p = setup.parameters;
  p.timing = read_timing(settings, setup.legs.size());
  p.step_height = settings.at("step_height").non_negative(Quantity::length);
  p.overshoot = settings.number_or("overshoot", p.overshoot);
  if (settings.has("redirect")) p.redirect = settings.at("redirect").within(0, 1);
  if (settings.has("settle")) p.settle = settings.at("settle").non_negative(Quantity::time);
  p.global_up = settings.flag_or("global_up", p.global_up);
  p.recovery = settings.flag_or("recovery", p.recovery);
  if (settings.has("max_foot_speed")) p.max_speed = settings.at("max_foot_speed").positive(Quantity::velocity);
  p.contact_force = kCarryingShare * robot_weight(context.nominal);
  if (settings.has("contact_force")) p.contact_force = settings.at("contact_force").non_negative(Quantity::force);
  p.gravity = context.nominal.gravity.norm();
  Mat3 R_GB = Mat3::Identity();
  if (const auto attitude = settings.find("orientation")) {
    const std::vector<double> rpy = attitude->numbers(3, Quantity::angle);
    R_GB = rotation_from_rpy({rpy[0], rpy[1], rpy[2]});
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{p.R_GB} = R_GB;
  }
  read_stance(settings, setup.legs, R_GB, p);
  setup.steering = read_steering(settings, context.nominal.floating_base);
  doubt_gait(settings, setup);
  return setup;
}

}  // namespace graze
