#include "scenarios/at_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/model/measures.h"
#include "engine/settings/warnings.h"
#include "scenarios/doubts.h"
#include "scenarios/overlaps.h"
#include "scenarios/witnesses.h"

namespace graze {
namespace {

using Overlap = Clearance::Overlap;

constexpr int kLane = kBeginningLane;

/// The particle in the middle of all; nothing if these values together make none.
std::optional<Particle> typical_particle(const Scenario& scenario) {
  std::vector<std::string> paths;
  std::vector<double> values;
  for (const UncertainParameter& parameter : scenario.space.parameters) {
    paths.push_back(parameter.name);
    values.push_back(parameter.persistent.median());
  }
  try {
    return Fabricator(scenario.world, paths).fabricate(0, values);
  } catch (const InputError&) {
    return std::nullopt;  // said of the particles that it holds for, when they are made
  }
}

std::string length_text(double metres) {
  return metres < 0.1 ? fmt::format("{:.2g} mm", 1000 * metres) : fmt::format("{:.3g} m", metres);
}

/// Where a robot whose base moves freely could begin instead: tries whether it is free of the environment elsewhere.
class FreePose {
 public:
  FreePose(const Model& model, const BlockState& state, double depth, double size)
      : model_(model),
        clearance_(clearance_of_all_parts(model)),
        state_(state),
        depth_(depth),
        most_(4 * (size + depth)),
        robot_(model.bodies.size(), 0) {
    for (const Collider& collider : model.colliders) {
      if (!collider.is_object && collider.body >= 0) robot_[static_cast<std::size_t>(collider.body)] = 1;
    }
  }

  bool free(const Vec3& shift) {
    constexpr double kTouching = 1e-6;
    BlockState moved = state_;
    for (std::size_t body = 0; body < robot_.size(); ++body) {
      for (int i = 0; robot_[body] && i < 3; ++i) moved.X(12 * static_cast<int>(body) + 9 + i, kLane) += shift[i];
    }
    const std::vector<Overlap> overlaps = clearance_.overlaps(moved, kLane);
    return std::none_of(overlaps.begin(), overlaps.end(), [&](const Overlap& one) {
      return model_.colliders[one.a].is_object != model_.colliders[one.b].is_object && one.depth > kTouching;
    });
  }

  /// How far to go in a direction, m, rounded up to two digits; nothing if no place is found within some sizes.
  std::optional<double> distance(const Vec3& direction) {
    double blocked = 0, far = depth_;
    for (; !free(far * direction); far *= 1.5) {
      if (far > most_) return std::nullopt;
      blocked = far;
    }
    for (int i = 0; i < 10; ++i) {
      const double middle = 0.5 * (blocked + far);
      (free(middle * direction) ? far : blocked) = middle;
    }
    double digit = 1;  // the second of `far`
    while (digit > 0.1 * far) digit /= 10;
    while (digit <= 0.01 * far) digit *= 10;
    for (const double about : {0.999 * far, far}) {  // the halving ends a little too far
      const double rounded = std::ceil(about / digit) * digit;
      if (free(rounded * direction)) return rounded;
    }
    return far;
  }

 private:
  const Model& model_;
  Clearance clearance_;  // hulls of meshes take long to find
  const BlockState& state_;
  const double depth_, most_;
  std::vector<char> robot_;  // bodies
};

/// Looks for parts that begin in each other.
class OverlapsAtStart {
 public:
  OverlapsAtStart(const Settings& root, const Scenario& scenario) : root_(root), scenario_(scenario) {}

  void look(const Particle& particle, const BlockState& state) {
    const Model& model = particle.model;
    const double size = robot_extent(model, particle.initial).norm();
    std::vector<Overlap> inside, with_objects, of_objects;
    for (const Overlap& one : clearance_of_all_parts(model).overlaps(state, kLane)) {
      if (one.depth < std::max(1e-3, 0.005 * size)) continue;
      const int objects = model.colliders[one.a].is_object + model.colliders[one.b].is_object;
      (objects == 0 ? inside : objects == 1 ? with_objects : of_objects).push_back(one);
    }
    for (auto* group : {&inside, &with_objects, &of_objects}) {
      std::stable_sort(group->begin(), group->end(), [](const auto& a, const auto& b) { return a.depth > b.depth; });
    }
    if (!inside.empty()) tell_of_links(model, inside);
    if (!with_objects.empty()) tell_of_environment(particle, state, with_objects);
    if (!of_objects.empty()) tell_of_objects(model, of_objects);
  }

 private:
  void tell_of_links(const Model& model, const std::vector<Overlap>& overlaps) const {
    constexpr std::ptrdiff_t kMost = 50;  // pairs to paste
    const std::vector<Overlap> shown(overlaps.begin(), overlaps.begin() + std::min(kMost, std::ssize(overlaps)));
    warn(root_.at("robot"),
         fmt::format("links are in each other at the start: {}; 'contact: {{ignore: {}}}' lets these pass through each "
                     "other, 'robot: {{ignore_initial_overlaps: true}}' all that begin so, 'contact: {{self_collision: "
                     "false}}' all of the robot",
                     overlaps_text(model, overlaps), ignore_text(model, shown)));
  }

