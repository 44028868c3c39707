#include "scenarios/disturbances.h"

#include <fmt/format.h>

#include <algorithm>

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
      read_number("mass", Quantity::mass, 0, out_.mass);
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
      read_number("force", Quantity::force, kAny, out_.strength);
      if (!settings_.has("duration")) settings_.at("force").fail("a force needs a 'duration'; or give an 'impulse'");
    } else {
      read_number("impulse", Quantity::impulse, kAny, out_.strength);
    }
    read_number("azimuth", Quantity::angle, kAny, out_.azimuth);
    read_number("elevation", Quantity::angle, kAny, out_.elevation);
    read_number("duration", Quantity::time, 0, out_.duration);
  }

  void read_number(const char* key, Quantity quantity, double least, double& value) {
    Parameter parameter;
    parameter.path = path_ + key;
    parameter.quantity = quantity;
    parameter.lower = least;
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

void check_disturbances(const Settings& scenario, const Model& model, const World& world, double end) {
  for (const Disturbance& one : world.disturbances) {
    const Settings settings = scenario.at("disturbances").at(one.name);
    const Settings link = settings.at(one.kind == Disturbance::Kind::push ? "push" : "payload");
    const std::vector<std::string> names = frame_names(model);
    if (std::find(names.begin(), names.end(), one.link) == names.end()) {
      link.fail(fmt::format("no link or movable object of that name; {}", nearest_or_all(one.link, names)));
    }
    if (model.frames[static_cast<std::size_t>(model.frame(one.link))].body < 0) link.fail("does not move");
    if (one.at >= end) {
      warn(settings.at("at"), fmt::format("{:g} s: the trace is over after {:g} s", one.at, end));
    }
  }
}

}  // namespace graze
