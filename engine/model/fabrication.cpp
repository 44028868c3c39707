#include "engine/model/fabrication.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <set>
#include <string_view>

#include "engine/lanes/scalar.h"
#include "engine/model/parameters.h"

namespace graze {

namespace {

/// Segments of a dotted path: "a.b.c" -> a, b, c.
std::vector<std::string> segments(const std::string& path) {
  std::vector<std::string> out{""};
  for (char c : path) {
    if (c == '.') {
      out.emplace_back();
    } else {
      out.back() += c;
    }
  }
  return out;
}

std::string join(const std::vector<std::string>& parts) { return fmt::format("{}", fmt::join(parts, ".")); }

/// Perpendicular to a unit axis: the projection of the coordinate axis that is farthest from it (the first such), so
/// that equal axes always have equal headings.
Vec3 heading_zero(const Vec3& axis) {
  int k = 0;
  axis.cwiseAbs().minCoeff(&k);
  return (Vec3::Unit(k) - axis[k] * axis).normalized();
}

Vec3 tilted(const Vec3& axis, const AxisChange& change) {
  const Vec3 e1 = heading_zero(axis), e2 = axis.cross(e1);
  const Vec3 toward = pinned::cos(change.heading) * e1 + pinned::sin(change.heading) * e2;
  return (pinned::cos(change.tilt) * axis + pinned::sin(change.tilt) * toward).normalized();
}

[[noreturn]] void refuse(const Parameter& parameter, double value, const std::string& rule) {
  const bool plain = parameter.quantity == Quantity::dimensionless;
  throw InputError(fmt::format("{}: {:g}{}{}: {}", parameter.path, value, plain ? "" : " ",
                               plain ? "" : unit_of(parameter.quantity), rule));
}

void check(const Parameter& parameter, double value) {
  if (!std::isfinite(value)) refuse(parameter, value, "must be a finite number");
  if (!parameter.choices.empty() && value != std::floor(value)) {
    refuse(parameter, value, "must be the index of a choice, a whole number");
  }
  if (value < parameter.lower || (parameter.strict && value == parameter.lower)) {
    refuse(parameter, value, fmt::format("must be {} {:g}", parameter.strict ? ">" : ">=", parameter.lower));
  }
  if (value > parameter.upper) refuse(parameter, value, fmt::format("must be <= {:g}", parameter.upper));
}

std::vector<double> joint_zeros(const World& world) {
  std::vector<double> zeros;
  for (const Joint& joint : world.robot.joints) {
    if (joint.driven()) zeros.push_back(joint.zero);
  }
  return zeros;
}

BodyDisturbance on_body(const Disturbance& from, const Model& model) {
  const Frame& frame = model.frames.at(static_cast<std::size_t>(model.frame(from.link)));
  BodyDisturbance out;
  out.kind = from.kind;
  out.body = frame.body;
  out.p_B = frame.X_BF * from.point;
  out.at = from.at;
  out.duration = from.duration;
  out.mass = from.mass;
  const double flat = pinned::cos(from.elevation);
  const Vec3 direction(flat * pinned::cos(from.azimuth), flat * pinned::sin(from.azimuth), pinned::sin(from.elevation));
  out.impulse_W = (from.is_force ? from.strength * from.duration : from.strength) * direction;
  return out;
}

Particle particle_of(std::uint32_t id, const World& world, std::vector<double> sensor_bias) {
  Particle particle;
  particle.id = id;
  particle.model = compile(world);
  particle.initial = initial_state(world, particle.model);
  particle.control_lag = world.control_lag;
  particle.joint_zero = joint_zeros(world);
  particle.sensor_bias = std::move(sensor_bias);
  for (const Disturbance& one : world.disturbances) particle.disturbances.push_back(on_body(one, particle.model));
  return particle;
}

}  // namespace

// ---- ParameterTable

ParameterTable::ParameterTable(const World& world) {
  for (AddressedParameter& entry : list_parameters(world)) {
    index_.emplace(entry.parameter.path, static_cast<int>(parameters_.size()));
    parameters_.push_back(std::move(entry.parameter));
  }
}

const Parameter* ParameterTable::find(const std::string& path) const {
  const auto found = index_.find(path);
  return found == index_.end() ? nullptr : &parameters_[static_cast<std::size_t>(found->second)];
}

std::vector<int> ParameterTable::match(const std::string& pattern) const {
  if (pattern.find_first_of("*?{") == std::string::npos) {
    const auto found = index_.find(pattern);
    return found == index_.end() ? std::vector<int>() : std::vector<int>{found->second};
  }
  std::vector<int> out;
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    if (matches(pattern, parameters_[i].path)) out.push_back(static_cast<int>(i));
  }
  return out;
}

