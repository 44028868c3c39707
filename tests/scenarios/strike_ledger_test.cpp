// Claim: contact_impulse and contact_force say what a ledger says that keeps every blow of a trace and adds up anew at
// each step: whatever lanes, pairs, pauses, ages, windows and directions there are.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "sampling/constants.h"
#include "tests/scenarios/task_bench.h"

namespace graze {
namespace {

constexpr double kAPause = 5e-3;  // s: a contact that was lost for less goes on (docs/scenario.md, contact_impulse)

/// What two colliders gave each other within one step.
struct Blow {
  double before, now;  // s, of the step
  double begin;        // s, when the first of its points began to touch
  Vec3 on_a;           // N s, of all its points
  double normal;       // N s
};

/// Of one pair of colliders in one lane.
struct PairLedger {
  int a, b;
  bool first_is_a;
  std::vector<Blow> blows;

  double counted(const Blow& blow, const std::optional<Vec3>& along) const {
    return along ? (first_is_a ? 1 : -1) * blow.on_a.dot(*along) : blow.normal;
  }
  /// The blows of one contact each, and when it began: contacts are apart by more than a pause.
  std::vector<std::pair<double, std::vector<Blow>>> contacts() const {
    std::vector<std::pair<double, std::vector<Blow>>> out;
    for (const Blow& blow : blows) {
      if (out.empty() || blow.now - out.back().second.back().now > kAPause) out.push_back({blow.begin, {}});
      out.back().second.push_back(blow);
    }
    return out;
  }
};

double overlap(const Blow& blow, double from, double to) {
  return std::max(std::min(blow.now, to) - std::max(blow.before, from), 0.0) / (blow.now - blow.before);
}

/// What a witness asks of the ledgers.
struct Asked {
  double during = kInfinity, from = 0, over = 0;
  std::optional<Vec3> along;
};

struct Said {
  double value = 0;
  int part = kNoPart;
};

/// N s: of the hardest contact that is under way.
Said hardest_contact(const std::vector<PairLedger>& pairs, const Asked& asked, double now, int colliders) {
  Said out;
  for (const PairLedger& pair : pairs) {
    const auto contacts = pair.contacts();
    if (contacts.empty() || now - contacts.back().second.back().now > kAPause) continue;
    double sum = 0;
    for (const Blow& blow : contacts.back().second) {
      sum += pair.counted(blow, asked.along) * overlap(blow, -1, contacts.back().first + asked.during);
    }
    if (sum > out.value) out = {sum, pair.a * colliders + pair.b};
  }
  return out;
}

/// N s: of all contacts from a time on.
Said all_contacts(const std::vector<PairLedger>& pairs, const Asked& asked, int colliders) {
  Said out;
  double most = 0;
  for (const PairLedger& pair : pairs) {
    double sum = 0;
    for (const auto& [begin, blows] : pair.contacts()) {
      for (const Blow& blow : blows) {
        sum += pair.counted(blow, asked.along) * overlap(blow, asked.from, begin + asked.during);
      }
    }
    out.value += sum;
    if (sum > most) most = sum, out.part = pair.a * colliders + pair.b;
  }
  return out;
}

/// N: over the last while, or what there has been of it.
Said mean_force(const std::vector<PairLedger>& pairs, const Asked& asked, double begin, double step, double now,
                int colliders) {
  const double time = std::min(std::max(asked.over, step), now - begin);
  Said out;
  double most = 0;
  for (const PairLedger& pair : pairs) {
    double sum = 0;
    for (const Blow& blow : pair.blows) sum += pair.counted(blow, asked.along) * overlap(blow, now - time, now);
    if (time > 0) out.value += sum / time;
    if (sum > most) most = sum, out.part = pair.a * colliders + pair.b;
  }
  return out;
}

class StrikeLedger : public testing::TaskBench {
 protected:
  StrikeLedger() : colliders_(static_cast<int>(model_.colliders.size())) {
    for (const char* part : {"foot", "base"}) {
      for (const char* thing : {"ground", "block"}) {
        const int a = model_.collider(part), b = model_.collider(thing);
        for (auto& lane : ledgers_) lane.push_back({std::min(a, b), std::max(a, b), a < b, {}});
      }
    }
    touched_.fill(std::vector<int>(4));
    forget();
    random_.seed(11);
  }

