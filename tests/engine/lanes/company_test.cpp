// Claim: whatever a particle goes through, exploding included, it goes through it alone: every bit of its state, its
// contacts, its events, the solver's effort and the reason why its trace ends are the same alone, in company, in any
// lane, in lanes that were refilled, and on every instruction set.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <numeric>

#include "engine/contact/events.h"
#include "engine/lane_physics/lane_physics.h"
#include "engine/lanes/isa.h"
#include "tests/engine/lanes/random_worlds.h"
#include "tests/sanitized.h"

namespace graze::test {
namespace {

struct Subject {
  Particle particle;
  Driver driver;
  int steps;  // after which its trace ends, if it lasts
};

/// A block that runs subjects, each in the lane that asks for it, until all traces have ended.
class Company {
 public:
  Company(const std::string& back_end, const std::vector<Subject>& subjects)
      : subjects_(subjects),
        physics_(make_physics(back_end, subjects.front().particle.model)),
        events_(subjects.front().particle.model),
        tau_(na()),
        drive_(na()),
        result_(na()) {}

  /// `order`: which subjects, in the order of their start; the first begin in `lanes`, the others where one ends.
  std::map<int, Trace> run(const std::vector<int>& order, const std::vector<int>& lanes) {
    std::map<int, Trace> traces;
    std::size_t next = 0;
    const auto refill = [&](int lane) {
      if (next == order.size()) return;
      start(lane, order[next++]);
    };
    for (const int lane : lanes) refill(lane);
    while (active_.any()) {
      step();
      const LaneMask looked = active_;
      for (const int lane : lanes) {
        if (looked[lane]) look(lane, traces[at_[lane]]);
      }
      for (const int lane : lanes) {
        if (!looked[lane] || (!physics_->fault(lane) && done_[lane] < subjects_[at_[lane]].steps)) continue;
        finish(lane, traces[at_[lane]]);
        refill(lane);
      }
    }
    return traces;
  }

 private:
  int na() const { return subjects_.front().particle.model.na(); }

  void start(int lane, int subject) {
    physics_->start(lane, subjects_[subject].particle);
    events_.start(lane, subjects_[subject].particle.model);
    at_[lane] = subject, done_[lane] = 0;
    active_.set(lane);
  }

  void step() {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (active_[lane]) subjects_[at_[lane]].driver.fill(done_[lane]++, lane, drive_);
    }
    if (subjects_.front().driver.torques_alone || !physics_->solves_drives()) {
      physics_->step(kStep, active_, drive_.tau);
    } else {
      physics_->drive(kStep, active_, drive_, result_);
    }
    std::array<double, kLanes> times;
    for (int lane = 0; lane < kLanes; ++lane) times[lane] = done_[lane] * kStep;
    events_.update(times, physics_->contact_points(), physics_->state(), active_);
  }

  void look(int lane, Trace& out) const {
    const BlockState& state = physics_->state();
    for (const BlockArray* array : {&state.q, &state.v, &state.a, &state.X, &result_.torque, &result_.demand}) {
      for (int i = 0; i < array->rows(); ++i) out.add((*array)(i, lane));
    }
    const SolverEffort effort = physics_->effort(lane);
    out.add(effort.sweeps), out.add(effort.residual), out.add(effort.braked);
    add_contacts(*physics_, lane, out);
    out.ends.push_back(out.bytes.size());
  }

  void finish(int lane, Trace& out) {
    for (const Event& event : events_.take(lane)) {
      for (double x : {event.time, double(event.kind), double(event.a), double(event.b), double(event.feature_a),
                       double(event.feature_b), event.impulse}) {
        out.add(x);
      }
      out.add(event.p_W);
    }
    out.fault = physics_->fault(lane).value_or("");
    for (int k = 0; k < na(); ++k) result_.torque(k, lane) = result_.demand(k, lane) = 0;
    active_.set(lane, false);
  }

  const std::vector<Subject>& subjects_;
  std::unique_ptr<BlockPhysics> physics_;
  EventTracker events_;
  BlockArray tau_;
  Drive drive_;
  DriveResult result_;
  LaneMask active_;
  std::array<int, kLanes> at_{}, done_{};
};

/// Particles of one random world, alone and then in companies.
class Comparison {
 public:
  Comparison(std::string back_end, std::uint64_t seed, double speed = 1, bool torques_alone = false,
             bool tangled = false)
      : back_end_(std::move(back_end)),
        seed_(seed),
        subjects_(random_subjects(speed, torques_alone, tangled)),
        all_(subjects_.size()) {
    std::iota(all_.begin(), all_.end(), 0);
    for (const int i : all_) alone_[i] = Company(back_end_, subjects_).run({i}, {0}).at(i);
  }