  void tell_of_environment(const Particle& particle, const BlockState& state,
                           const std::vector<Overlap>& overlaps) const {
    const Model& model = particle.model;
    const Collider &a = model.colliders[overlaps[0].a], &b = model.colliders[overlaps[0].b];
    const std::string way = model.floating_base ? way_out(particle, state, overlaps[0].depth) : "";
    warn(root_.at("robot"),
         fmt::format("is in the environment at the start: {}; {}", overlaps_text(model, overlaps),
                     !way.empty() ? way
                                  : fmt::format("'robot.initial.position' or "
                                                "'environment.{}.position' moves one out of the other",
                                                a.is_object ? a.link : b.link)));
  }

  /// What in `initial` frees the robot; tried. Nothing if no such place was found.
  std::string way_out(const Particle& particle, const BlockState& state, double depth) const {
    const InitialState& initial = scenario_.world->initial;
    FreePose pose(particle.model, state, depth, robot_extent(particle.model, particle.initial).norm());
    if (!initial.on_ground && pose.free(to_ground(particle))) {
      return "in 'initial', 'height: on_ground' puts it on z = 0";
    }
    static const std::pair<const char*, Vec3> kSideways[] = {
        {"+x", Vec3::UnitX()}, {"-x", -Vec3::UnitX()}, {"+y", Vec3::UnitY()}, {"-y", -Vec3::UnitY()}};
    std::optional<double> least;
    std::string axis;
    for (const auto& [name, direction] : kSideways) {
      const auto distance = pose.distance(direction);
      if (!distance || (least && *least <= *distance)) continue;
      least = distance;
      axis = name;
    }
    const auto up = pose.distance(Vec3::UnitZ());
    constexpr double kFarther = 2;  // a robot that stands in what is below it is raised rather than moved away
    if (up && (!least || *up <= kFarther * *least)) {
      return initial.on_ground
                 ? fmt::format("in 'initial', 'clearance: {:.4g} m' raises it out", initial.clearance + *up)
                 : fmt::format("in 'initial', a base that is {} higher is free", length_text(*up));
    }
    return least ? fmt::format("in 'initial', a 'position' that is {} farther along {} is free", length_text(*least),
                               axis)
                 : "";
  }

  /// From where a robot begins to where `height: on_ground` has it.
  Vec3 to_ground(const Particle& particle) const {
    World grounded = *scenario_.world;
    grounded.initial.on_ground = true;
    const int z = particle.model.bodies[0].q + 6;
    return {0, 0, initial_state(grounded, particle.model).q[z] - particle.initial.q[z]};
  }

  void tell_of_objects(const Model& model, const std::vector<Overlap>& overlaps) const {
    warn(root_.at("environment"),
         fmt::format("objects are in each other at the start: {}", overlaps_text(model, overlaps)));
  }

  const Settings& root_;
  const Scenario& scenario_;
};

/// ", by 0.1 m: no contact between A and B (the pair that is meant)". Parts that touch have no overlap to be told.
std::string violation_text(const Model& model, const Requirement& one, double margin, int part) {
  const bool touch = margin == -kTouch && one.unit == "m";
  std::string pair;
  if (one.witness->parts() == PartKind::pair && part != kNoPart) {
    const int colliders = static_cast<int>(model.colliders.size());
    pair = model.colliders[part / colliders].name + " and " + model.colliders[part % colliders].name;
  }
  if (touch) return fmt::format(": {}, {} touch", one.description, pair.empty() ? "which" : pair);
  const std::string by = fmt::format(", by {:.3g} {}: {}", -margin, one.unit, one.description);
  return pair.empty() ? by : fmt::format("{} ({})", by, pair);
}

/// How far, m, a robot of a size may have come along an axis (0 … 2) after some seconds: faster than animals run, ten
/// lengths a second, and a length a second upward; it may fall.
double reach_of(const Settings& range, int axis, double size, double seconds, const Model& model) {
  const double sideways = 10 * size * seconds, upward = size * seconds;
  const double fall = 0.5 * std::abs(model.gravity[axis]) * seconds * seconds;
  return (axis < 2 ? sideways : upward) + (axis < 2 || range.has("below") ? fall : 0);
}

/// "; did you mean 30 cm?" for the place that a witness asks for, as length_meant() has it, `seconds` after the start.
/// Of several axes it is not known which one is missed.
std::string place_meant(const Settings& witness, double margin, double size, double seconds, const Model& model) {
  const auto meant = [&](const Settings& range, int axis) {
    return length_meant(range, margin, size, seconds > 0 ? reach_of(range, axis, size, seconds, model) : 0);
  };
  if (const auto height = witness.find("height")) return meant(*height, 2);
  const auto position = witness.find("position");
  int only = -1;
  constexpr const char* kAxes[] = {"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis) {
    if (!position || !position->has(kAxes[axis])) continue;
    if (only >= 0) return "";
    only = axis;
  }
  return only < 0 ? "" : meant(position->at(kAxes[only]), only);
}

/// The predicates of an objective in the order of leaves().
void collect_leaves(const Settings& predicate, std::vector<Settings>& leaves) {
  for (const char* inner : {"all", "any", "not"}) {
    if (!predicate.has(inner)) continue;
    for (const Settings& part : predicate.at(inner).items()) collect_leaves(part, leaves);
    return;
  }
  leaves.push_back(predicate);
}

std::vector<Settings> written_leaves(const Settings& objective) {
  std::vector<std::string> keys = witness_names();
  keys.insert(keys.end(), {"all", "any", "not"});
  const auto entries = objective.entries();
  const bool named =
      entries.size() == 1 && std::find(keys.begin(), keys.end(), entries[0].first) == keys.end();  // gives it a name
  std::vector<Settings> leaves;
  collect_leaves(named ? entries[0].second : objective, leaves);
  return leaves;
}

/// Looks at what is judged before the first step, as the judge of traces does.
class TaskAtStart {
 public:
  TaskAtStart(const Settings& root, const Scenario& scenario, const Particle& particle)
      : task_(root.find("task")), scenario_(scenario), model_(particle.model), monitor_(scenario.task) {
    monitor_.start(kLane, model_);
    size_ = robot_extent(model_, particle.initial).norm();
  }

