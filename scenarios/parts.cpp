#include "scenarios/parts.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/settings/warnings.h"
#include "scenarios/names.h"

namespace graze {
namespace {

constexpr int kFeatures = static_cast<int>(Feature::rim) + 1;
constexpr unsigned kAllFeatures = ~0u;

/// Whether feature_of() can be this for such a shape: a pattern must not name what can never touch.
bool has_feature(ShapeKind kind, Feature feature) {
  switch (feature) {
    case Feature::surface:
      return kind != ShapeKind::box && kind != ShapeKind::cylinder;
    case Feature::side:
      return kind == ShapeKind::box || kind == ShapeKind::cylinder;
    case Feature::cap:
    case Feature::rim:
      return kind == ShapeKind::cylinder;
    default:
      return kind == ShapeKind::box;
  }
}

unsigned features_named(const std::string& pattern, const Collider& collider) {
  if (matches(pattern, collider.name) || matches(pattern, collider.link)) return kAllFeatures;
  unsigned out = 0;
  for (int f = 0; f < kFeatures; ++f) {
    if (!has_feature(collider.shape.kind, static_cast<Feature>(f))) continue;
    const std::string suffix = fmt::format(".{}", feature_name(static_cast<Feature>(f)));
    if (matches(pattern, collider.name + suffix) || matches(pattern, collider.link + suffix)) out |= 1u << f;
  }
  return out;
}

/// Whether shapes of this kind have but one feature, their surface.
bool is_plain(ShapeKind kind) { return has_feature(kind, Feature::surface); }

/// Fails for a feature that a part does not have, if that is what `pattern` names: "ground.side" of a plane.
void refuse_feature(const Settings& settings, const std::string& pattern, const Model& nominal) {
  const std::size_t dot = pattern.rfind('.');
  if (dot == std::string::npos) return;
  const std::string part = pattern.substr(0, dot), feature = pattern.substr(dot + 1);
  bool known = false;
  for (int f = 0; f < kFeatures; ++f) known = known || feature == feature_name(static_cast<Feature>(f));
  if (!known) return;
  bool any = false;
  for (const Collider& collider : nominal.colliders) {
    if (!matches(part, collider.name) && !matches(part, collider.link)) continue;
    if (!is_plain(collider.shape.kind)) return;
    any = true;
  }
  if (!any) return;
  settings.fail(
      fmt::format("{}: matches no part of the robot or the environment: the only feature of {} is its "
                  "surface; did you mean '{}'?",
                  pattern, part, part));
}

Parts read_part(const Settings& settings, const Model& nominal) {
  const std::string pattern = settings.glob();
  Parts part;
  bool any = false;
  for (const Collider& collider : nominal.colliders) {
    part.features.push_back(features_named(pattern, collider));
    any = any || part.features.back() != 0;
  }
  if (!any) refuse_feature(settings, pattern, nominal);
  if (!any || pattern.find('{') != std::string::npos) {
    std::vector<std::string> names = part_names(nominal);
    for (const Collider& collider : nominal.colliders) {
      for (int f = 0; f < kFeatures; ++f) {
        const auto feature = static_cast<Feature>(f);
        if (!has_feature(collider.shape.kind, feature)) continue;
        names.push_back(fmt::format("{}.{}", collider.name, feature_name(feature)));
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

unsigned one_way(const ContactPoint& point, unsigned mask_a, unsigned mask_b) {
  if (mask_a == 0 || mask_b == 0) return 0;
  return lanes_with(point.row(kFeatureA), mask_a) & lanes_with(point.row(kFeatureB), mask_b) & point.lanes.bits();
}

constexpr unsigned bit(Feature feature) { return 1u << static_cast<unsigned>(feature); }

/// Whether the bottom of a fixed box lies on or within a fixed half space: nothing can get there.
bool bottom_is_covered(const Collider& box, const Model& nominal) {
  if (box.shape.kind != ShapeKind::box || box.body >= 0) return false;
  const auto covers = [&](const Collider& plane) {
    if (plane.shape.kind != ShapeKind::plane || plane.body >= 0) return false;
    for (int corner = 0; corner < 4; ++corner) {
      const Vec3 p(corner % 2 ? 0.5 : -0.5, corner / 2 ? 0.5 : -0.5, -0.5);
      if ((plane.X_BG.inverse() * (box.X_BG * p.cwiseProduct(box.shape.size))).z() > 1e-9) return false;
    }
    return true;
  };
  return std::any_of(nominal.colliders.begin(), nominal.colliders.end(), covers);
}

/// With which of its features a part can touch another: with a plane, flat things touch at their corners and rims.
unsigned touchable(const Collider& part, const Collider& other, const Model& nominal) {
  if (other.shape.kind == ShapeKind::plane && part.shape.kind == ShapeKind::box) return bit(Feature::vertex);
  if (other.shape.kind == ShapeKind::plane && part.shape.kind == ShapeKind::cylinder) return bit(Feature::rim);
  return bottom_is_covered(part, nominal) ? ~bit(Feature::bottom) : kAllFeatures;
}

/// Warns of features that are there and yet touch nothing of what is meant.
void doubt_features(const Settings& settings, const Between& between, const Model& nominal) {
  for (const ColliderPair& pair : nominal.pairs) {
    const Collider &a = nominal.colliders[pair.a], &b = nominal.colliders[pair.b];
    const unsigned of_a = touchable(a, b, nominal), of_b = touchable(b, a, nominal);
    const auto &first = between.first.features, &second = between.second.features;
    if ((first[pair.a] & of_a) && (second[pair.b] & of_b)) return;
    if ((second[pair.a] & of_a) && (first[pair.b] & of_b)) return;
  }
  warn(
      settings,
      fmt::format("{} never touch so: a box or cylinder meets a plane with its vertex or rim alone, and what lies on a "
                  "plane has a bottom that nothing meets; name the whole part, without a feature",
                  between.text));
}

}  // namespace

unsigned Between::first_is_a(const ContactPoint& point) const {
  return one_way(point, first.features[point.a], second.features[point.b]);
}

unsigned Between::operator()(const ContactPoint& point) const {
  return first_is_a(point) | one_way(point, second.features[point.a], first.features[point.b]);
}

Between read_between(const Settings& settings, const Model& nominal) {
  const std::vector<Settings> parts = settings.items();
  if (parts.size() != 2) settings.fail("must be a list of two parts, e.g. [\"*_FOOT\", curb.side]");
  Between out{read_part(parts[0], nominal), read_part(parts[1], nominal), parts[0].text() + " and " + parts[1].text(),
              0};
  const std::vector<unsigned>&first = out.first.features, &second = out.second.features;
  for (const ColliderPair& pair : nominal.pairs) {
    out.pairs += (first[pair.a] && second[pair.b]) || (first[pair.b] && second[pair.a]);
  }
  if (out.pairs > 0) {
    doubt_features(settings, out, nominal);
    return out;
  }
  settings.fail(fmt::format(
      "{} never touch: they are one body, neighbours at a joint, both fixed, or in contact.ignore", out.text));
}

}  // namespace graze
