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
constexpr unsigned kAllFeatures = ~0u;

/// Which (collider, feature) a pattern names: bit f of mask[collider].
struct Part {
  std::vector<unsigned> mask;
};

unsigned features_named(const std::string& pattern, const Collider& collider) {
  if (matches(pattern, collider.name) || matches(pattern, collider.link)) return kAllFeatures;
  unsigned out = 0;
  for (int f = 0; f < kFeatures; ++f) {
    const std::string suffix = fmt::format(".{}", feature_name(static_cast<Feature>(f)));
    if (matches(pattern, collider.name + suffix) || matches(pattern, collider.link + suffix)) out |= 1u << f;
  }
  return out;
}

Part read_part(const Settings& settings, const Model& nominal) {
  const std::string pattern = settings.glob();
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

/// Lanes of a point whose feature, a row of numbers, is in the mask.
unsigned lanes_with(const double* feature, unsigned mask) {
  if (mask == kAllFeatures) return LaneMask::all().bits();
  unsigned out = 0;
  for (int lane = 0; lane < kLanes; ++lane) out |= (mask >> static_cast<unsigned>(feature[lane]) & 1u) << lane;
  return out;
}

/// Contacts between two sets of parts.
struct Between {
  Part first, second;

  /// Lanes in which the point is one of them.
  unsigned operator()(const ContactPoint& point) const {
    return one_way(point, first.mask[point.a], second.mask[point.b]) |
           one_way(point, second.mask[point.a], first.mask[point.b]);
  }

 private:
  static unsigned one_way(const ContactPoint& point, unsigned mask_a, unsigned mask_b) {
    if (mask_a == 0 || mask_b == 0) return 0;
    return lanes_with(point.row(kFeatureA), mask_a) & lanes_with(point.row(kFeatureB), mask_b) & point.lanes.bits();
  }
};

/// least = min(least, gap) in some lanes; points that touch count as overlapping.
void take_gaps(const ContactPoint& point, unsigned lanes, double* least) {
  const unsigned touching = point.touching().bits();
  const double* gap = point.row(kGap);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!(lanes >> lane & 1u)) continue;
    least[lane] = std::min(least[lane], touching >> lane & 1u ? std::min(gap[lane], -kTouch) : gap[lane]);
  }
}

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

  void evaluate(const WitnessInput& in, const BlockArray&, double* out) const override {
    std::fill_n(out, kLanes, kFar);
    for (const ContactPoint& point : in.points) {
      const unsigned lanes = between_(point);
      if (lanes != 0) take_gaps(point, lanes, out);
    }
  }

 private:
  Between between_;
};

/// At least one of the pairs touches.
class HeldContact : public NoContact {
 public:
  using NoContact::NoContact;

  void evaluate(const WitnessInput& in, const BlockArray& own, double* out) const override {
    NoContact::evaluate(in, own, out);
    for (int lane = 0; lane < kLanes; ++lane) out[lane] = -out[lane];
  }
};

class NoSelfCollision : public Witness {
 public:
  explicit NoSelfCollision(std::vector<bool> robot) : robot_(std::move(robot)) {}

  void evaluate(const WitnessInput& in, const BlockArray&, double* out) const override {
    std::fill_n(out, kLanes, kFar);
    for (const ContactPoint& point : in.points) {
      if (robot_[point.a] && robot_[point.b]) take_gaps(point, point.lanes.bits(), out);
    }
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
