#include "engine/control/gait_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "engine/control/gait_doubts.h"
#include "engine/control/gait_timing.h"
#include "engine/model/measures.h"
#include "engine/model/rotation.h"
#include "engine/settings/units.h"

namespace graze {

namespace {

constexpr double kReachOfStretched = 0.95;  // published: a leg is not used beyond 95 % of its length
constexpr double kCarryingShare = 0.02;     // of the robot's weight: a foot that presses more than this carries
constexpr double kHeightOfReach = 0.9;      // of the shortest leg's reach: how high the base stands

const Description& stance_description() {
  // Without a unit of length: multiples.
  const std::vector<Form> place = {Form::number(Quantity::length, Bound::positive),
                                   Form::number(Quantity::dimensionless, Bound::positive)};
  static const Description text = {
      "where the feet stand; bare numbers are multiples",
      {{"length", place, Default::words("below the hips"),
        "between front and hind feet; a bare number: times the hip's x"},
       {"width", place, Default::words("below the hips"),
        "between left and right feet; a bare number: times the hip's y"},
       {"height", place, Default::words(fmt::format("{:g} of the shortest leg's reach", kHeightOfReach)),
        "of the base above the feet; a bare number: times that reach"},
       {"offset",
        {Form::numbers(2, Quantity::length)},
        Default::value("[0, 0] m"),
        "of the base from the middle of the feet, `[x, y]`"}}};
  return text;
}

const Description& stabilizer_description() {
  static const Description text = {
      "feet that stand push along the vertical such that the base rolls and pitches back (§7.6.3; viip of the "
      "published code)",
      {{"kp",
        {Form::number(Quantity::rotational_stiffness, Bound::not_negative)},
        Default::value("0 N m/rad"),
        "moment for each rad of roll and pitch off `orientation`"},
       {"kd",
        {Form::number(Quantity::rotational_damping, Bound::not_negative)},
        Default::required(),
        "moment against each rad/s of roll and pitch; published: 50 N m s/rad, for a robot of several kg"}}};
  return text;
}

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
  if (list->is_scalar()) list->fail(fmt::format("{0}: must be a list of links: [{0}]", list->text()));
  std::vector<int> frames;
  for (const Settings& item : list->items()) {
    const int frame = context.nominal.frame(item.text());
    if (frame < 0) {
      const std::string near = nearest(item.text(), names);
      item.fail(fmt::format("'{}' is no link of the robot{}", item.text(), did_you_mean(near)));
    }
    if (std::find(frames.begin(), frames.end(), frame) != frames.end()) {
      item.fail(fmt::format("'{}' stands twice; each foot is named once", item.text()));
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

GaitTiming read_timing(const Described& own, std::size_t feet) {
  const Settings& settings = own.settings();
  const double period = own.number("duration");
  const std::vector<double> duty = read_fractions(settings.at("duty"), feet);
  for (const double value : duty) {
    if (value <= 0) settings.at("duty").fail("0 leaves no stance; a duty factor must be > 0");
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

/// The base's height above its feet: relative to the shortest leg's reach, or absolute, m.
double read_height(const std::optional<Settings>& value, const std::vector<Leg>& legs) {
  double shortest = legs.front().reach;
  for (const Leg& leg : legs) shortest = std::min(shortest, leg.reach);
  if (!value) return kHeightOfReach * shortest;
  return is_absolute(*value) ? value->positive(Quantity::length) : value->positive() * shortest;
}

/// The largest height of a base, m, whose foot is within the leg's reach when it is `origin` but for its height;
/// nothing if it is too far away sideways.
std::optional<double> largest_height(const Leg& leg, const Mat3& R_GB, const Vec3& origin) {
  const Vec3 hip_G = R_GB * leg.hip;
  const double side = (origin - hip_G).head<2>().norm();
  if (!(side < leg.reach)) return std::nullopt;
  const double height = std::sqrt(leg.reach * leg.reach - side * side) - hip_G.z();
  return height > 0 ? std::optional(height) : std::nullopt;
}

/// Which foot cannot stand where it should, and what would let it.
struct OutOfReach {
  std::string foot;
  double distance, reach;                // m
  bool tilted;                           // a level base would let it stand there
  std::optional<double> height, factor;  // the largest that fits all legs, m and as a multiple of the shortest reach
};

/// With so many decimals, and no more than `x`, so that it is right when it is typed.
std::string rounded_down(double x, int decimals) {
  double unit = 1;
  for (int i = 0; i < decimals; ++i) unit *= 10;
  return fmt::format("{}", std::floor(x * (1 - 1e-12) * unit) / unit);
}

[[noreturn]] void refuse_stance(const Settings& settings, const OutOfReach& out) {
  const std::string rule =
      fmt::format("{} would stand {:.4g} m from its hip, and its reach is {:.4g} m", out.foot, out.distance, out.reach);
  const auto attitude = settings.find("orientation");
  if (attitude && out.tilted) {
    std::string typed;
    for (const double angle : attitude->numbers(3, Quantity::angle))
      typed += fmt::format("{}{:g}", typed.empty() ? "" : ", ", angle);
    attitude->fail(
        fmt::format("with the base at [{}] rad {}; tilt it less, or lower the height (a unit for all stands "
                    "behind: [0, 0, 10, deg])",
                    typed, rule));
  }
  const auto stance = settings.find("stance");
  const auto height = stance ? stance->find("height") : std::nullopt;
  const std::string right = out.height
                                ? fmt::format("; the largest height that fits is {} m ({} of the shortest leg's reach)",
                                              rounded_down(*out.height, 4), rounded_down(*out.factor, 3))
                                : std::string("; no height fits: narrow the stance");
  const Settings& place = height && out.height ? *height : stance ? *stance : settings;
  const std::string typed = height && out.height ? height->text() + ": " : "";
  place.fail(typed + rule + right);
}

/// Foot origins in the level frame (Table 17: stance length and width, base linear offset).
void read_stance(const Model& model, const Settings& settings, const std::vector<Leg>& legs, const Mat3& R_GB,
                 GaitParameters& p) {
  const Settings stance = settings.find("stance").value_or(settings);
  const bool given = settings.has("stance");
  if (given) stance.allow(stance_description().names());
  const auto key = [&](const char* name) { return given ? stance.find(name) : std::nullopt; };
  const double height = read_height(key("height"), legs);
  Vec3 offset = Vec3::Zero();
  if (const auto list = key("offset")) {
    const std::vector<double> xy = list->numbers(2, Quantity::length);
    offset = {xy[0], xy[1], 0};
  }
  std::optional<OutOfReach> far;
  std::optional<double> most = std::numeric_limits<double>::infinity();
  double shortest = most.value();
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const Vec3& hip = legs[i].hip;
    const Vec3 origin = Vec3(place(key("length"), hip.x()), place(key("width"), hip.y()), -height) - offset;
    Vec3::Map(p.origin[i]) = origin;
    Vec3::Map(p.hip[i]) = hip;
    p.reach[i] = legs[i].reach;
    const double distance = (R_GB.transpose() * origin - hip).norm();
    const std::optional<double> highest = largest_height(legs[i], R_GB, origin);
    most = most && highest ? std::optional(std::min(*most, *highest)) : std::nullopt;
    shortest = std::min(shortest, legs[i].reach);
    if (distance > legs[i].reach && !far) {
      const bool tilted = (origin - hip).norm() <= legs[i].reach;
      far = OutOfReach{model.frames[legs[i].frame].name, distance, legs[i].reach, tilted, {}, {}};
    }
  }
  if (!far) return;
  far->height = most;
  if (most) far->factor = *most / shortest;
  refuse_stance(settings, *far);
}

/// Behind p.R_GB.
void read_stabilizer(const Model& model, const Settings& settings, GaitParameters& p) {
  const auto written = settings.find("stabilizer");
  if (!written) return;
  if (!model.floating_base)
    settings.at("stabilizer").fail_key("rights a base that can turn, and this one is fixed to the world");
  const Described own(*written, stabilizer_description());
  p.stabilizer.on = true;
  p.stabilizer.kp = own.number("kp");
  p.stabilizer.kd = own.number("kd");
  const auto attitude = settings.find("orientation");
  if (!attitude) return;
  const std::vector<double> rpy = attitude->numbers(3, Quantity::angle);
  p.stabilizer.roll = rpy[0], p.stabilizer.pitch = rpy[1];
}

}  // namespace

const Description& gait_description() {
  const Form share = Form::fraction(), shares = Form::numbers(-1, Quantity::dimensionless, Bound::fraction);
  static const Description text = {
      "walks: every foot stands and swings by a common clock, after a velocity, recorded commands or along waypoints",
      {velocity_key(),
       waypoints_key(),
       commands_key(),
       {"duration", {Form::number(Quantity::time, Bound::positive)}, Default::required(), "of one cycle"},
       {"duty", {share, shares}, Default::required(), "share of the cycle in stance, above 0, of all feet or of each"},
       {"liftoff", {share, shares}, {}, "phase at which the swing of a foot begins: touchdown + duty"},
       {"touchdown", {share, shares}, {}, "phase at which the stance of a foot begins"},
       {"step_height",
        {Form::number(Quantity::length, Bound::not_negative)},
        Default::required(),
        "of the foot's path above its ends"},
       {"overshoot", {Form::number()}, Default::value("0"), "moves the path's third knot on by this part of the step"},
       {"stance", {Form::map(stance_description())}, Default::words("below the hips"), stance_description().help},
       {"orientation",
        {Form::numbers(3, Quantity::angle)},
        Default::value("[0, 0, 0] rad"),
        "roll, pitch, yaw of the base that the stance is made for"},
       {"stabilizer", {Form::map(stabilizer_description())}, Default::words("none"), stabilizer_description().help},
       {"settle",
        {Form::number(Quantity::time, Bound::not_negative)},
        Default::value("0 s"),
        "before the gait begins, move smoothly to the commanded height with all feet standing"},
       {"redirect", {share}, Default::value("75 %"), "share of a swing within which a new command moves its goal"},
       {"global_up",
        {Form::flag()},
        Default::value("true"),
        "step along the world's vertical, as sensed, instead of the base's"},
       {"recovery",
        {Form::flag()},
        Default::value("true"),
        "the modes reach and support; `false`: timing alone decides, as in the published code"},
       {"max_foot_speed",
        {Form::number(Quantity::velocity, Bound::positive)},
        Default::value("1 m/s"),
        "limit of the velocity at touchdown, as published"},
       {"contact_force",
        {Form::number(Quantity::force, Bound::not_negative), Form::text("% of the robot's weight")},
        Default::words(fmt::format("{:g} % of the robot's weight", 100 * kCarryingShare)),
        "a foot that presses more than this carries"},
       {"feet",
        {Form::texts(-1, "LINK")},
        Default::words("ends of the limbs"),
        "feet; unless named: front before hind, left before right"}},
      {steering_keys(), {"liftoff", "touchdown"}}};
  return text;
}

GaitSetup read_gait(const ControlContext& context, const Described& own) {
  const Settings& settings = own.settings();
  GaitSetup setup;
  for (const int frame : read_feet(context, settings)) {
    setup.legs.push_back(make_leg(context.nominal, frame, settings));
  }
  GaitParameters& p = setup.parameters;
  p.timing = read_timing(own, setup.legs.size());
  p.step_height = own.number("step_height");
  p.overshoot = own.number("overshoot");
  p.redirect = own.number("redirect");
  p.settle = own.number("settle");
  p.global_up = own.flag("global_up");
  p.recovery = own.flag("recovery");
  p.max_speed = own.number("max_foot_speed");
  const double weight = robot_weight(context.nominal);
  p.contact_force = kCarryingShare * weight;
  if (const auto force = settings.find("contact_force")) {
    const bool share = force->is_scalar() && force->text().ends_with('%');
    p.contact_force = share ? force->non_negative() * weight : own.number("contact_force");
  }
  p.gravity = context.nominal.gravity.norm();
  Mat3 R_GB = Mat3::Identity();
  if (const auto attitude = settings.find("orientation")) {
    const std::vector<double> rpy = attitude->numbers(3, Quantity::angle);
    R_GB = rotation_from_rpy({rpy[0], rpy[1], rpy[2]});
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{p.R_GB} = R_GB;
  }
  read_stabilizer(context.nominal, settings, p);
  read_stance(context.nominal, settings, setup.legs, R_GB, p);
  setup.steering = read_steering(settings, context.nominal.floating_base);
  doubt_gait(settings, setup);
  return setup;
}

}  // namespace graze
