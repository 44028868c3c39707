// Claims: the margin of contact_impulse is the momentum that a contact exchanges, whatever the step, or its component
// along a direction, of one contact or of all; the margin of contact_force is that by the time it took, under both back
// ends.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/message_of.h"
#include "tests/scenarios/judged.h"

namespace graze {
namespace {

using testing::Judged;

/// A free body over a fixed thing.
World over(const Shape& body, double mass, const Shape& thing) {
  World world = test::free_body(body, mass);
  world.objects.push_back(test::fixed("thing", thing));
  world.gravity = Vec3::Zero();
  return world;
}

class Impulses : public ::testing::TestWithParam<const char*> {};

std::string impulse(const std::string& more) {
  return "{contact_impulse: {between: [body, thing], below: 10" + more + "}}";
}

TEST_P(Impulses, ImpulsesAreMomenta) {
  const double m = 2, g = test::kGravity, v = 1.5;
  for (const double h : {1e-3, 2.5e-4}) {
    World world = over(test::sphere(0.05), 1, test::plane());
    world.robot.links[0] = test::link("body", test::sphere(0.05), m);
    world.initial.position = {0, 0, 0.0513};
    world.initial.linear_velocity = {0, 0, -v};
    Judged stops(GetParam(), world, impulse(""));
    EXPECT_EQ(stops.margin(), 10);
    stops.run(0.1, h);
    EXPECT_NEAR(10 - stops.margin(), m * v, 1e-3 * m * v) << "it stops, " << h;

    world.contact.restitution = 0.5;
    Judged bounces(GetParam(), world, impulse(""));
    bounces.run(0.1, h);
    EXPECT_NEAR(10 - bounces.margin(), 1.5 * m * v, 2e-3 * m * v) << "it bounces, " << h;

    world.contact.restitution = 0;
    world.gravity = {0, 0, -g};
    world.initial.position = {0, 0, 0.05};
    world.initial.linear_velocity = Vec3::Zero();
    Judged rests(GetParam(), world, impulse("")), begins(GetParam(), world, impulse(", during: 10.1 ms"));
    rests.run(0.2, h);
    begins.run(0.2, h);
    EXPECT_NEAR(10 - rests.margin(), m * g * 0.2, 2 * m * g * h) << "it rests, " << h;
    EXPECT_NEAR(10 - begins.margin(), m * g * 0.0101, m * g * h) << "of the first 10.1 ms, " << h;
  }
}

// Falls on a plane with 1 m/s, twice: the larger impulse counts, not the sum.
TEST_P(Impulses, EachContactCountsForItself) {
  const double m = 1, g = test::kGravity;
  World world = over(test::sphere(0.05), 1, test::plane());
  world.contact.restitution = 0.6;
  world.gravity = {0, 0, -g};
  world.initial.position = {0, 0, 0.05 + 0.5 / g};  // 1 m/s at the plane
  Judged judged(GetParam(), world, impulse(""));
  judged.run(0.28, 2.5e-4);  // lands at 0.102 s and at 0.224 s
  EXPECT_NEAR(10 - judged.margin(), 1.6 * m, 0.01);
}

// Two falls count together under `total`, and only those within the window; `during` takes the blow of each.
TEST_P(Impulses, TotalIsOfAllContacts) {
  const double m = 1, g = test::kGravity;
  World world = over(test::sphere(0.05), m, test::plane());
  world.contact.restitution = 0.6;
  world.gravity = {0, 0, -g};
  world.initial.position = {0, 0, 0.05 + 0.5 / g};  // 1 m/s at the plane, at 0.102 s; 0.6 m/s at 0.224 s
  const std::string within = "{contact_impulse: {between: [body, thing], below: 10, total: true}, window: [0.15, 1]}";
  Judged all(GetParam(), world, impulse(", total: true")), late(GetParam(), world, within);
  Judged blows(GetParam(), world, impulse(", total: true, during: 5 ms"));
  for (Judged* one : {&all, &late, &blows}) one->run(0.28, 2.5e-4);
  EXPECT_NEAR(10 - all.margin(), 1.6 * m * 1.6, 0.02);
  EXPECT_NEAR(10 - blows.margin(), 1.6 * m * 1.6, 0.02);
  EXPECT_NEAR(10 - late.margin(), 1.6 * m * 0.6, 0.02) << "the second fall alone";
}

/// A box that slides along x on a plane, as long as 1 m/s lasts.
World sliding(double mu) {
  World world = over(test::box(0.2, 0.2, 0.02), 2, test::plane());
  world.gravity = {0, 0, -test::kGravity};
  world.contact.friction = mu;
  world.initial.position = {0, 0, 0.01};
  world.initial.linear_velocity = {1, 0, 0};
  return world;
}

// Friction brakes the box by mu m g: along x it is pushed backwards, and pushes the ground forwards.
TEST_P(Impulses, DirectionTakesTheComponent) {
  const double m = 2, mu = 0.3, weight = m * test::kGravity, h = 5e-4, t = 0.1;
  const World world = sliding(mu);
  const auto exchanged = [&](const std::string& between, const std::string& direction) {
    Judged judged(
        GetParam(), world,
        "{contact_impulse: {between: " + between + ", below: 10, total: true, direction: " + direction + "}}");
    judged.run(t, h);
    return 10 - judged.present();
  };
  const double tolerance = 0.03 * weight * t;  // of the first steps, in which the box tips onto its front corners
  EXPECT_NEAR(exchanged("[body, thing]", "[0, 0, 3]"), weight * t, tolerance);
  EXPECT_NEAR(exchanged("[body, thing]", "[-1, 0, 0]"), mu * weight * t, mu * tolerance);
  EXPECT_NEAR(exchanged("[body, thing]", "[1, 0, 0]"), -mu * weight * t, mu * tolerance) << "it has a sign";
  EXPECT_NEAR(exchanged("[thing, body]", "[1, 0, 0]"), mu * weight * t, mu * tolerance) << "on the first-named part";
  EXPECT_NEAR(exchanged("[body, thing]", "[0, 1, 0]"), 0, mu * tolerance);
}

// How hard a ball strikes a curb from the side grades the approach: m (v_y) and no more, whatever it weighs on.
TEST_P(Impulses, TellHardFromSoftStrikes) {
  const auto margin = [&](double speed, const std::string& more) {
    World world = over(test::sphere(0.01), 0.05, test::box(1, 0.1, 0.03));
    world.initial.position = {0, -0.07, 0};
    world.initial.linear_velocity = {0.1, speed, 0};
    Judged judged(GetParam(), world,
                  "{contact_impulse: {between: [body, \"thing.{side,edge}\"], below: 20 mN s" + more + "}}");
    judged.run(0.1, 5e-4);
    return judged.margin();
  };
  for (const std::string more : {"", ", direction: [0, -1, 0]", ", during: 2 ms"}) {
    EXPECT_NEAR(margin(0.3, more), 0.005, 1e-4) << "15 mN s" << more;
    EXPECT_NEAR(margin(0.6, more), -0.01, 1e-4) << "30 mN s" << more;
  }
}

std::string force(const std::string& more) { return "{contact_force: {between: [body, thing], " + more + "}}"; }

// At rest it is the weight, also of a box on four corners; what is braked is pushed by mu m g.
TEST_P(Impulses, ForcesAtRestAreWeights) {
  const double m = 2, mu = 0.3, weight = m * test::kGravity;
  World world = sliding(mu);
  world.initial.linear_velocity = Vec3::Zero();
  for (const std::string over : {"", ", over: 20 ms", ", over: 10.3 ms", ", over: 1 us"}) {
    Judged below(GetParam(), world, force("below: 30" + over)), above(GetParam(), world, force("above: 10" + over));
    Judged both(GetParam(), world, force("above: 10, below: 25" + over));
    for (Judged* one : {&below, &above, &both}) one->run(0.2, 1e-3);
    EXPECT_NEAR(30 - below.present(), weight, 1e-3 * weight) << over;
    EXPECT_NEAR(10 + above.present(), weight, 1e-3 * weight) << over;
    EXPECT_NEAR(25 - both.present(), weight, 1e-3 * weight) << over;
    EXPECT_EQ(above.margin(), -10) << "nothing has pressed before the first step";
  }
  Judged late(GetParam(), world, "{contact_force: {between: [body, thing], above: 10}, window: [10 ms, 1]}");
  late.run(0.2, 1e-3);
  EXPECT_NEAR(10 + late.margin(), weight, 0.02 * weight);
  Judged braked(GetParam(), sliding(mu), force("below: 10, over: 20 ms, direction: [-1, 0, 0]"));
  braked.run(0.1, 5e-4);
  EXPECT_NEAR(10 - braked.present(), mu * weight, 0.03 * mu * weight);
}

// The mean over 20 ms of a blow is m v / 20 ms for every step; over one step it is m v / h.
TEST_P(Impulses, ForcesOverATimeDoNotDependOnTheStep) {
  const double m = 2, v = 1.5;
  for (const double h : {1e-3, 2.5e-4}) {
    World world = over(test::sphere(0.05), m, test::plane());
    world.initial.position = {0, 0, 0.0513};
    world.initial.position.z() += 0.05;  // not within the first 20 ms
    world.initial.linear_velocity = {0, 0, -v};
    Judged mean(GetParam(), world, force("below: 1000, over: 20 ms")), peak(GetParam(), world, force("below: 1 N"));
    mean.run(0.1, h);
    peak.run(0.1, h);
    EXPECT_NEAR(1000 - mean.margin(), m * v / 0.02, 2e-3 * m * v / 0.02) << h;
    EXPECT_EQ(mean.present(), 1000) << "it is over, to the bit";
    EXPECT_GT(1 - peak.margin(), 0.4 * m * v / h) << "of at most two steps";
  }
}

// Of several pairs that press the sum counts, and the one that presses hardest is named.
TEST_P(Impulses, ForcesOfAllPairsAddUp) {
  World world = over(test::box(0.4, 0.1, 0.1), 3, test::box(0.1, 0.2, 0.1));
  world.objects[0].X_WO = test::at(-0.15, 0, 0);
  world.objects.push_back(test::fixed("post", test::box(0.1, 0.2, 0.1), test::at(0.05, 0, 0)));
  world.gravity = {0, 0, -test::kGravity};
  world.initial.position = {0, 0, 0.1};  // its middle is nearer to the post
  Judged held(GetParam(), world, "{contact_force: {between: [body, \"{thing,post}\"], below: 10, over: 20 ms}}");
  held.run(0.3, 1e-3);
  EXPECT_NEAR(10 - held.present(), 3 * test::kGravity, 0.02 * 3 * test::kGravity);
  EXPECT_EQ(held.culprit(), "body+post");
}

INSTANTIATE_TEST_SUITE_P(BackEnds, Impulses, ::testing::Values("lanes", "bullet"));

// A trace may begin at any time: what was before it is no time in which nothing pressed.
TEST(ImpulseMemories, BeginWithTheTrace) {
  World world = over(test::sphere(0.05), 1, test::plane());
  world.gravity = {0, 0, -test::kGravity};
  world.initial.position = {0, 0, 0.05};
  test::Bench bench("lanes", world);
  const Task task = read_task(
      Settings::parse("requirements:\n"
                      "  a: {contact_force: {between: [body, thing], below: 10, over: 20 ms}}\n"
                      "  b: {contact_impulse: {between: [thing, body], below: 10, during: 1.2 ms, total: true}}\n",
                      "task.yaml"),
      bench.model());
  TaskMonitor from_0(task), from_1(task);
  const BlockArray tau(0);
  for (int k = 0; k <= 10; ++k) {
    if (k > 0) bench.step(5e-4);
    for (const auto& [monitor, begin] : {std::pair{&from_0, 0.0}, {&from_1, 1.0}}) {
      if (k == 0) monitor->start(0, bench.model());
      std::array<double, kLanes> times{};
      times[0] = begin + 5e-4 * k;
      monitor->update({bench.physics().state(), bench.physics().contact_points(), tau, tau, times, LaneMask(1)});
    }
  }
  const std::vector<double> early = from_0.margins(0), late = from_1.margins(0);
  EXPECT_NEAR(10 - early[0], test::kGravity, 1e-2 * test::kGravity) << "over what there has been";
  EXPECT_NEAR(10 - early[1], 1.2e-3 * test::kGravity, 1e-2 * 1.2e-3 * test::kGravity);
  for (int r = 0; r < 2; ++r) EXPECT_NEAR(late[r], early[r], 1e-9) << r;
}

// A judgement that is written down in the middle and read into a fresh monitor goes on to the same bits, in another
// block.
TEST(ImpulseMemories, AreCarried) {
  World world = over(test::sphere(0.05), 1, test::plane());
  world.contact.restitution = 0.6;
  world.gravity = {0, 0, -test::kGravity};
  world.initial.position = {0, 0, 0.05 + 0.5 / test::kGravity};
  test::Bench bench("lanes", world);
  const Task task =
      read_task(Settings::parse("requirements:\n"
                                "  a: {contact_impulse: {between: [body, thing], below: 10, total: true}}\n"
                                "  b: {contact_impulse: {between: [thing, body], below: 10, direction: [0, 0, -1]}}\n"
                                "  c: {contact_force: {between: [body, thing], below: 999, over: 33.3 ms}}\n"
                                "  d: {contact_force: {between: [body, thing], above: 1}}\n",
                                "task.yaml"),
                bench.model());
  TaskMonitor whole(task), first(task), second(task);
  for (TaskMonitor* one : {&whole, &first, &second}) one->start(0, bench.model());
  const BlockArray tau(0);
  double time = 0;
  const auto step = [&](TaskMonitor& other) {
    bench.step(5e-4);
    time += 5e-4;
    std::array<double, kLanes> times{};
    times[0] = time;
    for (TaskMonitor* one : {&whole, &other}) {
      one->update({bench.physics().state(), bench.physics().contact_points(), tau, tau, times, LaneMask(1)});
    }
  };
  for (int i = 0; i < 230; ++i) step(first);  // within 33 ms of the first fall
  LaneTape tape;
  first.carry(0, tape);
  const LaneTape::Content written = tape.take();
  LaneTape reads(written);
  second.carry(0, reads);
  reads.end();
  for (int i = 0; i < 330; ++i) step(second);
  EXPECT_EQ(second.margins(0), whole.margins(0));
  EXPECT_LT(whole.margins(0)[0], 10 - 2);
  EXPECT_LT(whole.margins(0)[1], 10 - 1);
  EXPECT_LT(whole.margins(0)[2], 999 - 40);
}

// What is wrong is told with the right answer.
TEST(ImpulseKeys, AreChecked) {
  const Model model = compile(over(test::sphere(0.05), 1, test::plane()));
  const auto refused = [&](const std::string& witness) {
    return testing::message_of(
        [&] { read_task(Settings::parse("requirements: {r: " + witness + "}", "task.yaml"), model); });
  };
  using ::testing::EndsWith;
  EXPECT_THAT(refused(impulse(", direction: [0, 0, 0]")), EndsWith("[0, 0, 0]: has no direction; along y: [0, 1, 0]"));
  EXPECT_THAT(refused(force("over: 1 ms")), EndsWith("needs 'above', 'below' or both"));
  EXPECT_THAT(refused(force("above: 5, below: 2")), EndsWith("above 5 N lies over below 2 N: nothing is between"));
  EXPECT_THAT(refused(force("below: -2")),
              ::testing::HasSubstr("every trace would violate it: parts press on each other"));
  EXPECT_EQ(refused(force("below: -2, direction: [1, 0, 0]")), "(accepted)");
}

}  // namespace
}  // namespace graze
