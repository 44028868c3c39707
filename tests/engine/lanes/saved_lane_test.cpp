// Claim: a lane that was saved in the middle of its motion goes on with the same bits in any lane of any block that is
// made for its model, whatever the block did before, as often as one likes and beside whatever neighbours; each back
// end, contact model and width.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <stdexcept>

#include "engine/bullet/energy.h"
#include "engine/lane_physics/lane_physics.h"
#include "engine/physics.h"
#include "tests/engine/lanes/random_worlds.h"
#include "tests/engine/lanes/worlds.h"
#include "tests/sanitized.h"

namespace graze::test {
namespace {

using ::testing::HasSubstr;
using Maker = std::function<std::unique_ptr<BlockPhysics>(const Model&)>;

/// A particle with what drives it, and as many steps as its trace takes.
struct Case {
  Particle particle;
  Driver driver;
  int steps;
};

/// A block in which one lane after the other is filled and run, with all that it shows put down.
class Block {
 public:
  Block(const Maker& make, const Model& model) : physics_(make(model)), drive_(model.na()), result_(model.na()) {}

  BlockPhysics& physics() { return *physics_; }

  /// Keeps a lane busy with another particle, in this step and all that follow.
  void employ(int lane, const Case& one) {
    physics_->start(lane, one.particle);
    busy_.push_back({lane, &one});
  }
  void dismiss(int lane) {
    std::erase_if(busy_, [&](const auto& worker) { return worker.first == lane; });
  }

  /// Step number `step` of the case in `lane`; the busy lanes move on.
  void step(const Case& one, int lane, int step) {
    LaneMask active;
    active.set(lane);
    one.driver.fill(step, lane, drive_);
    ++ticks_;
    for (const auto& [at, worker] : busy_) {
      if (at == lane) continue;
      active.set(at);
      worker->driver.fill(ticks_, at, drive_);
    }
    if (one.driver.torques_alone || !physics_->solves_drives()) {
      physics_->step(kStep, active, drive_.tau);
    } else {
      physics_->drive(kStep, active, drive_, result_);
    }
  }

  /// Runs steps [from, to) of a lane, and adds what it shows before the first and after each.
  Trace run(const Case& one, int lane, int from, int to) {
    Trace out;
    look(lane, out);
    for (int k = from; k < to && !physics_->fault(lane); ++k) {
      step(one, lane, k);
      look(lane, out);
    }
    out.fault = physics_->fault(lane).value_or("");
    return out;
  }

 private:
  void look(int lane, Trace& out) const {
    const BlockState& state = physics_->state();
    for (const BlockArray* array : {&state.q, &state.v, &state.a, &state.X}) {
      for (int i = 0; i < array->rows(); ++i) out.add((*array)(i, lane));
    }
    const SolverEffort effort = physics_->effort(lane);
    out.add(effort.sweeps), out.add(effort.residual), out.add(effort.braked);
    add_contacts(*physics_, lane, out);
    out.ends.push_back(out.bytes.size());
  }