/// Follows the pattern from the left for as long as its segments fit some path, and replaces the first that does not by
/// the nearest that would.
/// Another shape's name for a size: boxes have `size`, round things `radius` and `length`.
std::string other_size(const std::string& words) {
  static const std::map<std::string, std::string> kOther = {{"size.x", "radius"}, {"size.y", "radius"},
                                                            {"size.z", "length"}, {"length", "size.z"},
                                                            {"height", "length"}, {"diameter", "radius"}};
  const auto found = kOther.find(words);
  return found == kOther.end() ? "" : found->second;
}

std::string ParameterTable::suggest(const std::string& pattern) const {
  std::vector<std::vector<std::string>> paths;
  for (const Parameter& parameter : parameters_) paths.push_back(segments(parameter.path));
  std::vector<std::string> words = segments(pattern);
  std::size_t k = 0;
  for (; k < words.size(); ++k) {
    std::vector<std::string> here;
    std::vector<std::vector<std::string>> fitting;
    for (const auto& path : paths) {
      if (path.size() <= k) continue;
      here.push_back(path[k]);
      if (matches(words[k], path[k])) fitting.push_back(path);
    }
    if (!fitting.empty()) {
      paths = std::move(fitting);
      continue;
    }
    const std::string near = nearest(words[k], here);
    if (near.empty()) break;
    words[k] = near;
    if (!matches(near, near)) break;  // a name with a glob's own characters, which fits nothing
    --k;                              // now it fits
  }
  if (!match(join(words)).empty()) return join(words);
  constexpr std::size_t kNamed = 2;  // segments that name a thing: another thing's parameter is not meant
  if (k >= kNamed && k < words.size()) {
    const auto behind = words.begin() + static_cast<std::ptrdiff_t>(k);
    const std::vector<std::string> head(words.begin(), behind);
    const std::string other = join(head) + "." + other_size(join({behind, words.end()}));
    if (!match(other).empty()) return other;
    return "";
  }
  std::vector<std::string> all;
  for (const Parameter& parameter : parameters_) all.push_back(parameter.path);
  return nearest(pattern, all);
}

// ---- Fabricator

struct Fabricator::Plan {
  std::vector<AddressedParameter> values;  // per path
  std::vector<LinkPlan> links;             // per link
  std::vector<char> changed_links, changed_joints, changed_objects;
  std::vector<double> bias;
  World base;  // the nominal world without its pictures
};

namespace {

/// Which of many items the paths with this prefix name, by the item's name up to the next dot.
template <typename Items>
std::vector<char> touched(const Items& items, const std::string& prefix, const std::vector<std::string>& paths) {
  const std::set<std::string_view> sorted(paths.begin(), paths.end());
  std::vector<char> out(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::string start = prefix + items[i].name + ".";
    const auto next = sorted.lower_bound(start);
    out[i] = next != sorted.end() && next->substr(0, start.size()) == start;
  }
  return out;
}

/// Pictures do not matter to a particle, except where they stand for the shape of a link without collision shapes.
World without_pictures(World world) {
  for (Link& link : world.robot.links) {
    if (!link.collisions.empty()) link.visuals.clear();
  }
  return world;
}

}  // namespace

