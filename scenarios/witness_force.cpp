// How hard parts press on each other: the impulses of all contacts between them over some time, divided by that time,
// N. Over one step it is what the solver did in that step, and the peak of an impact of rigid bodies is then m v / h:
// as large as the step is short. Over a time of the user's it is the same for every step.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "engine/contact/pair_list.h"
#include "sampling/constants.h"
#include "scenarios/impulse_part.h"
#include "scenarios/witnesses.h"

namespace graze {
namespace {

/// What two colliders exchanged in one step of a lane.
struct StepImpulse {
  int a = 0, b = 0;
  double begin = 0, end = 0;  // s, of the step
  double impulse = 0;         // N s
};

/// The impulses of the last while, a lane each, so that a lane's sums do not depend on its neighbours.
struct ForceMemory final : WitnessMemory {
  struct Pair {
    int a = 0, b = 0;
    double impulse = 0;  // N s, of the steps that are kept
    int steps = 0;       // how many of them
  };
  struct Lane {
    std::deque<StepImpulse> steps;  // oldest first, in each step by a, then b
    std::vector<Pair> pairs;        // of those, by a, then b
    double begin = kNaN;            // s: of the trace; NaN: nothing was seen of it
    double time = 0, step = 0;      // s: of the last step, its length
  };
  std::array<Lane, kLanes> lanes;

  void start(int lane, const Model&) override { lanes[lane] = Lane{}; }

  void carry(int lane, LaneTape& tape) override {
    Lane& own = lanes[lane];
    carry_count(own.steps, tape);
    for (StepImpulse& one : own.steps) {
      tape.carry(one.a), tape.carry(one.b), tape.carry(one.begin), tape.carry(one.end), tape.carry(one.impulse);
    }
    carry_count(own.pairs, tape);
    for (Pair& one : own.pairs) {
      tape.carry(one.a), tape.carry(one.b), tape.carry(one.impulse), tape.carry(one.steps);
    }
    tape.carry(own.begin), tape.carry(own.time), tape.carry(own.step);
  }

 private:
  template <class Items>
  static void carry_count(Items& items, LaneTape& tape) {
    std::size_t count = items.size();
    tape.carry(count);
    for (items.resize(tape.reads() ? 0 : count); items.size() < count;) items.emplace_back();
  }
};

class ContactForce final : public Witness {
 public:
  ContactForce(Between between, ImpulsePart counted, double above, double below, double over)
      : between_(std::move(between)), counted_(std::move(counted)), above_(above), below_(below), over_(over) {}

  std::unique_ptr<WitnessMemory> remember() const override { return std::make_unique<ForceMemory>(); }
  PartKind parts() const override { return between_.parts(); }

  void follow(const WitnessInput& in) const override {
    ForceMemory& memory = *static_cast<ForceMemory*>(in.memory);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!in.lanes[lane]) continue;
      ForceMemory::Lane& own = memory.lanes[lane];
      if (std::isnan(own.begin)) own.begin = own.time = in.time[lane];
      own.step = in.time[lane] - own.time;
      own.time = in.time[lane];
      forget(own);
    }
    for (const ContactPoint& point : in.points) take(point, in.lanes.bits(), memory);
  }

