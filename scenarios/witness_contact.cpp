// Witnesses of contact between parts. A part is a glob of collision shapes' or links' names, or of one shape's
// features ("curb.side"). Margins are gaps in metres as far as the back end reports near points, saturated at 2 cm.
#include <fmt/format.h>

#include <algorithm>

#include "scenarios/keys.h"
#include "scenarios/names.h"
#include "scenarios/witnesses.h"

namespace graze {
namespace {

/// Gaps beyond this are not told apart, m.
constexpr double kFar = 0.02;
/// Least margin of a touch that overlaps by less, so that its sign is never 0, m.
constexpr double kTouch = 1e-9;

constexpr int kFeatures = static_cast<int>(Feature::rim) + 1;

/// Which (collider, feature) a pattern names: bit f of mask[collider].
struct Part {
  std::vector<unsigned> mask;
  bool has(int collider, Feature feature) const { return (mask[collider] >> static_cast<unsigned>(feature)) & 1u; }
};

unsigned features_named(const std::string& pattern, const Collider& collider) {
  if (matches(pattern, collider.name) || matches(pattern, collider.link)) return ~0u;
  unsigned out = 0;
  for (int f = 0; f < kFeatures; ++f) {
    const std::string suffix = fmt::format(".{}", feature_name(static_cast<Feature>(f)));
    if (matches(pattern, collider.name + suffix) || matches(pattern, collider.link + suffix)) out |= 1u << f;
  }
  return out;
}

Part read_part(const Settings& settings, const Model& nominal) {
  const std::string pattern = settings.text();
  Part part;
  bool any = false;
  for (const Collider& collider : nominal.colliders) {
    part.mask.push_back(features_named(pattern, collider));
    any = any || part.mask.back() != 0;
  }
  if (!any) {
    std::vector<std::string> names = part_names(nominal);
    const std::size_t parts = names.size();
    for (std::size_t i = 0; i < parts; ++i) {
      for (int f = 0; f < kFeatures; ++f) {
        names.push_back(fmt::format("{}.{}", names[i], feature_name(static_cast<Feature>(f))));
      }
    }
    match_names(settings, pattern, names, "part of the robot or the environment");
  }
  return part;
}

/// Contacts between two sets of parts.
struct Between {
  Part first, second;

  bool operator()(const Contact& c) const {
    return (first.has(c.a, c.feature_a) && second.has(c.b, c.feature_b)) ||
           (first.has(c.b, c.feature_b) && second.has(c.a, c.feature_a));
  }
};

/// `[a, b]`; refused if no pair of colliders that may touch is meant, because then nothing could ever change it.
Between read_between(const Settings& settings, const Model& nominal) {
  const std::vector<Settings> parts = settings.items();
  if (parts.size() != 2) settings.fail("must be a list of two parts, e.g. [\"*_FOOT\", curb.side]");
  Between out{read_part(parts[0], nominal), read_part(parts[1], nominal)};
  for (const ColliderPair& pair : nominal.pairs) {
    if ((out.first.mask[pair.a] && out.second.mask[pair.b]) || (out.first.mask[pair.b] && out.second.mask[pair.a])) {
      return out;
    }
  }
  settings.fail(
      fmt::format("{} and {} never touch: they are one body, neighbours at a joint, both fixed, or in contact.ignore",
                  parts[0].text(), parts[1].text()));
}

class NoContact : public Witness {
 public:
  explicit NoContact(Between between) : between_(std::move(between)) {}

  double evaluate(const WitnessInput& in) const override {
    double least = kFar;
    for (const Contact& c : in.contacts) {
      if (between_(c)) least = std::min(least, c.touching() ? std::min(c.phi, -kTouch) : c.phi);
    }
    return least;
  }

 private:
  Between between_;
};

/// At least one of the pairs touches.
class HeldContact : public Witness {
 public:
  explicit HeldContact(Between between) : between_(std::move(between)) {}

  double evaluate(const WitnessInput& in) const override {
    double greatest = -kFar;
    for (const Contact& c : in.contacts) {
      if (between_(c)) greatest = std::max(greatest, c.touching() ? std::max(-c.phi, kTouch) : -c.phi);
    }
    return greatest;
  }

 private:
  Between between_;
};

class NoSelfCollision : public Witness {
 public:
  explicit NoSelfCollision(std::vector<bool> robot) : robot_(std::move(robot)) {}

  double evaluate(const WitnessInput& in) const override {
    double least = kFar;
    for (const Contact& c : in.contacts) {
      if (robot_[c.a] && robot_[c.b]) least = std::min(least, c.touching() ? std::min(c.phi, -kTouch) : c.phi);
    }
    return least;
  }

 private:
  std::vector<bool> robot_;  // per collider
};

std::string between_text(const Settings& settings) {
  const std::vector<Settings> parts = settings.items();
  return parts[0].text() + " and " + parts[1].text();
}

}  // namespace

ReadWitness read_no_contact(const Settings& settings, const Model& nominal) {
  return {std::make_shared<NoContact>(read_between(settings, nominal)), "no contact between " + between_text(settings),
          "m"};
}

ReadWitness read_contact(const Settings& settings, const Model& nominal) {
  return {std::make_shared<HeldContact>(read_between(settings, nominal)), "contact between " + between_text(settings),
          "m"};
}

ReadWitness read_self_collision(const Settings& settings, const Model& nominal) {
  if (settings.is_scalar()) {  // "self_collision: true" reads as well as "self_collision: {}"
    if (!settings.flag()) settings.fail("false: leave the line out instead");
  } else {
    settings.allow(keys_of("self_collision"));
  }
  std::vector<bool> robot;
  for (const Collider& collider : nominal.colliders) robot.push_back(!collider.is_object);
  const bool possible = std::any_of(nominal.pairs.begin(), nominal.pairs.end(),
                                    [&](const ColliderPair& pair) { return robot[pair.a] && robot[pair.b]; });
  if (!possible) {
    settings.fail_key(
        "no two parts of the robot may touch (contact.self_collision is false, contact.ignore names them "
        "all, or all are neighbours), so this can never be violated");
  }
  return {std::make_shared<NoSelfCollision>(std::move(robot)), "no contact between non-adjacent links", "m"};
}

}  // namespace graze
