#include "scenarios/disturbances.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/model/measures.h"
#include "engine/settings/units.h"
#include "engine/settings/warnings.h"
#include "scenarios/keys.h"
#include "scenarios/limits.h"
#include "scenarios/names.h"

namespace graze {
namespace {

constexpr std::size_t kMaxDisturbances = 100;  // each is looked at in every step

/// Keys that only some disturbances have; `name` says of which.
void refuse_keys(const Settings& one, const std::vector<const char*>& keys, const std::string& of) {
  for (const char* key : keys) {
    if (const auto value = one.find(key)) value->fail_key("is for " + of);
  }
}

Disturbance::Kind kind_of_disturbance(const Settings& one) {
  const bool push = one.has("push"), payload = one.has("payload");
  if (push && payload) one.at("payload").fail_key("a second kind beside 'push'; give each an entry of its own");
  if (!push && !payload) one.fail("says neither 'push: LINK' nor 'payload: LINK'");
  return push ? Disturbance::Kind::push : Disturbance::Kind::payload;
}

class DisturbanceReader {
 public:
  DisturbanceReader(const std::string& name, const Settings& settings, const ReadNumber& number)
      : settings_(settings), number_(number), path_("disturbances." + name + ".") {
    out_.name = name;
  }

  Disturbance read() {
    settings_.allow(keys_of("disturbance"));
    out_.kind = kind_of_disturbance(settings_);
    settings_.at("at");
    read_number("at", Quantity::time, 0, out_.at);
    if (out_.kind == Disturbance::Kind::push) {
      read_push();
    } else {
      out_.link = settings_.at("payload").text();
      refuse_keys(settings_, {"impulse", "force", "azimuth", "elevation", "duration"}, "a push");
      settings_.at("mass");
      read_number("mass", Quantity::mass, 0, out_.mass, kMostPayload);
    }
    if (const auto point = settings_.find("point")) {
      const std::vector<double> p = checked_lengths(*point, 3);
      out_.point = {p[0], p[1], p[2]};
    }
    return std::move(out_);
  }

 private:
  void read_push() {
    out_.link = settings_.at("push").text();
    refuse_keys(settings_, {"mass"}, "a payload");
    out_.is_force = settings_.has("force");
    if (out_.is_force == settings_.has("impulse")) {
      settings_.fail("a push has either an 'impulse', or a 'force' with a 'duration'");
    }
    constexpr double kAny = -std::numeric_limits<double>::infinity();
    if (out_.is_force) {
      read_number("force", Quantity::force, -kMostPush, out_.strength, kMostPush);
      if (!settings_.has("duration")) settings_.at("force").fail("a force needs a 'duration'; or give an 'impulse'");
    } else {
      read_number("impulse", Quantity::impulse, -kMostPush, out_.strength, kMostPush);
    }
    read_number("azimuth", Quantity::angle, kAny, out_.azimuth);
    read_number("elevation", Quantity::angle, kAny, out_.elevation);
    read_number("duration", Quantity::time, 0, out_.duration);
    if (out_.is_force && out_.duration == 0) {
      settings_.at("duration").fail("a force of no duration does nothing; give it one, or an 'impulse' in its place");
    }
  }

  void read_number(const char* key, Quantity quantity, double least, double& value,
                   double most = std::numeric_limits<double>::infinity()) {
    Parameter parameter;
    parameter.path = path_ + key;
    parameter.quantity = quantity;
    parameter.lower = least;
    parameter.upper = most;
    number_(settings_, key, parameter, value);
  }

  const Settings& settings_;
  const ReadNumber& number_;
  const std::string path_;
  Disturbance out_;
};

}  // namespace

void read_disturbances(const Settings& scenario, World& world, const ReadNumber& number) {
  const auto disturbances = scenario.find("disturbances");
  if (!disturbances) return;
  const auto entries = disturbances->entries();
  check_count(*disturbances, entries.size(), kMaxDisturbances, "disturbances");
  for (const auto& [name, settings] : entries) {
    if (name.empty() || name.find_first_of("*?{}.") != std::string::npos) {
      settings.fail_key("a disturbance has a name with none of * ? { } . in it: paths of parameters are made of it");
    }
    world.disturbances.push_back(DisturbanceReader(name, settings, number).read());
  }
}

void check_disturbances(const Settings& scenario, const Model& model, const World& world) {
  for (const Disturbance& one : world.disturbances) {
    const Settings settings = scenario.at("disturbances").at(one.name);
    const Settings link = settings.at(one.kind == Disturbance::Kind::push ? "push" : "payload");
    const std::vector<std::string> names = frame_names(model);
    if (std::find(names.begin(), names.end(), one.link) == names.end()) {
      link.fail(fmt::format("no link or movable object of that name; {}", nearest_or_all(one.link, names)));
    }
    if (model.frames[static_cast<std::size_t>(model.frame(one.link))].body < 0) {
      link.fail(fmt::format("{}: does not move, so that nothing disturbs it", one.link));
    }
  }
}

namespace {

/// What is drawn for a number of a disturbance, or its value.
class Drawn {
 public:
  Drawn(const ParameterSpace& space, const Disturbance& one, const char* key, double value)
      : all_(Distribution::constant(value)) {
    const std::string name = fmt::format("disturbances.{}.{}", one.name, key);
    for (const UncertainParameter& parameter : space.parameters) {
      if (parameter.name == name) all_ = parameter.persistent, text_ = parameter.distribution_text;
    }
  }
  /// But for one in a thousand.
  double low() const { return all_.quantile(1e-3); }
  double high() const { return all_.quantile(1 - 1e-3); }
  bool varies() const { return !all_.is_constant(); }
  /// "0.5 N s", or what is drawn: "uniform(min=0.2, max=1.6) N s".
  std::string text(const char* unit) const {
    return fmt::format(
        "{} {}",
        varies() ? rounded_numbers(text_.empty() ? all_.describe() : text_) : fmt::format("{:g}", all_.median()), unit);
  }
  double size() const { return std::max(std::abs(low()), std::abs(high())); }
  /// Share of particles that draw `bound` or more.
  double share_from(double bound) const {
    double below = 0, above = 1;
    for (int i = 0; i < 40; ++i) {
      const double u = 0.5 * (below + above);
      (all_.quantile(u) >= bound ? above : below) = u;
    }
    return 1 - above;
  }