  void evaluate(const WitnessInput& in, const BlockArray&, double* out, double* part) const override {
    const ForceMemory& memory = *static_cast<ForceMemory*>(in.memory);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!in.lanes[lane]) continue;
      const Force now = force(memory.lanes[lane]);
      out[lane] = std::min(below_ - now.newtons, now.newtons - above_);
      part[lane] = now.part;
    }
  }

 private:
  struct Force {
    double newtons = 0, part = kNoPart;
  };

  /// The time that is averaged over: no less than a step, and no more than there has been.
  double time_of(const ForceMemory::Lane& lane) const {
    return std::min(std::max(over_, lane.step), lane.time - lane.begin);
  }

  /// Drops what ended before the time that is averaged over.
  void forget(ForceMemory::Lane& lane) const {
    const double from = lane.time - time_of(lane);
    while (!lane.steps.empty() && lane.steps.front().end <= from) {
      const StepImpulse& oldest = lane.steps.front();
      ForceMemory::Pair& pair = entry_of_pair(lane.pairs, oldest.a, oldest.b);
      pair.impulse -= oldest.impulse;
      if (--pair.steps == 0) pair.impulse = 0;  // and not what rounding left
      lane.steps.pop_front();
    }
  }

  void take(const ContactPoint& point, unsigned lanes, ForceMemory& memory) const {
    const unsigned between = between_(point) & lanes;
    if (between == 0) return;  // most are not
    const unsigned touching = between & point.touching().bits();
    if (touching == 0) return;
    const unsigned first_is_a = counted_.is_normal() ? 0 : between_.first_is_a(point);
    for (int lane = 0; lane < kLanes; ++lane) {
      ForceMemory::Lane& own = memory.lanes[lane];
      if (!(touching >> lane & 1u) || !(own.step > 0)) continue;
      const double impulse = counted_(point, first_is_a, lane);
      ForceMemory::Pair& pair = entry_of_pair(own.pairs, point.a, point.b);
      own.steps.push_back({point.a, point.b, own.time - own.step, own.time, impulse});
      pair.impulse += impulse;
      ++pair.steps;
    }
  }

  /// The sum of all pairs, and the pair that presses hardest.
  Force force(const ForceMemory::Lane& lane) const {
    const double time = time_of(lane), from = lane.time - time;
    Force out;
    if (!(time > 0)) return out;  // nothing has been yet
    double hardest = 0;
    for (const ForceMemory::Pair& pair : lane.pairs) {
      const double impulse = pair.impulse - before(lane, pair, from);
      out.newtons += impulse / time;
      if (impulse > hardest) hardest = impulse, out.part = between_.part_of(pair.a, pair.b);
    }
    return out;
  }

  /// N s of a pair in the part before `from` of the one step that is kept and began earlier.
  static double before(const ForceMemory::Lane& lane, const ForceMemory::Pair& pair, double from) {
    double out = 0;
    for (const StepImpulse& one : lane.steps) {
      if (one.begin >= from) break;
      if (one.a == pair.a && one.b == pair.b) out += one.impulse * (from - one.begin) / (one.end - one.begin);
    }
    return out;
  }

  Between between_;
  ImpulsePart counted_;
  double above_, below_;  // N
  double over_;           // s; 0: a step
};

/// A normal force is no less than 0.
WitnessRange range_of(const ImpulsePart& counted, double above, double below) {
  const double middle = 0.5 * (below - above);
  if (!counted.is_normal()) return {-kInfinity, middle, "", false};
  return {below == kInfinity ? -above : -kInfinity, std::min(below, middle),
          "parts press on each other with 0 N or more", false};
}

ReadWitness read_contact_force(const Described& own, const Model& nominal) {
  Between between = read_between(own.at("between"), nominal);
  ImpulsePart counted(own);
  const auto above = own.find_number("above"), below = own.find_number("below"), over = own.find_number("over");
  if (!above && !below) own.settings().fail("needs 'above', 'below' or both");
  const double least = above.value_or(-kInfinity), most = below.value_or(kInfinity);
  if (least >= most) {
    own.settings().fail(fmt::format("above {:g} N lies {} below {:g} N: nothing is between", least,
                                    least > most ? "over" : "at", most));
  }
  std::string text = fmt::format("force between {}{}", between.text, counted.text());
  if (above) text += fmt::format(" above {:g} N", least);
  if (below) text += fmt::format("{} below {:g} N", above ? " and" : "", most);
  if (over) text += fmt::format(" over {:g} s", *over);
  const WitnessRange range = range_of(counted, least, most);
  return {std::make_shared<ContactForce>(std::move(between), std::move(counted), least, most, over.value_or(0)), text,
          "N", range, std::min(most, -least)};
}

}  // namespace

std::vector<WitnessKind> force_witnesses() {
  return {
      {"contact_force",
       {"the force between two parts stays above or below a bound",
        {{"between", {Form::texts(2, "PART")}, Default::required(), "globs of parts; `curb.side` names a feature"},
         {"above", {Form::number(Quantity::force)}, {}, "the lower bound; at least one of the two"},
         {"below", {Form::number(Quantity::force)}, {}, "the upper bound"},
         {"over",
          {Form::number(Quantity::time, Bound::positive)},
          Default::words("one step"),
          "the time that it is averaged over; the peak of an impact depends on the step otherwise"},
         ImpulsePart::key()},
        {},
        {},
        "It is the sum over all contacts of such parts, averaged over the last of the time, and 0 before the first "
        "step."},
       "N",
       read_contact_force},
  };
}

}  // namespace graze