  /// As if nothing had been: a trace begins in each lane, at a time of its own.
  void forget() {
    for (auto& lane : ledgers_) {
      for (PairLedger& pair : lane) pair.blows.clear();
    }
    for (auto& lane : touched_) std::fill(lane.begin(), lane.end(), 0);
    step_ = {};
    for (int lane = 0; lane < kLanes; ++lane) begin_[lane] = time_[lane] = 2e-3 * lane;
  }

  double number() { return random_() / 4294967296.0; }  // 0 .. 1

  /// One step of a lane of pairs that touch for a while, and then do not for a while.
  void strike(int lane) {
    const double before = time_[lane], step = 3e-4 + 1.4e-3 * number();
    step_[lane] = step;
    time_[lane] += step;
    for (std::size_t k = 0; k < ledgers_[lane].size(); ++k) {
      PairLedger& pair = ledgers_[lane][k];
      int& left = touched_[lane][k];  // steps to go: touching if positive
      if (left == 0) left = random_() % 2 ? 1 + static_cast<int>(random_() % 6) : -1 - static_cast<int>(random_() % 9);
      const bool touches = left > 0;
      left += touches ? -1 : 1;
      if (number() < 0.3) near(lane, pair);
      if (!touches) continue;
      Blow blow{before, time_[lane], kInfinity, Vec3::Zero(), 0};
      for (int points = 1 + static_cast<int>(random_() % 3); points > 0; --points) {
        const Contact c = point(pair, step);
        blow.begin = std::min(blow.begin, time_[lane] - c.age);
        blow.on_a += c.impulse_W;
        blow.normal += c.normal_impulse();
        lists_[lane].push_back(c);
      }
      pair.blows.push_back(blow);
    }
  }

  /// Both press, or overlap and do not press.
  Contact point(const PairLedger& pair, double step) {
    Contact c;
    c.a = pair.a, c.b = pair.b;
    c.feature_a = c.feature_b = Feature::surface;
    c.n_W = Vec3(number() - 0.5, number() - 0.5, 1).normalized();
    c.age = step * number();
    const bool presses = number() < 0.8;
    c.phi = presses ? 2e-3 * (number() - 0.5) : -1e-3 * number();
    if (presses) c.impulse_W = number() * c.n_W + 0.1 * Vec3(number(), -number(), 0).cross(c.n_W);
    return c;
  }

  /// A point that is only near says nothing of when a contact begins.
  void near(int lane, const PairLedger& pair) {
    Contact c;
    c.a = pair.a, c.b = pair.b;
    c.phi = 1e-3;
    c.age = 1e-3;
    lists_[lane].push_back(c);
  }

  /// Judges some hundred steps, in each of which some lanes stand still, and holds every value against the ledger.
  template <typename Right>
  void hold_against(const std::string& requirement, const Right& right) {
    const Task t = task("requirements: {r: " + requirement + "}");
    TaskMonitor monitor(t);
    for (int lane = 0; lane < kLanes; ++lane) monitor.start(lane, model_);
    std::array<Said, kLanes> least;
    for (Said& one : least) one.value = kInfinity;
    const Window window = t.requirements[0].window;
    for (int step = 0; step <= 120; ++step) {
      const LaneMask lanes(step == 0 ? LaneMask::all().bits() : random_() % 256);
      for (int lane = 0; lane < kLanes; ++lane) {
        lists_[lane].clear();
        if (step > 0 && lanes[lane]) strike(lane);
      }
      const std::vector<ContactPoint> points = lists_.gather();
      const WitnessInput in{state_, points, tau_, headroom_, time_, lanes};
      monitor.update(in);
      BlockArray values, objective;
      monitor.values(in, values, objective);
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!lanes[lane]) continue;
        const Said now = right(lane);
        ASSERT_NEAR(values(0, lane), now.value, 1e-11 * (10 + std::abs(now.value)))
            << requirement << ", step " << step << ", lane " << lane;
        if (window.contains(time_[lane]) && now.value < least[lane].value - 1e-9) least[lane] = now;
      }
    }
    for (int lane = 0; lane < kLanes; ++lane) {
      EXPECT_NEAR(monitor.margins(lane)[0], least[lane].value, 1e-9) << requirement;
      EXPECT_EQ(monitor.margin_parts(lane)[0], least[lane].part) << requirement << ", lane " << lane;
    }
  }