  void look(const BlockState& state) {
    if (!task_) return;
    BlockArray tau(model_.na()), headroom(model_.na()), requirements, objective;
    for (int k = 0; k < model_.na(); ++k) headroom(k, kLane) = model_.bodies[model_.actuated[k]].effort;
    LaneMask lane;
    lane.set(kLane);
    const WitnessInput input{state, {}, tau, headroom, {}, lane};
    monitor_.update(input);
    monitor_.values(input, requirements, objective);
    const std::vector<double> margins = monitor_.margins(kLane);
    const std::vector<int> parts = monitor_.margin_parts(kLane);
    for (std::size_t i = 0; i < margins.size(); ++i) {
      const Requirement& one = scenario_.task.requirements[i];
      const Settings written = task_->at(one.measure ? "measures" : "requirements").at(one.name);
      if (margins[i] < 0) {
        tell_violated(written, one, margins[i], parts[i]);
      } else if (!one.window.contains(0)) {
        doubt_place(written, requirements(static_cast<int>(i), kLane), one.description, one.window);
      }
    }
    if (const auto place = task_->find("objective")) look_at_objective(*place, objective);
  }

 private:
  void tell_violated(const Settings& written, const Requirement& one, double margin, int part) const {
    const char* then = scenario_.task.stop_at_violation ? "; a trace that begins so ends there" : "";
    if (one.measure) {
      then = written.has("contact")
                 ? "; a trace that begins so does not keep it: 'window: [FROM, TO]' looks later, and the measure "
                   "'no_contact' tells which traces touch at all"
                 : "; a trace that begins so does not keep it: 'window: [FROM, TO]' looks later";
    }
    warn(written, fmt::format("is violated at the start already{}{}{}", violation_text(model_, one, margin, part),
                              place_meant(written, margin, size_, 0, model_), then));
  }

  void look_at_objective(const Settings& place, const BlockArray& values) const {
    const std::vector<Settings> written = written_leaves(place);
    const std::vector<const Objective*> read = leaves(scenario_.task.objective);
    for (std::size_t i = 0; i < std::min(written.size(), read.size()); ++i) {
      doubt_place(written[i], values(static_cast<int>(i), kLane), read[i]->description, read[i]->window);
    }
  }

  /// A place that is asked for later, and that the robot can hardly come to.
  void doubt_place(const Settings& written, double value, const std::string& description, const Window& window) const {
    if (!(value < 0)) return;
    const double seconds = std::min(window.to, scenario_.timing.end);
    const std::string meant = place_meant(written, value, size_, seconds, model_);
    if (meant.empty()) return;
    warn(written,
         fmt::format("is missed at the start by {:.3g} m, farther than a robot of {:.3g} m goes in {:g} s: {}{}",
                     -value, size_, seconds, description, meant));
  }

  const std::optional<Settings> task_;
  const Scenario& scenario_;
  const Model& model_;
  TaskMonitor monitor_;
  double size_ = 0;  // m
};

}  // namespace

void doubt_start(const Settings& root, const Scenario& scenario) {
  const std::optional<Particle> particle = typical_particle(scenario);
  if (!particle) return;
  const BlockState state = beginning(particle->model, particle->initial);
  OverlapsAtStart(root, scenario).look(*particle, state);
  TaskAtStart(root, scenario, *particle).look(state);
}

}  // namespace graze