 private:
  Distribution all_;
  std::string text_;  // as it is written, if not by its parameters
};

/// Throws of more than that speed, m/s, loads of more than so many robots, and points as far off as so many of them
/// hardly are meant.
constexpr double kFastThrow = 50, kManyRobots = 20, kFarPoint = 5;

void doubt_push(const Settings& settings, const ParameterSpace& space, const Disturbance& one, double mass,
                double end) {
  const Drawn strength(space, one, one.is_force ? "force" : "impulse", one.strength);
  const Drawn duration(space, one, "duration", one.duration), at(space, one, "at", one.at);
  const double speed = strength.size() * (one.is_force ? duration.high() : 1.0) / mass;
  if (speed > kFastThrow) {
    warn(settings.at(one.is_force ? "force" : "impulse"),
         fmt::format("up to {:.3g} {}: throws all {:.3g} kg by {:.3g} m/s; is the unit meant?", strength.size(),
                     one.is_force ? "N" : "N s", mass, speed));
  }
  if (at.low() < end && at.high() < end && at.high() + duration.high() > end * (1 + 1e-9)) {
    warn(settings.at("duration"),
         fmt::format("up to {:.4g} s: it lasts until {:.4g} s, and the trace is over after {:g} s: "
                     "part of it never comes",
                     duration.high(), at.high() + duration.high(), end));
  }
}

}  // namespace

void doubt_disturbances(const Settings& scenario, const ParameterSpace& space, const World& world, const Model& model,
                        const Vec3& extent, double end, double step) {
  for (const Disturbance& one : world.disturbances) {
    const Settings settings = scenario.at("disturbances").at(one.name);
    const Drawn at(space, one, "at", one.at);
    // A payload comes with the next step that begins.
    const double last = one.kind == Disturbance::Kind::payload ? end - step * (1 - 1e-6) : end;
    const double late = at.share_from(last);
    if (at.low() >= last) {
      warn(settings.at("at"), fmt::format("{:.4g} s: the trace is over after {:g} s", at.low(), end));
    } else if (late > 1e-3) {
      warn(settings.at("at"),
           fmt::format("up to {:.4g} s: the trace is over after {:g} s, so that it never comes to {:.3g} % "
                       "of the particles",
                       at.high(), end, 100 * late));
    }
    const double mass = robot_mass(model);
    if (one.kind == Disturbance::Kind::push) {
      doubt_push(settings, space, one, mass, end);
    } else if (const Drawn load(space, one, "mass", one.mass); load.high() > kManyRobots * mass) {
      warn(settings.at("mass"),
           fmt::format("up to {:.4g} kg, and the robot weighs {:.3g} kg{}", load.high(), mass,
                       settings.at("mass").is_scalar() && is_bare(settings.at("mass")) ? "; did you mean g?" : ""));
    }
    if (one.point.norm() > kFarPoint * extent.norm()) {
      warn(settings.at("point"),
           fmt::format("{:.3g} m from the origin of {}, and the robot is {:.3g} m large; is the unit "
                       "meant?",
                       one.point.norm(), one.link, extent.norm()));
    }
  }
}

std::string disturbance_text(const Disturbance& one, const ParameterSpace& space) {
  const auto drawn = [&](const char* key, double value) { return Drawn(space, one, key, value); };
  const std::string at = drawn("at", one.at).text("s");
  std::string point;
  if (!one.point.isZero(0))
    point = fmt::format(" at ({:g}, {:g}, {:g}) m", one.point.x(), one.point.y(), one.point.z());
  if (one.kind == Disturbance::Kind::payload) {
    return fmt::format("{} on {}{} from {}", drawn("mass", one.mass).text("kg"), one.link, point, at);
  }
  const Drawn duration = drawn("duration", one.duration), elevation = drawn("elevation", one.elevation);
  const bool lasts = duration.varies() || one.duration > 0, rises = elevation.varies() || one.elevation != 0;
  return fmt::format("push of {}{} by {}{} towards azimuth {}{} at {}", one.link, point,
                     drawn(one.is_force ? "force" : "impulse", one.strength).text(one.is_force ? "N" : "N s"),
                     lasts ? " over " + duration.text("s") : "", drawn("azimuth", one.azimuth).text("rad"),
                     rises ? ", elevation " + elevation.text("rad") : "", at);
}

}  // namespace graze