  void expect_same_in_company() const {
    expect_same({0, 1}, {0, 1});
    expect_same({2, 0, 1}, {7, 3, 4});
    expect_same(all_, {0, 1, 2, 3, 4, 5, 6, 7});
    expect_same({all_.rbegin(), all_.rend()}, {5, 2, 0});
  }

  /// `order`: who, in the order of their start.
  void expect_same(const std::vector<int>& order, const std::vector<int>& lanes) const {
    for (const auto& [i, trace] : Company(back_end_, subjects_).run(order, lanes)) {
      const std::string found = difference(alone_.at(i), trace);
      EXPECT_EQ(found, "") << fmt::format("world {}, particle {}, {} lanes", seed_, i, lanes.size());
    }
  }

  const std::vector<int>& all() const { return all_; }
  const std::vector<Subject>& subjects() const { return subjects_; }
  int ended() const {
    return std::count_if(alone_.begin(), alone_.end(), [](const auto& one) { return !one.second.fault.empty(); });
  }
  int traces() const { return static_cast<int>(alone_.size()); }

 private:
  /// `speed`: factor of all initial speeds. `torques_alone`: no drives, whatever the dice say.
  std::vector<Subject> random_subjects(double speed, bool torques_alone, bool tangled) const {
    constexpr int kCount = 12, kSteps = 60;
    Dice dice(seed_);
    const World world = tangled ? tangled_world(dice) : random_world(dice);
    const bool alone = dice.once_in(3) || torques_alone;
    std::vector<Subject> out;
    for (int i = 0; i < kCount; ++i) {
      Particle particle = random_particle(world, i, contact_models_of(back_end_), dice);
      particle.initial.v *= speed;
      if (back_end_ == "lanes" && i % 3 == 2) add_rotors(particle.model);
      const int na = particle.model.na();
      out.push_back({std::move(particle), Driver(na, alone, dice), kSteps / 2 + dice.below(kSteps)});
    }
    return out;
  }

  /// Drives with rotors, by dice of their own, so that all else stays as it is.
  void add_rotors(Model& model) const {
    Dice dice(seed_ + 1);
    for (const int body : model.actuated) model.bodies[body].armature = dice.decades(1e-4, 1);
  }

  std::string back_end_;
  std::uint64_t seed_;
  std::vector<Subject> subjects_;
  std::vector<int> all_;
  std::map<int, Trace> alone_;
};

/// `few` (the first of them under a sanitizer), and under GRAZE_LONG `many` more from 1000 on.
std::vector<std::uint64_t> worlds(std::vector<std::uint64_t> few, std::uint64_t many) {
  for (std::uint64_t i = 0; std::getenv("GRAZE_LONG") && i < many; ++i) few.push_back(1000 + i);
  few.resize(static_cast<std::size_t>(trials(static_cast<int>(few.size()))));
  return few;
}

struct Fates {
  int ended = 0, traces = 0;

