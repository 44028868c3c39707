// How hard parts strike each other. The impulse of a contact is the sum of the normal impulses of all its points from
// the step in which two shapes begin to touch on, N s: of a ball that drops and rests, m v and then m g t; of one that
// bounces, (1 + e) m v. It is a change of momentum, so a smaller time step spreads it over more steps and leaves it as
// it is. A contact that was lost for less than kPause goes on: a solver's chatter is no row of strikes.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "scenarios/parts.h"
#include "scenarios/witnesses.h"

namespace graze {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPause = 5e-3;  // s

/// The contacts of one pair of colliders.
struct PairImpulse {
  int a, b;
  unsigned open = 0;                           // lanes in which a contact is under way
  std::array<double, kLanes> sum{};            // N s, of that contact
  std::array<double, kLanes> begin{}, last{};  // s: when it began, when it last touched

  // Of the present step.
  unsigned touching = 0;
  std::array<double, kLanes> impulse{}, age{};
};

struct ImpulseMemory final : WitnessMemory {
  std::vector<PairImpulse> pairs;     // by a, then b
  std::array<double, kLanes> time{};  // s, of the last step

  void start(int lane, const Model&) override {
    for (PairImpulse& pair : pairs) pair.open &= ~(1u << lane);
    time[lane] = 0;
  }

  void carry(int lane, LaneTape& tape) override {
    const unsigned bit = 1u << lane;
    const auto open = std::count_if(pairs.begin(), pairs.end(), [&](const auto& pair) { return pair.open & bit; });
    auto count = static_cast<std::size_t>(open);
    tape.carry(count);
    auto next = pairs.begin();
    for (std::size_t i = 0; i < count; ++i) {
      if (!tape.reads()) next = std::find_if(next, pairs.end(), [&](const auto& pair) { return pair.open & bit; });
      PairImpulse pair = tape.reads() ? PairImpulse{} : *next++;
      tape.carry(pair.a), tape.carry(pair.b);
      tape.carry(pair.sum[lane]), tape.carry(pair.begin[lane]), tape.carry(pair.last[lane]);
      if (!tape.reads()) continue;
      PairImpulse& own = pair_of(pair.a, pair.b);
      own.open |= bit;
      own.sum[lane] = pair.sum[lane], own.begin[lane] = pair.begin[lane], own.last[lane] = pair.last[lane];
    }
    tape.carry(time[lane]);
  }

  PairImpulse& pair_of(int a, int b) {
    const auto before = [](const PairImpulse& x, const std::pair<int, int>& y) { return std::pair(x.a, x.b) < y; };
    const auto place = std::lower_bound(pairs.begin(), pairs.end(), std::pair(a, b), before);
    if (place != pairs.end() && place->a == a && place->b == b) return *place;
    PairImpulse fresh;
    fresh.a = a;
    fresh.b = b;
    return *pairs.insert(place, fresh);
  }
};

class ContactImpulse final : public Witness {
 public:
  ContactImpulse(Between between, double below, double during)
      : between_(std::move(between)), below_(below), during_(during) {}

  std::unique_ptr<WitnessMemory> remember() const override { return std::make_unique<ImpulseMemory>(); }

  void follow(const WitnessInput& in) const override {
    ImpulseMemory& memory = *static_cast<ImpulseMemory*>(in.memory);
    for (PairImpulse& pair : memory.pairs) {
      pair.touching = 0;
      pair.impulse.fill(0);
      pair.age.fill(0);
    }
    for (const ContactPoint& point : in.points) take(point, in.lanes.bits(), memory);
    for (PairImpulse& pair : memory.pairs) add(pair, in, memory.time);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (in.lanes[lane]) memory.time[lane] = in.time[lane];
    }
  }

  PartKind parts() const override { return between_.parts(); }

  void evaluate(const WitnessInput& in, const BlockArray&, double* out, double* part) const override {
    std::fill_n(out, kLanes, below_);
    std::fill_n(part, kLanes, double{kNoPart});
    for (const PairImpulse& pair : static_cast<ImpulseMemory*>(in.memory)->pairs) {
      const double number = between_.part_of(pair.a, pair.b);
      for (int lane = 0; lane < kLanes; ++lane) {
        const double left = below_ - pair.sum[lane];
        if (!(pair.open >> lane & 1u) || !(left < out[lane])) continue;
        out[lane] = left;
        part[lane] = number;
      }
    }
  }

 private:
  void take(const ContactPoint& point, unsigned lanes, ImpulseMemory& memory) const {
    const unsigned between = between_(point) & lanes;
    if (between == 0) return;  // most are not
    const unsigned touching = between & point.touching().bits();
    if (touching == 0) return;
    PairImpulse& pair = memory.pair_of(point.a, point.b);
    pair.touching |= touching;
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!(touching >> lane & 1u)) continue;
      pair.impulse[lane] += point(kNormalImpulse, lane);
      pair.age[lane] = std::max(pair.age[lane], point(kAge, lane));
    }
  }

  /// Of an impulse that is spread over a step, the part within `during_` of the beginning counts.
  void add(PairImpulse& pair, const WitnessInput& in, const std::array<double, kLanes>& before) const {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!in.lanes[lane]) continue;
      const unsigned bit = 1u << lane;
      const double now = in.time[lane];
      if ((pair.open & bit) && now - pair.last[lane] > kPause) pair.open &= ~bit;
      if (!(pair.touching & bit)) continue;
      if (!(pair.open & bit)) {
        pair.open |= bit;
        pair.sum[lane] = 0;
        pair.begin[lane] = now - pair.age[lane];
      }
      pair.last[lane] = now;
      const double left = pair.begin[lane] + during_ - before[lane], step = now - before[lane];
      pair.sum[lane] += pair.impulse[lane] * (left >= step ? 1.0 : std::max(left, 0.0) / step);
    }
  }

  Between between_;
  double below_, during_;
};

ReadWitness read_contact_impulse(const Described& own, const Model& nominal) {
  Between between = read_between(own.at("between"), nominal);
  const double below = own.number("below");
  const auto during = own.find_number("during");
  const double seconds = during.value_or(kInfinity);
  std::string text = fmt::format("impulse between {} below {:g} N s", between.text, below);
  if (during) text += fmt::format(" within {:g} s", seconds);
  return {std::make_shared<ContactImpulse>(std::move(between), below, seconds), text, "N s", {}, below};
}

}  // namespace

std::vector<WitnessKind> impulse_witnesses() {
  return {
      {"contact_impulse",
       {"no contact of two parts has a larger normal impulse than a bound",
        {{"between", {Form::texts(2, "PART")}, Default::required(), "globs of parts; `curb.side` names a feature"},
         {"below", {Form::number(Quantity::impulse, Bound::positive)}, Default::required(), "the bound"},
         {"during",
          {Form::number(Quantity::time, Bound::positive)},
          Default::words("all of it"),
          "the first part of each contact, which alone counts"}},
        {},
        {},
        "The margin is the bound minus the impulse of the hardest contact under way."},
       "N s",
       read_contact_impulse},
  };
}

}  // namespace graze
