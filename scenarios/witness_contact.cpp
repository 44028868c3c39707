// Witnesses of contact between parts. Margins are gaps in metres, measured at the end of each step as far as the
// witness asks, whatever the back end looks at; while the parts touch, overlaps as the back end reports them. Before
// the first step no back end has looked, and gaps alone tell what touches.
#include <fmt/format.h>

#include <algorithm>

#include "scenarios/parts.h"
#include "scenarios/witnesses.h"

namespace graze {
namespace {

/// Parts that begin no farther apart touch, m: gaps are as exact as this.
constexpr double kTouchAtStart = 1e-6;

struct GapMemory final : WitnessMemory {
  Clearance clearance;
  explicit GapMemory(Clearance from) : clearance(std::move(from)) {}
  void start(int lane, const Model& model) override { clearance.start(lane, model); }
  void carry(int, LaneTape&) override {}  // what it keeps saves time, and changes no value
  std::vector<int> bodies() const override { return clearance.bodies(); }
};

/// Contacts between some parts: whether they touch is the physics' word after each step, how far apart they are is
/// measured.
class NoContact : public Witness {
 public:
  NoContact(Between between, const Model& nominal, double within)
      : between_(std::move(between)), clearance_(nominal, between_.first, between_.second, within) {}

  std::unique_ptr<WitnessMemory> remember() const override { return std::make_unique<GapMemory>(clearance_); }

  PartKind parts() const override { return between_.parts(); }

  void evaluate(const WitnessInput& in, const BlockArray&, double* out, double* part) const override {
    std::fill_n(part, kLanes, double{kNoPart});
    const unsigned touching = overlaps(in, out, part);
    LaneMask apart(in.lanes.bits() & ~touching);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!apart[lane] || in.enough == nullptr || in.enough[lane] > kTouch) continue;
      out[lane] = kTouch;  // no gap is less
      apart.set(lane, false);
    }
    if (!apart.any()) return;
    double gap[kLanes], pair[kLanes];
    static_cast<GapMemory*>(in.memory)->clearance.least(in.state, apart, in.enough, gap, pair, in.moves);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!apart[lane]) continue;
      const bool touches = in.time[lane] == 0 && gap[lane] <= kTouchAtStart;
      out[lane] = touches ? std::min(gap[lane], -kTouch) : std::max(gap[lane], kTouch);
      part[lane] = pair[lane];
    }
  }

 private:
  /// Fills `out` and `part` in the lanes in which something touches, and returns these. Of equal overlaps the first
  /// pair's counts, in whatever order points come.
  unsigned overlaps(const WitnessInput& in, double* out, double* part) const {
    unsigned all = 0;
    for (const ContactPoint& point : in.points) {
      const unsigned between = between_(point);
      if (between == 0) continue;  // most are not
      const unsigned touching = between & point.touching().bits();
      if (touching == 0) continue;
      const double* gap = point.row(kGap);
      const double pair = between_.part_of(point);
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!(touching >> lane & 1u)) continue;
        const double overlap = std::min(gap[lane], -kTouch);
        const bool first = !(all >> lane & 1u) || overlap < out[lane];
        if (first || (overlap == out[lane] && pair < part[lane])) part[lane] = pair;
        if (first) out[lane] = overlap;
        all |= 1u << lane;
      }
    }
    return all;
  }

  Between between_;
  Clearance clearance_;  // copied for each block
};

/// At least one of the pairs touches.
class HeldContact final : public NoContact {
 public:
  using NoContact::NoContact;

  void evaluate(const WitnessInput& in, const BlockArray& own, double* out, double* part) const override {
    WitnessInput exact = in;
    exact.enough = nullptr;  // it is of the negative
    NoContact::evaluate(exact, own, out, part);
    for (int lane = 0; lane < kLanes; ++lane) out[lane] = -out[lane];
  }
};

Key within_key() {
  return {"within",
          {Form::number(Quantity::length, Bound::positive)},
          Default::value("2 cm"),
          "how far gaps are measured; beyond it they are not told apart"};
}

double read_within(const Described& own) {
  return own.settings().is_map() ? own.number("within") : own.default_number("within");
}

/// `[a, b]`, or a map that holds them as `between`.
template <class Kind>
std::shared_ptr<const Witness> read_gap(const Described& own, const Model& nominal, std::string& text) {
  Between between = read_between(own.settings().is_map() ? own.at("between") : own.settings(), nominal);
  text = between.text;
  return std::make_shared<Kind>(std::move(between), nominal, read_within(own));
}

ReadWitness read_no_contact(const Described& own, const Model& nominal) {
  std::string text;
  auto witness = read_gap<NoContact>(own, nominal, text);
  return {std::move(witness), "no contact between " + text, "m"};
}

ReadWitness read_contact(const Described& own, const Model& nominal) {
  std::string text;
  auto witness = read_gap<HeldContact>(own, nominal, text);
  return {std::move(witness), "contact between " + text, "m"};
}

ReadWitness read_self_collision(const Described& own, const Model& nominal) {
  const Settings& settings = own.settings();
  if (settings.is_scalar()) {  // "self_collision: true" reads as well as "self_collision: {}"
    if (!settings.flag()) settings.fail("false: leave the line out instead");
  } else if (settings.is_list()) {
    settings.entries();  // which says that it is no map
  }
  Between between;
  std::vector<unsigned>& robot = between.first.features;
  for (const Collider& collider : nominal.colliders) robot.push_back(collider.is_object ? 0u : ~0u);
  between.pairs =
      static_cast<int>(std::count_if(nominal.pairs.begin(), nominal.pairs.end(),
                                     [&](const ColliderPair& pair) { return robot[pair.a] && robot[pair.b]; }));
  if (between.pairs == 0) {
    settings.fail_key(
        "no two parts of the robot may touch (contact.self_collision is false, contact.ignore names them "
        "all, or all are neighbours), so this can never be violated");
  }
  between.second = between.first;
  return {std::make_shared<NoContact>(std::move(between), nominal, read_within(own)),
          "no contact between non-adjacent links", "m"};
}

}  // namespace

std::vector<WitnessKind> contact_witnesses() {
  const Key between = {"between",
                       {Form::texts(2, "PART")},
                       Default::required(),
                       "globs of parts; `curb.side` names a feature, `\"*\"` is any other part"};
  const std::vector<Form> pair = {Form::texts(2, "PART")};
  const std::string short_form = "`[PART, PART]` alone stands for `{between: [PART, PART]}`.";
  return {
      {"contact",
       {"two parts touch",
        {between, within_key()},
        {},
        pair,
        "The margin is the negative gap, positive while they touch. " + short_form},
       "m",
       read_contact},
      {"no_contact",
       {"two parts do not touch; its margin is the gap between them",
        {between, within_key()},
        {},
        pair,
        "The gap is that at the end of the step, while they touch the overlap, negative. " + short_form},
       "m",
       read_no_contact},
      {"self_collision",
       {"the robot's parts that are not neighbours do not touch each other",
        {within_key()},
        {},
        {Form::flag(), Form::nothing()},
        "`self_collision: true` is enough."},
       "m",
       read_self_collision},
  };
}

}  // namespace graze