  std::unique_ptr<BlockPhysics> physics_;
  Drive drive_;
  DriveResult result_;
  std::vector<std::pair<int, const Case*>> busy_;
  int ticks_ = 0;
};

Maker by_name(const std::string& back_end) {
  return [back_end](const Model& model) { return make_physics(back_end, model); };
}
Maker of_width(int width) {
  return [width](const Model& model) { return std::make_unique<LanePhysics>(model, width); };
}

/// Saves `one` after step k of its run in a block of `first`; runs on from there here and there.
void expect_goes_on(const Case& one, const Case& other, int k, const Maker& first, const Maker& second) {
  const Model& model = other.particle.model;  // any particle's will do
  Block whole(first, model);
  whole.physics().start(2, one.particle);
  whole.run(one, 2, 0, k);
  if (whole.physics().fault(2)) return;
  const std::shared_ptr<const SavedLane> saved = whole.physics().save(2);
  const Trace expected = whole.run(one, 2, k, one.steps);

  Block fresh(second, model);
  fresh.physics().restore(2, *saved);
  EXPECT_EQ(difference(expected, fresh.run(one, 2, k, one.steps)), "") << "in the same lane of a fresh block";

  Block used(second, model);
  for (const int lane : {0, 5, 6}) used.employ(lane, other);
  used.physics().start(1, one.particle);
  used.run(one, 1, 0, k / 2 + 3);
  for (int i = 0; i < 25; ++i) used.step(other, 0, i);
  used.dismiss(5);
  used.physics().restore(5, *saved);
  EXPECT_EQ(difference(expected, used.run(one, 5, k, one.steps)), "") << "where another was, in company";

  Case otherwise = one;
  for (auto& joint : otherwise.driver.joint) joint[3] = -joint[3];
  whole.physics().restore(2, *saved);
  whole.run(otherwise, 2, k, one.steps);
  whole.physics().restore(2, *saved);
  EXPECT_EQ(difference(expected, whole.run(one, 2, k, one.steps)), "") << "again, after another way on";

  // Saved anew where it was restored it is the same.
  used.physics().restore(7, *saved);
  fresh.physics().restore(0, *used.physics().save(7));
  EXPECT_EQ(difference(expected, fresh.run(one, 0, k, one.steps)), "") << "of what was restored";
}

/// How many steps to make of `all` if step k is what matters: under a sanitizer few after it, which touch all memory.
constexpr int steps_from(int k, int all) { return GRAZE_SANITIZED ? std::min(k + 30, all) : all; }

Case with_servos(const Particle& particle, int steps, bool torques_alone, std::uint64_t seed) {
  Dice dice(seed);
  Case out{particle, Driver(particle.model.na(), torques_alone, dice), steps};
  for (auto& joint : out.driver.joint) joint[2] = std::min(joint[2], 0.2);  // N m or N, that no joint is torn off
  return out;
}

Shape ramp_of_hills() {
  auto grid = std::make_shared<HeightGrid>();
  grid->nx = grid->ny = 17;
  for (int i = 0; i < 17 * 17; ++i) grid->height.push_back(0.02 * std::sin(0.9 * (i % 17)) + 0.01 * (i / 17 % 3));
  return {ShapeKind::heightfield, {2, 2, 1}, nullptr, grid};
}

/// LINKS beside a curb and a crate, its joints held by servos.
World walker(const std::string& model) { return busy_world(model); }

/// The same on hills.
World climber(const std::string& model) {
  World world = busy_world(model);
  world.objects[0] = fixed("ground", ramp_of_hills());
  return world;
}

/// A heap of hulls on a plane, with a box, a cylinder and a capsule among them.
World heap(const std::string& model) {
  Dice dice(7);
  World world;
  world.robot.links = {link("l0", random_mesh(dice), 0.5)};
  world.objects = {fixed("ground", plane()), fixed("wall", random_mesh(dice), at(0.1, 0.1, 0.02))};
  const Shape shapes[] = {random_mesh(dice), box(0.08, 0.1, 0.06), random_mesh(dice), cylinder(0.04, 0.1),
                          capsule(0.03, 0.1)};
  double z = 0.15;
  for (const Shape& shape : shapes) {
    world.objects.push_back(movable("thing" + std::to_string(world.objects.size()), shape, 0.3,
                                    at(0.02 * dice.unit(), 0.02 * dice.unit(), z, dice.turned())));
    z += 0.12;
  }
  world.initial.position = {0, 0, 0.06};
  world.contact.model = model;
  world.contact.friction = 0.6;
  world.contact.restitution = 0.2;
  return world;
}

/// A chain on the world that beats against its stops, damped and with dry friction, over a floor.
World flail(const std::string& model) {
  World world;
  world.robot.floating_base = false;
  world.robot.links = {link("l0", box(0.05, 0.05, 0.05), 1, at(0, 0, 0), false)};
  for (int i = 1; i < 5; ++i) {
    const std::string name = "l" + std::to_string(i), parent = "l" + std::to_string(i - 1);
    world.robot.links.push_back(link(name, capsule(0.02, 0.1), 0.2, at(0, 0, -0.06)));
    world.robot.joints.push_back(
        joint("j" + std::to_string(i), parent, name, i == 3 ? JointType::prismatic : JointType::revolute,
              at(0, 0, i == 1 ? 0 : -0.12), i % 2 ? Vec3::UnitY() : Vec3(1, 0, 1).normalized()));
    Joint& added = world.robot.joints.back();
    added.lower = i == 3 ? -0.03 : -0.3, added.upper = i == 3 ? 0.03 : 0.25;
    added.friction = 0.01 * i, added.damping = i == 2 ? 0.02 : 0;
    world.initial.joint_velocity[added.name] = i == 3 ? 1 : 6;
    if (i < 3) world.initial.joint_position[added.name] = 0.2;
    if (i == 4) added.mimic = {"j2", -0.5, 0.05};
  }
  world.objects = {fixed("ground", plane(), at(0, 0, -0.48))};
  world.contact.model = model;
  return world;
}

struct Place {
  std::string name;
  World (*make)(const std::string& model);
};

class SavedLanes : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Physics, SavedLanes, testing::ValuesIn(physics_names()));

TEST_P(SavedLanes, GoOnWithTheSameBits) {
  for (const Place& place : {Place{"walker", walker}, {"climber", climber}, {"heap", heap}, {"flail", flail}}) {
    for (const std::string& model : contact_models_of(GetParam())) {
      SCOPED_TRACE(place.name + ", " + model);
      const Particle particle = particle_of(place.make(model));
      World elsewhere = place.make(contact_models_of(GetParam()).back());
      elsewhere.initial.position.z() += 0.01;
      for (Link& one : elsewhere.robot.links) one.inertia = one.inertia.scaled(1.3);
      for (Object& one : elsewhere.objects) {
        if (one.shape.kind == ShapeKind::mesh) one.shape.size *= 1.1;
      }
      for (const bool torques_alone : {true, false}) {
        if (!torques_alone && (particle.model.na() == 0 || GetParam() != kDefaultPhysics)) continue;
        for (const int k : {1, 150}) {
          const int steps = steps_from(k, 400);
          const Case one = with_servos(particle, steps, torques_alone, 3);
          const Case other = with_servos(particle_of(elsewhere), steps, torques_alone, 4);
          expect_goes_on(one, other, k, by_name(GetParam()), by_name(GetParam()));
        }
      }
    }
  }
}

// The places are what they are said to be: in the middle there is contact, stops are met, servos reach their bounds.
TEST_P(SavedLanes, AreSavedInTheMiddleOfThings) {
  if (GRAZE_SANITIZED) GTEST_SKIP() << "about figures";
  for (const Place& place : {Place{"walker", walker}, {"climber", climber}, {"heap", heap}, {"flail", flail}}) {
    for (const std::string& model : contact_models_of(GetParam())) {
      const Case one = with_servos(particle_of(place.make(model)), 400, true, 3);
      Block block(by_name(GetParam()), one.particle.model);
      block.physics().start(0, one.particle);
      int touching = 0, at_stops = 0;
      for (int k = 0; k < one.steps; ++k) {
        block.step(one, 0, k);
        for (const Contact& contact : block.physics().contacts(0)) touching += contact.touching();
        for (const Body& body : one.particle.model.bodies) {
          if (body.type == JointType::floating) continue;
          const double q = block.physics().state().q(body.q, 0);
          at_stops += q < body.lower + 1e-3 || q > body.upper - 1e-3;
        }
      }
      EXPECT_EQ(block.physics().fault(0).value_or(""), "") << place.name << ", " << model;
      EXPECT_GT(touching, place.name == "flail" ? 0 : 300) << place.name << ", " << model;
      if (place.name == "flail") {
        EXPECT_GT(at_stops, 100) << model;
      }
    }
  }
}

// Random worlds: all shapes, terrain, servos that change sides, prescribed motion, particles that explode; in every
// third links begin in each other.
TEST_P(SavedLanes, OfRandomWorldsGoOnWithTheSameBits) {
  const bool lanes = GetParam() == kDefaultPhysics;
  const int worlds = trials(lanes ? 40 : 12);
  for (int seed = 300; seed < 300 + worlds; ++seed) {
    SCOPED_TRACE(fmt::format("world {}", seed));
    Dice dice(static_cast<std::uint64_t>(seed));
    const World world = seed % 3 == 0 ? tangled_world(dice) : random_world(dice);
    const bool torques_alone = dice.once_in(3);
    std::vector<Case> cases;
    for (int i = 0; i < 4; ++i) {
      Particle particle = random_particle(world, i, contact_models_of(GetParam()), dice);
      const int na = particle.model.na();
      cases.push_back({std::move(particle), Driver(na, torques_alone, dice), 60});
    }
    for (int i = 0; i < 4; ++i) {
      const int k = dice.below(50);
      expect_goes_on(cases[i], cases[3 - i], k, by_name(GetParam()), by_name(GetParam()));
    }
  }
}

TEST(SavedLane, FitsEveryWidth) {
  for (const std::string& model : lane_contact_models()) {
    for (const auto& place : {walker, heap}) {
      const Case one = with_servos(particle_of(place(model)), steps_from(120, 250), false, 3);
      expect_goes_on(one, one, 120, of_width(1), of_width(8));
      expect_goes_on(one, one, 120, of_width(8), of_width(1));
    }
  }
}

// A lane that ended as unphysical is one also where it is restored; the others there know nothing of it.
TEST_P(SavedLanes, KeepTheirFault) {
  Particle particle = particle_of(flail(contact_models_of(GetParam()).front()));
  const auto physics = make_physics(GetParam(), particle.model), second = make_physics(GetParam(), particle.model);
  physics->start(0, particle);
  BlockArray tau(particle.model.na());
  tau(0, 0) = std::numeric_limits<double>::quiet_NaN();
  physics->step(kStep, LaneMask::first(1), tau);
  ASSERT_TRUE(physics->fault(0));
  second->start(0, particle);
  second->restore(3, *physics->save(0));
  EXPECT_EQ(second->fault(3), physics->fault(0));
  EXPECT_FALSE(second->fault(0));
  second->start(3, particle);
  EXPECT_FALSE(second->fault(3));
}

// Contacts of a lane that is restored are shown at once; those of its neighbours stay.
TEST_P(SavedLanes, LeaveTheirNeighboursAlone) {
  const Case one = with_servos(particle_of(walker(contact_models_of(GetParam()).front())), 200, true, 3);
  Block block(by_name(GetParam()), one.particle.model);
  block.employ(1, one);
  block.employ(2, one);
  block.physics().start(0, one.particle);
  for (int k = 0; k < 200; ++k) block.step(one, 0, k);
  Trace before, after;
  add_contacts(block.physics(), 1, before);
  ASSERT_FALSE(before.bytes.empty());
  const auto saved = block.physics().save(2);
  block.physics().restore(0, *saved);
  block.physics().restore(4, *saved);
  add_contacts(block.physics(), 1, after);
  EXPECT_EQ(before.bytes, after.bytes);
  Trace first, second;
  add_contacts(block.physics(), 2, first);
  add_contacts(block.physics(), 4, second);
  EXPECT_EQ(first.bytes, second.bytes);
}

// The audit of Bullet's energy check goes with the lane: what was created before it was saved counts on.
TEST(SavedLane, OfBulletKeepsItsAudit) {
  const World body = free_body(box(0.1, 0.1, 0.1), 1.0);
  const Model model = compile(body);
  State state = particle_of(body).initial;
  const auto rise = [&](bullet::EnergyWatch& watch) {
    state.q[6] += 1e-3;
    return watch.check(bullet::Forest(model, state), {1e-3, 0, 0, 0});
  };
  bullet::EnergyWatch watch(model, bullet::Forest(model, state));
  for (int i = 0; i < 6; ++i) EXPECT_FALSE(rise(watch));
  bullet::EnergyWatch on(model, bullet::Forest(model, state));
  on.restore(watch.audit());
  int more = 0;
  while (more < 100 && !rise(on)) ++more;
  EXPECT_LE(more, 6) << "1 cm in all";
}

std::string refusal(BlockPhysics& physics, const SavedLane& saved) {
  try {
    physics.restore(0, saved);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "(not refused)";
}

TEST(SavedLane, OfOthersIsRefused) {
  const Particle particle = particle_of(flail("")), other = particle_of(walker(""));
  const auto lanes = make_physics("lanes", particle.model), bullet = make_physics("bullet", particle.model);
  lanes->start(0, particle);
  bullet->start(0, particle);
  EXPECT_THAT(refusal(*bullet, *lanes->save(0)), HasSubstr("'lanes' saved cannot be restored by 'bullet'"));
  EXPECT_THAT(refusal(*lanes, *bullet->save(0)), HasSubstr("'bullet' saved cannot be restored by 'lanes'"));
  EXPECT_THAT(refusal(*make_physics("lanes", other.model), *lanes->save(0)), HasSubstr("another model"));
  EXPECT_THAT(refusal(*make_physics("bullet", other.model), *bullet->save(0)), HasSubstr("another model"));
  World heavier = flail("");
  heavier.robot.links[2].inertia = heavier.robot.links[2].inertia.scaled(2);
  EXPECT_EQ(refusal(*make_physics("lanes", compile(heavier)), *lanes->save(0)), "(not refused)") << "a particle";
  Dice dice(1);
  World hull = free_body(random_mesh(dice), 1), another = free_body(random_mesh(dice), 1);
  const auto of_hull = make_physics("lanes", compile(hull));
  of_hull->start(0, particle_of(hull));
  EXPECT_THAT(refusal(*make_physics("lanes", compile(another)), *of_hull->save(0)), HasSubstr("meshes"));
  EXPECT_THROW(make_physics("bullet", particle.model)->save(1), std::invalid_argument);
}

}  // namespace
}  // namespace graze::test