std::optional<std::pair<std::size_t, std::size_t>> mass_and_density(const std::vector<std::string>& paths) {
  std::map<std::string_view, std::size_t> index;
  for (std::size_t i = 0; i < paths.size(); ++i) index.emplace(paths[i], i);
  for (std::size_t i = 0; i < paths.size(); ++i) {
    if (!paths[i].ends_with(".mass")) continue;
    const auto density = index.find(paths[i].substr(0, paths[i].size() - 4) + "density");
    if (density != index.end()) return std::pair(i, density->second);
  }
  return std::nullopt;
}

std::string mass_and_density_text(const std::string& mass, const std::string& density) {
  return fmt::format("{} and {}: only one of them can be uncertain; mass is density times volume", mass, density);
}

Fabricator::Fabricator(std::shared_ptr<const World> nominal, std::vector<std::string> paths)
    : world_(std::move(nominal)), paths_(std::move(paths)) {
  auto plan = std::make_shared<Plan>();
  std::map<std::string, AddressedParameter> known;
  for (AddressedParameter& entry : list_parameters(*world_)) known.emplace(entry.parameter.path, entry);
  for (const std::string& path : paths_) {
    const auto found = known.find(path);
    if (found == known.end()) {
      const std::string near = ParameterTable(*world_).suggest(path);
      throw InputError(
          fmt::format("{}: no such parameter{}", path, near.empty() ? "" : "; did you mean " + near + "?"));
    }
    plan->values.push_back(found->second);
  }
  if (const auto both = mass_and_density(paths_)) {
    throw InputError(mass_and_density_text(paths_[both->first], paths_[both->second]));
  }
  const Robot& robot = world_->robot;
  plan->links = link_plans(robot);
  plan->changed_links = touched(robot.links, "robot.link.", paths_);
  plan->changed_joints = touched(robot.joints, "robot.joint.", paths_);
  plan->changed_objects = touched(world_->objects, "environment.", paths_);
  plan->bias = nominal_bias(*world_);
  plan->base = without_pictures(*world_);
  plan_ = std::move(plan);
}

/// A perturbed world, and the bias of each channel.
struct Fabricator::Made {
  World world;
  std::vector<double> sensor_bias;
};

Fabricator::Made Fabricator::make(std::span<const double> values) const {
  assert(values.size() == paths_.size());
  const Plan& plan = *plan_;
  Draft draft{plan.base, std::vector<LinkChange>(plan.base.robot.links.size()),
              std::vector<AxisChange>(plan.base.robot.joints.size()),
              std::vector<ObjectChange>(plan.base.objects.size()), plan.bias};
  for (std::size_t i = 0; i < values.size(); ++i) {
    check(plan.values[i].parameter, values[i]);
    plan.values[i].set(draft, values[i]);
  }
  Robot& robot = draft.world.robot;
  for (std::size_t i = 0; i < draft.links.size(); ++i) {
    if (plan.changed_links[i]) plan.links[i].apply(draft.links[i], robot);
  }
  for (std::size_t i = 0; i < draft.axes.size(); ++i) {
    if (plan.changed_joints[i]) robot.joints[i].axis = tilted(robot.joints[i].axis, draft.axes[i]);
  }
  for (std::size_t i = 0; i < draft.objects.size(); ++i) {
    if (plan.changed_objects[i]) apply(draft.objects[i], draft.world.objects[i]);
  }
  return {std::move(draft.world), std::move(draft.sensor_bias)};
}

Particle Fabricator::fabricate(std::uint32_t id, std::span<const double> values) const {
  Made made = make(values);
  return particle_of(id, made.world, std::move(made.sensor_bias));
}

World Fabricator::perturbed(std::span<const double> values) const { return make(values).world; }

Particle Fabricator::nominal() const { return particle_of(0, *world_, nominal_bias(*world_)); }

}  // namespace graze
