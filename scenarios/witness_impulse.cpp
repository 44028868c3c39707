// How hard parts strike each other. The impulse of a contact is the sum of the impulses of all its points, normal or
// along a direction, from the step in which two shapes begin to touch on, N s: of a ball that drops and rests, m v and
// then m g t; of one that bounces, (1 + e) m v. It is a change of momentum, so a smaller time step spreads it over more
// steps and leaves it as it is. A contact that was lost for less than kPause goes on: a solver's chatter is no row of
// strikes. The total is that of all contacts together, whenever they were.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/contact/pair_list.h"
#include "sampling/constants.h"
#include "scenarios/impulse_part.h"
#include "scenarios/witnesses.h"

namespace graze {
namespace {

constexpr double kPause = 5e-3;  // s

/// The contacts of one pair of colliders.
struct PairImpulse {
  int a, b;
  unsigned open = 0;                           // lanes in which a contact is under way
  std::array<double, kLanes> sum{};            // N s, of that contact
  std::array<double, kLanes> begin{}, last{};  // s: when it began, when it last touched
  std::array<double, kLanes> total{};          // N s, of all contacts within the window

  // Of the present step.
  unsigned touching = 0;
  std::array<double, kLanes> impulse{}, age{};

  /// Whether there is anything to remember of a lane.
  bool knows(int lane) const { return (open >> lane & 1u) || total[lane] != 0; }
};

struct ImpulseMemory final : WitnessMemory {
  std::vector<PairImpulse> pairs;     // by a, then b
  std::array<double, kLanes> time{};  // s, of the last step; NaN: nothing was seen of the trace

  void start(int lane, const Model&) override {
    for (PairImpulse& pair : pairs) pair.open &= ~(1u << lane), pair.total[lane] = 0;
    time[lane] = kNaN;
  }

  void carry(int lane, LaneTape& tape) override {
    const unsigned bit = 1u << lane;
    const auto known = [lane](const PairImpulse& pair) { return pair.knows(lane); };
    auto count = static_cast<std::size_t>(std::count_if(pairs.begin(), pairs.end(), known));
    tape.carry(count);
    auto next = pairs.begin();
    for (std::size_t i = 0; i < count; ++i) {
      if (!tape.reads()) next = std::find_if(next, pairs.end(), known);
      PairImpulse pair = tape.reads() ? PairImpulse{} : *next++;
      bool open = pair.open & bit;
      tape.carry(pair.a), tape.carry(pair.b), tape.carry(open);
      for (auto* numbers : {&pair.sum, &pair.begin, &pair.last, &pair.total}) tape.carry((*numbers)[lane]);
      if (!tape.reads()) continue;
      PairImpulse& own = entry_of_pair(pairs, pair.a, pair.b);
      own.open = open ? own.open | bit : own.open & ~bit;
      own.sum[lane] = pair.sum[lane], own.begin[lane] = pair.begin[lane], own.last[lane] = pair.last[lane];
      own.total[lane] = pair.total[lane];
    }
    tape.carry(time[lane]);
  }
};

class ContactImpulse final : public Witness {
 public:
  ContactImpulse(Between between, ImpulsePart counted, double below, double during, bool total)
      : between_(std::move(between)), counted_(std::move(counted)), below_(below), during_(during), total_(total) {}

  /// `total` counts from this time on, s.
  std::shared_ptr<const Witness> since(double from) const {
    auto out = std::make_shared<ContactImpulse>(*this);
    out->from_ = from;
    return out;
  }

  std::unique_ptr<WitnessMemory> remember() const override { return std::make_unique<ImpulseMemory>(); }

  void follow(const WitnessInput& in) const override {
    ImpulseMemory& memory = *static_cast<ImpulseMemory*>(in.memory);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (in.lanes[lane] && std::isnan(memory.time[lane])) memory.time[lane] = in.time[lane];
    }
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
    if (total_) {
      evaluate_total(*static_cast<ImpulseMemory*>(in.memory), out, part);
      return;
    }
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
  /// The part is the pair with the largest share.
  void evaluate_total(const ImpulseMemory& memory, double* out, double* part) const {
    double most[kLanes] = {};
    std::fill_n(out, kLanes, below_);
    std::fill_n(part, kLanes, double{kNoPart});
    for (const PairImpulse& pair : memory.pairs) {
      const double number = between_.part_of(pair.a, pair.b);
      for (int lane = 0; lane < kLanes; ++lane) {
        out[lane] -= pair.total[lane];
        if (pair.total[lane] > most[lane]) most[lane] = pair.total[lane], part[lane] = number;
      }
    }
  }

  void take(const ContactPoint& point, unsigned lanes, ImpulseMemory& memory) const {
    const unsigned between = between_(point) & lanes;
    if (between == 0) return;  // most are not
    const unsigned touching = between & point.touching().bits();
    if (touching == 0) return;
    PairImpulse& pair = entry_of_pair(memory.pairs, point.a, point.b);
    pair.touching |= touching;
    const unsigned first_is_a = counted_.is_normal() ? 0 : between_.first_is_a(point);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!(touching >> lane & 1u)) continue;
      pair.impulse[lane] += counted_(point, first_is_a, lane);
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
      if (total_) pair.total[lane] += pair.impulse[lane] * share(pair.begin[lane], before[lane], now);
    }
  }

  /// Of the step from `before` to `now`: how much lies in the window and within `during_` of the contact's begin.
  double share(double begin, double before, double now) const {
    const double first = std::max(before, from_), last = std::min(now, begin + during_);
    return first <= before && last >= now ? 1.0 : std::max(last - first, 0.0) / (now - before);
  }

  Between between_;
  ImpulsePart counted_;
  double below_, during_;
  bool total_;
  double from_ = 0;  // s
};

ReadWitness read_contact_impulse(const Described& own, const Model& nominal) {
  Between between = read_between(own.at("between"), nominal);
  ImpulsePart counted(own);
  const double below = own.number("below");
  const auto during = own.find_number("during");
  const double seconds = during.value_or(kInfinity);
  const bool total = own.flag("total");
  std::string text =
      fmt::format("{}impulse between {}{} below {:g} N s", total ? "total " : "", between.text, counted.text(), below);
  if (during) text += fmt::format(" within {:g} s", seconds);
  const auto witness =
      std::make_shared<const ContactImpulse>(std::move(between), std::move(counted), below, seconds, total);
  return {witness, text, "N s", {}, below, [witness](double from) { return witness->since(from); }};
}

}  // namespace

std::vector<WitnessKind> impulse_witnesses() {
  return {
      {"contact_impulse",
       {"no contact of two parts has a larger impulse than a bound",
        {{"between", {Form::texts(2, "PART")}, Default::required(), "globs of parts; `curb.side` names a feature"},
         {"below", {Form::number(Quantity::impulse, Bound::positive)}, Default::required(), "the bound"},
         {"during",
          {Form::number(Quantity::time, Bound::positive)},
          Default::words("all of it"),
          "the first part of each contact, which alone counts"},
         ImpulsePart::key(),
         {"total",
          {Form::flag()},
          Default::value("false"),
          "all contacts count together, from the window's begin on, instead of the hardest one"}},
        {},
        {},
        "The margin is the bound minus the impulse of the hardest contact under way, or of all that have been."},
       "N s",
       read_contact_impulse},
  };
}

}  // namespace graze
