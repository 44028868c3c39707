#pragma once
// One particle of a world built by hand, under a task of one requirement.

#include <functional>
#include <string>

#include "scenarios/task.h"
#include "tests/engine/bullet/worlds.h"

namespace graze::testing {

/// One particle under a task, as a trace is judged.
class Judged {
 public:
  Judged(const std::string& physics, const World& world, const std::string& requirement)
      : bench_(physics, world),
        task_(read_task(Settings::parse("requirements: {r: " + requirement + "}", "task.yaml"), bench_.model())),
        monitor_(task_) {
    monitor_.start(0, bench_.model());
    look();
  }

  void run(double seconds, double h, const std::function<void()>& each = {}) {
    for (long k = std::lround(seconds / h); k > 0; --k) {
      bench_.step(h);
      time_ += h;
      look();
      if (each) each();
    }
  }
  double margin() const { return monitor_.margins(0)[0]; }
  /// "body+thing": the pair of colliders that gave the margin; or nothing.
  std::string culprit() {
    const int part = monitor_.margin_parts(0)[0], count = static_cast<int>(bench_.model().colliders.size());
    if (part == kNoPart) return "";
    return bench_.model().colliders[part / count].name + "+" + bench_.model().colliders[part % count].name;
  }
  double present() {
    BlockArray requirements, objective;
    monitor_.values(input(), requirements, objective);
    return requirements(0, 0);
  }
  test::Bench& bench() { return bench_; }

 private:
  WitnessInput input() {
    std::array<double, kLanes> times{};
    times[0] = time_;
    return {bench_.physics().state(), bench_.physics().contact_points(), tau_, tau_, times, LaneMask(1)};
  }
  void look() { monitor_.update(input()); }

  test::Bench bench_;
  Task task_;
  TaskMonitor monitor_;
  BlockArray tau_{0};
  double time_ = 0;
};

}  // namespace graze::testing
