// A controller in C++: a trot in place by sines. Diagonal pairs of legs swing in turn about the posture in which the
// nominal robot begins. Replace it by what your robot does; graze/policy.hpp says what it is given.
#include "graze/policy.hpp"

#include <cmath>
#include <stdexcept>

namespace {

constexpr double kPi = 3.14159265358979323846;

class SineTrot {
 public:
  static constexpr std::uint32_t reads = GRAZE_READS_NOTHING;  // it is a function of time

  explicit SineTrot(const graze::policy::Setup& setup)
      : amplitude_(setup.setting("amplitude", 0.1)), period_(setup.setting("period", 0.5)) {
    setup.take_settings("amplitude period");
    if (!(period_ > 0)) throw std::invalid_argument("the setting 'period' must be positive");
    for (int k = 0; k < setup.joints(); ++k) {
      const std::string name = setup.joint(k).name;
      const bool first_pair = name.rfind("LF", 0) == 0 || name.rfind("RH", 0) == 0;
      const bool lifts = name.find("_Y_") != std::string::npos;
      joints_.push_back({setup.joint(k).initial, first_pair ? 0.0 : kPi, lifts ? amplitude_ : 0.0});
    }
  }

  void start(std::uint64_t) {}  // it remembers nothing of a trace

  void act(const graze::policy::Robot& robot) {
    const double rate = 2 * kPi / period_;  // rad/s
    for (int k = 0; k < static_cast<int>(joints_.size()); ++k) {
      const JointMotion& joint = joints_[static_cast<std::size_t>(k)];
      const double angle = rate * robot.time() + joint.phase;
      robot.want_position(k, joint.middle + joint.amplitude * std::sin(angle));
      robot.want_velocity(k, joint.amplitude * rate * std::cos(angle));
    }
  }

 private:
  struct JointMotion {
    double middle, phase, amplitude;  // rad
  };
  double amplitude_, period_;  // rad, s
  std::vector<JointMotion> joints_;
};

}  // namespace

GRAZE_POLICY(SineTrot)