  const int colliders_;
  std::array<std::vector<PairLedger>, kLanes> ledgers_;
  std::array<std::vector<int>, kLanes> touched_;
  std::array<double, kLanes> begin_{}, time_{}, step_{};
  std::mt19937 random_;
};

const std::string kPairs = "between: [\"{foot,base}\", \"{ground,block}\"]";
const Vec3 kAlong = Vec3(1, -2, 2) / 3;

TEST_F(StrikeLedger, TheHardestContactCounts) {
  hold_against("{contact_impulse: {" + kPairs + ", below: 3}}", [&](int lane) {
    Said out = hardest_contact(ledgers_[lane], {}, time_[lane], colliders_);
    return Said{3 - out.value, out.part};
  });
}

TEST_F(StrikeLedger, TheBeginOfEachContactCounts) {
  hold_against("{contact_impulse: {" + kPairs + ", below: 3, during: 2.3 ms, direction: [3, -6, 6]}}", [&](int lane) {
    Asked asked;
    asked.during = 2.3e-3;
    asked.along = kAlong;
    Said out = hardest_contact(ledgers_[lane], asked, time_[lane], colliders_);
    return Said{3 - out.value, out.part};
  });
}

TEST_F(StrikeLedger, ATotalIsOfTheWindow) {
  hold_against("{contact_impulse: {" + kPairs + ", below: 3, total: true}, window: [31.7 ms, 80 ms]}", [&](int lane) {
    Asked asked;
    asked.from = 0.0317;
    Said out = all_contacts(ledgers_[lane], asked, colliders_);
    return Said{3 - out.value, out.part};
  });
}

TEST_F(StrikeLedger, ATotalOfBeginsAlongADirection) {
  hold_against("{contact_impulse: {" + kPairs + ", below: 3, total: true, during: 1.9 ms, direction: [1, -2, 2]}}",
               [&](int lane) {
                 Asked asked;
                 asked.during = 1.9e-3;
                 asked.along = kAlong;
                 Said out = all_contacts(ledgers_[lane], asked, colliders_);
                 return Said{3 - out.value, out.part};
               });
}

TEST_F(StrikeLedger, AForceIsAMean) {
  for (const char* over : {"", ", over: 0.1 ms", ", over: 7.3 ms", ", over: 40 ms"}) {
    forget();
    Asked asked;
    asked.over = over[0] == 0 ? 0 : std::atof(over + 8) * 1e-3;
    hold_against("{contact_force: {" + kPairs + ", below: 900" + over + "}}", [&](int lane) {
      const Said out = mean_force(ledgers_[lane], asked, begin_[lane], step_[lane], time_[lane], colliders_);
      return Said{900 - out.value, out.part};
    });
  }
}

TEST_F(StrikeLedger, AForceMayHaveToBeLarge) {
  hold_against("{contact_force: {" + kPairs + ", above: 50, below: 900, over: 5 ms, direction: [1, -2, 2]}}",
               [&](int lane) {
                 Asked asked;
                 asked.over = 5e-3;
                 asked.along = kAlong;
                 const Said out = mean_force(ledgers_[lane], asked, begin_[lane], step_[lane], time_[lane], colliders_);
                 return Said{std::min(900 - out.value, out.value - 50), out.part};
               });
}

// The pause after which a contact is a new one is 5 ms, on either side.
TEST_F(StrikeLedger, APauseIsFiveMilliseconds) {
  for (const auto& [pause, sum] : {std::pair{4.9e-3, 1.5}, {5.1e-3, 1.0}}) {
    const Task t = task("requirements: {r: {contact_impulse: {between: [foot, ground], below: 10}}}");
    TaskMonitor monitor(t);
    monitor.start(kLane, model_);
    contacts_.clear();
    monitor.update(input(0));
    touch("foot", "ground", 0, 1);
    monitor.update(input(1e-3));
    contacts_.clear();
    monitor.update(input(2e-3));
    touch("foot", "ground", 0, 0.5);
    monitor.update(input(1e-3 + pause));
    EXPECT_NEAR(monitor.margins(kLane)[0], 10 - sum, 1e-12) << pause;
  }
}

}  // namespace
}  // namespace graze
