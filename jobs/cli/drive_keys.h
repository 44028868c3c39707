#pragma once
// What keys do to a robot that is driven (§9.4.1): they change its command by steps, holonomic or as a car's wheel
// does.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace graze {

/// Names of the keys that bytes from a terminal stand for: "up", "down", "left", "right", "space", or the character.
/// What is not whole stays in `bytes`.
std::vector<std::string> decode_keys(std::string& bytes);

struct TimedKey {
  double time;  // s
  std::string key;
  std::string where = "";  // file:line:column
};

/// Lines `TIME KEY`, times in s that do not fall; empty ones and what follows # are passed over. `name` stands for the
/// text in messages. Throws InputError.
std::vector<TimedKey> parse_key_script(const std::string& text, const std::string& name);

/// Where the wheel and the throttle are.
class DriveWheel {
 public:
  /// Whether the key changes the command.
  bool press(std::string_view key);
  /// As far as the sticks of a gamepad lie: shares of the most in either direction, -1 to 1.
  void steer(double forward, double strafe, double turn);
  bool is_car() const { return car_; }
  double forward() const;  // m/s
  double strafe() const;   // m/s
  double turn() const;     // rad/s

 private:
  int forward_ = 0, strafe_ = 0, turn_ = 0;  // steps
  bool car_ = false;
};

/// Which policy a key chooses, "1" the first; none: it is no such key.
std::optional<std::size_t> chosen_by(std::string_view key);

}  // namespace graze
