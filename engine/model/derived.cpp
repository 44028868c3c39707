#include "engine/model/derived.h"

#include <utility>

#include "engine/model/perturbation.h"
#include "engine/model/placement.h"

namespace graze {
namespace {

class List {
 public:
  void add(const std::string& name, const char* unit, double value) { out_.push_back({name, unit, value}); }
  void add(const std::string& name, const char* unit, const Vec3& value) {
    constexpr const char* kAxes[] = {".x", ".y", ".z"};
    for (int i = 0; i < 3; ++i) add(name + kAxes[i], unit, value[i]);
  }
  std::vector<Derived> take() { return std::move(out_); }

 private:
  std::vector<Derived> out_;
};

void add_inertia(const std::string& link, const Mat3& I, List& list) {
  const std::pair<const char*, double> entries[] = {{"xx", I(0, 0)}, {"yy", I(1, 1)}, {"zz", I(2, 2)},
                                                    {"xy", I(0, 1)}, {"xz", I(0, 2)}, {"yz", I(1, 2)}};
  for (const auto& [name, value] : entries) list.add(link + ".inertia." + name, "kg m^2", value);
}

/// The sizes that can be uncertain: a box has three edges, anything round a radius, a limb a length.
void add_sizes(const std::string& link, const Robot& robot, const LinkPlan& plan, List& list) {
  if (!plan.has_shape()) return;
  const Shape& shape = plan.primary(robot).shape;
  if (plan.has_length()) list.add(link + ".length", "m", plan.length(robot));
  if (shape.kind == ShapeKind::box) {
    list.add(link + ".size", "m", shape.size);
  } else if (shape.kind != ShapeKind::mesh) {
    list.add(link + ".radius", "m", shape.size.x());
  }
}

/// Named as the parameters of an object are; of meshes and heightfields all three, which hold factors too.
void add_object_sizes(const std::string& name, const Shape& shape, List& list) {
  const bool round = shape.kind == ShapeKind::cylinder || shape.kind == ShapeKind::capsule;
  if (round || shape.kind == ShapeKind::sphere) {
    list.add(name + ".radius", "m", shape.size.x());
    if (round) list.add(name + ".length", "m", shape.size.y());
  } else if (shape.kind != ShapeKind::plane) {
    list.add(name + ".size", "m", shape.size);
  }
  if (shape.spectrum) list.add(name + ".spectrum.rms", "m", shape.spectrum->rms);
}

/// Massless links have no centre of mass: their origin stands for it.
Vec3 com_of(const MassMoments& moments) { return moments.mass > 0 ? moments.com() : Vec3::Zero(); }
Mat3 inertia_of(const MassMoments& moments) {
  return moments.mass > 0 ? moments.inertia_about_com() : Mat3(Mat3::Zero());
}

}  // namespace

std::vector<Derived> derived_numbers(const World& world) {
  const Robot& robot = world.robot;
  const Model model = compile(world);
  const std::vector<Pose> X_WB = place_bodies(model, initial_state(world, model).q);
  std::vector<Pose> X_WL;  // of the links
  double mass = 0;
  Vec3 first = Vec3::Zero();
  for (std::size_t i = 0; i < robot.links.size(); ++i) {  // a model's first frames are the links in their order
    const Link& link = robot.links[i];
    X_WL.push_back(frame_pose(model, X_WB, static_cast<int>(i)));
    mass += link.inertia.mass;
    first += link.inertia.mass * (X_WL.back() * com_of(link.inertia));
  }
  const std::vector<LinkPlan> plans = link_plans(robot);
  List list;
  list.add("robot.mass", "kg", mass);
  if (mass > 0) list.add("robot.com", "m", first / mass - X_WL.front().translation());
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    const Link& link = robot.links[i];
    const std::string name = "link." + link.name;
    list.add(name + ".mass", "kg", link.inertia.mass);
    list.add(name + ".com", "m", com_of(link.inertia));
    add_inertia(name, inertia_of(link.inertia), list);
    add_sizes(name, robot, plans[i], list);
    list.add(name + ".position", "m", Vec3(X_WL[i].translation()));
  }
  for (const Joint& joint : robot.joints) {
    const std::string name = "joint." + joint.name;
    list.add(name + ".origin", "m", Vec3(joint.X_PJ.translation()));
    if (joint.type == JointType::fixed || joint.type == JointType::floating) continue;
    const bool slides = joint.type == JointType::prismatic;
    list.add(name + ".axis", "1", joint.axis);
    list.add(name + ".zero", slides ? "m" : "rad", joint.zero);
    list.add(name + ".damping", slides ? "N s/m" : "N m s/rad", joint.damping);
    list.add(name + ".friction", slides ? "N" : "N m", joint.friction);
    if (joint.driven()) list.add(name + ".reflected_inertia", slides ? "kg" : "kg m^2", joint.armature());
  }
  for (const Object& object : world.objects) {
    const std::string name = "object." + object.name;
    list.add(name + ".position", "m", Vec3(object.X_WO.translation()));
    add_object_sizes(name, object.shape, list);
    if (object.movable) list.add(name + ".mass", "kg", object.inertia.mass);
  }
  return list.take();
}

}  // namespace graze
