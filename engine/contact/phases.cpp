#include "engine/contact/phases.h"

#include <algorithm>
#include <tuple>

#include "engine/contact/pair_list.h"

namespace graze {
namespace {

/// s: two times that are nearer are the same but for rounding.
constexpr double kInstant = 1e-9;

bool named_features(ShapeKind kind) { return kind == ShapeKind::box || kind == ShapeKind::cylinder; }

std::string part(const Model& model, int collider, Feature feature) {
  const Collider& c = model.colliders[collider];
  if (!named_features(c.shape.kind)) return c.name;
  return c.name + "." + std::string(feature_name(feature));
}

void carry_phase(ContactPhase& phase, LaneTape& tape) {
  tape.carry(phase.begin), tape.carry(phase.end), tape.carry(phase.a), tape.carry(phase.b);
  tape.carry(phase.feature_a), tape.carry(phase.feature_b);
  tape.carry(phase.peak), tape.carry(phase.impulse), tape.carry(phase.slip), tape.carry(phase.roll);
}

}  // namespace

void PhaseTracker::start(int lane) {
  phases_[lane].clear();
  for (Pair& pair : pairs_) pair.open &= ~(1u << lane);
  std::erase_if(pairs_, [](const Pair& pair) { return pair.open == 0; });
}

void PhaseTracker::carry(int lane, LaneTape& tape) {
  const unsigned bit = 1u << lane;
  std::vector<Pair> open;
  for (const Pair& pair : pairs_) {
    if (pair.open & bit) open.push_back(pair);
  }
  std::size_t count = open.size();
  tape.carry(count);
  for (std::size_t i = 0; i < count; ++i) {
    Pair pair = i < open.size() ? open[i] : Pair{};
    carry_phase(pair.phase[lane], tape);
    tape.carry(pair.steps[lane]);
    if (!tape.reads()) continue;
    Pair& own = entry_of_pair(pairs_, pair.phase[lane].a, pair.phase[lane].b);
    own.open |= bit;
    own.phase[lane] = pair.phase[lane];
    own.steps[lane] = pair.steps[lane];
  }
  count = phases_[lane].size();
  tape.carry(count);
  if (tape.reads()) phases_[lane].assign(count, {});
  for (ContactPhase& phase : phases_[lane]) carry_phase(phase, tape);
}

void PhaseTracker::update(const std::array<double, kLanes>& time, const std::vector<ContactPoint>& points,
                          LaneMask active) {
  find_touching(points, active.bits());
  for (Pair& pair : pairs_) {
    for (unsigned left = pair.now; left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      follow(pair, lane, time[lane]);
    }
  }
}

void PhaseTracker::find_touching(const std::vector<ContactPoint>& points, unsigned active) {
  for (Pair& pair : pairs_) pair.now = 0;
  for (const ContactPoint& point : points) {
    const unsigned touching = point.touching().bits() & active;
    if (touching == 0) continue;
    Pair& pair = entry_of_pair(pairs_, point.a, point.b);
    for (unsigned left = touching; left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      const double load = point(kNormalImpulse, lane);
      if (!(pair.now >> lane & 1u)) {
        pair.load[lane] = load;
        pair.most[lane] = &point;
      } else {
        pair.load[lane] += load;
        if (load > (*pair.most[lane])(kNormalImpulse, lane)) pair.most[lane] = &point;
      }
    }
    pair.now |= touching;
  }
}

void PhaseTracker::follow(Pair& pair, int lane, double time) {
  const unsigned bit = 1u << lane;
  const ContactPoint& point = *pair.most[lane];
  ContactPhase& phase = pair.phase[lane];
  const double begin = time - point(kAge, lane);
  if ((pair.open & bit) && begin - phase.end > rules_.gap + kInstant) close(pair, lane);
  const bool fresh = (pair.open & bit) == 0;
  if (fresh) {
    pair.open |= bit;
    phase = {};
    phase.begin = begin;
    phase.a = pair.a;
    phase.b = pair.b;
    pair.steps[lane] = 0;
  }
  phase.end = time;
  phase.impulse += pair.load[lane];
  if (fresh || pair.load[lane] > phase.peak) {
    phase.peak = pair.load[lane];
    phase.feature_a = static_cast<Feature>(static_cast<int>(point(kFeatureA, lane)));
    phase.feature_b = static_cast<Feature>(static_cast<int>(point(kFeatureB, lane)));
  }
  const auto mode = static_cast<ContactMode>(static_cast<int>(point(kMode, lane)));
  pair.steps[lane] += 1;
  phase.slip += mode == ContactMode::slip ? 1 : 0;
  phase.roll += mode == ContactMode::roll ? 1 : 0;
}

void PhaseTracker::close(Pair& pair, int lane) {
  pair.open &= ~(1u << lane);
  ContactPhase phase = pair.phase[lane];
  if (phase.end - phase.begin < rules_.dwell && phase.impulse < rules_.impulse) return;
  phase.slip /= pair.steps[lane];
  phase.roll /= pair.steps[lane];
  phases_[lane].push_back(phase);
}

std::vector<ContactPhase> PhaseTracker::take(int lane) {
  for (Pair& pair : pairs_) {
    if (pair.open >> lane & 1u) close(pair, lane);
  }
  std::erase_if(pairs_, [](const Pair& pair) { return pair.open == 0; });
  std::vector<ContactPhase> out = std::exchange(phases_[lane], {});
  const auto key = [](const ContactPhase& phase) { return std::tuple(phase.begin, phase.a, phase.b); };
  std::sort(out.begin(), out.end(), [&](const auto& x, const auto& y) { return key(x) < key(y); });
  return out;
}

std::string contact_sequence(const Model& nominal, const std::vector<ContactPhase>& phases) {
  std::string out;
  for (const ContactPhase& phase : phases) {
    if (!out.empty()) out += ' ';
    out += part(nominal, phase.a, phase.feature_a) + "-" + part(nominal, phase.b, phase.feature_b);
  }
  return out;
}

}  // namespace graze