  void add(const Comparison& comparison) { ended += comparison.ended(), traces += comparison.traces(); }
  /// Some explode and some last.
  void expect_mixed() const {
    if (GRAZE_SANITIZED) return;  // too few to tell
    EXPECT_GT(ended, traces / 20);
    EXPECT_LT(ended, traces / 2);
  }
};

// These worlds hold bounded servos that change sides several times in a step, beside others that do so more often.
TEST(Company, BitsDependOnTheParticleAlone) {
  Fates fates;
  for (const std::uint64_t seed : worlds({31, 32, 34, 58, 86, 122, 141}, 2000)) {
    const Comparison comparison("lanes", seed);
    comparison.expect_same_in_company();
    fates.add(comparison);
  }
  fates.expect_mixed();
}

// These hold shapes that are near only by a neighbour's bounds.
TEST(Company, BitsUnderTorquesDependOnTheParticleAlone) {
  Fates fates;
  for (const std::uint64_t seed : worlds({1195, 1273, 1276, 1281, 1289}, 1000)) {
    const Comparison comparison("lanes", seed, 1, true);
    comparison.expect_same_in_company();
    fates.add(comparison);
  }
  fates.expect_mixed();
}

// Speeds of 1e155 m/s: energies beyond the range of a double.
TEST(Company, NumbersOutOfRangeHaveBitsOfTheirOwn) {
  for (const std::uint64_t seed : worlds({31, 79, 82}, 500)) {
    const Comparison comparison("lanes", seed, 1e155);
    comparison.expect_same_in_company();
    EXPECT_GT(comparison.ended(), 0);
  }
}

TEST(Company, EveryInstructionSetGivesTheSameBits) {
  const char* before = std::getenv("GRAZE_ISA");
  const std::string chosen = before ? before : "";
  for (const std::uint64_t seed : worlds({34, 79, 82}, 200)) {
    for (const double speed : {1.0, 1e155}) {
      const Comparison comparison("lanes", seed, speed);
      for (const Isa isa : available_isas()) {
        SCOPED_TRACE(isa_name(isa));
        setenv("GRAZE_ISA", isa_name(isa).c_str(), 1);
        comparison.expect_same(comparison.all(), {0, 1, 2, 3, 4, 5, 6, 7});
      }
      chosen.empty() ? unsetenv("GRAZE_ISA") : setenv("GRAZE_ISA", chosen.c_str(), 1);
    }
  }
}

TEST(Company, BulletsBitsDependOnTheParticleAlone) {
  for (const std::uint64_t seed : worlds({31, 58}, 200)) Comparison("bullet", seed).expect_same_in_company();
}

/// In how many of the particles some links of the robot begin in each other, by more than a millimetre.
int tangled(const std::vector<Subject>& subjects) {
  int out = 0;
  for (const Subject& subject : subjects) {
    Bench run("lanes", subject.particle);
    run.step(1e-9);
    const Model& model = run.model();
    const auto deep = [&](const Contact& c) {
      return c.phi < -1e-3 && !model.colliders[c.a].is_object && !model.colliders[c.b].is_object;
    };
    const std::vector<Contact> contacts = run.contacts();
    out += std::any_of(contacts.begin(), contacts.end(), deep);
  }
  return out;
}

// Links that begin in each other are pushed apart by a solve of their own, in some lanes while others need none.
TEST(Company, BitsOfPushedOutOverlapsDependOnTheParticleAlone) {
  int overlapping = 0, all = 0;
  for (const std::uint64_t seed : worlds({501, 502, 503, 504, 505, 506}, 1000)) {
    const Comparison comparison("lanes", seed, seed % 2 == 0 ? 1e-3 : 1, false, true);
    comparison.expect_same_in_company();
    overlapping += tangled(comparison.subjects());
    all += comparison.traces();
  }
  EXPECT_GT(overlapping, all / 3);
  if (!GRAZE_SANITIZED) {  // which look at the first worlds only
    EXPECT_LT(overlapping, all);
  }
}

/// States of a particle in its steps, as bytes. `measure_all`: every pair, in every step.
std::string states(const Particle& particle, bool measure_all) {
  const Model& model = particle.model;
  BlockState state{BlockArray(model.nq), BlockArray(model.nv), BlockArray(model.nv),
                   BlockArray(12 * static_cast<int>(model.bodies.size()))};
  LaneEngine engine(model, kernel_of(chosen_isa()), {state.q.row(0), state.v.row(0), state.a.row(0), state.X.row(0)});
  engine.start(0, model, particle.initial);
  const BlockArray tau(model.na() + 1);
  std::string out;
  for (int k = 0; k < 60 && engine.suspect() == 0; ++k) {
    if (measure_all) engine.forget_distances(0);
    engine.step(kStep, 1, tau.row(0));
    for (const BlockArray* array : {&state.q, &state.v}) {
      for (int i = 0; i < array->rows(); ++i) out.append(reinterpret_cast<const char*>(array->row(i)), sizeof(double));
    }
  }
  return out;
}

// A pair that is not looked at cannot touch, however its links fly about.
TEST(Company, WhatIsNotMeasuredCannotTouch) {
  for (const std::uint64_t seed : worlds({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}, 2000)) {
    Dice dice(seed);
    const World world = seed % 4 == 0 ? tangled_world(dice) : random_world(dice);
    for (int i = 0; i < 4; ++i) {
      const Particle particle = random_particle(world, i, lane_contact_models(), dice);
      EXPECT_EQ(states(particle, true), states(particle, false)) << "world " << seed << ", particle " << i;
    }
  }
}

}  // namespace
}  // namespace graze::test
