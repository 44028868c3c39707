#include "jobs/cli/drive_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "archive/files/utf8.h"
#include "engine/settings/byte_order_mark.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

// One press, our choice: 5 cm/s, 0.1 rad/s, and for a car 0.5/m of curvature. As divisors, so that three presses of
// 5 cm/s are 0.15.
constexpr double kSpeedSteps = 20, kTurnSteps = 10, kCurveSteps = 2;
constexpr int kMostSpeed = 20, kMostTurn = 20, kMostCurve = 8;  // 1 m/s, 2 rad/s, a curve of 25 cm

constexpr const char* kSingleKeys = "wasdWASD,.cqCQ+-";

std::string key_of(char byte) {
  switch (byte) {
    case ' ':
      return "space";
    case 'w':
    case 'W':
      return "up";
    case 's':
    case 'S':
      return "down";
    case 'a':
    case 'A':
      return "left";
    case 'd':
    case 'D':
      return "right";
    case 'Q':
      return "q";
    case 'C':
      return "c";
    default:
      return std::string(1, byte);
  }
}

bool is_single(char byte) {
  return byte == ' ' || (byte >= '1' && byte <= '9') || std::string_view(kSingleKeys).find(byte) != std::string::npos;
}

/// "\x1b[A" and, where a terminal has been told to, "\x1bOA".
std::string arrow_of(char byte) {
  return byte == 'A' ? "up" : byte == 'B' ? "down" : byte == 'C' ? "right" : byte == 'D' ? "left" : "";
}

}  // namespace

std::vector<std::string> decode_keys(std::string& bytes) {
  std::vector<std::string> out;
  std::size_t i = 0;
  while (i < bytes.size()) {
    if (bytes[i] != '\x1b') {
      if (is_single(bytes[i])) out.push_back(key_of(bytes[i]));
      ++i;
      continue;
    }
    if (i + 1 == bytes.size()) break;
    if (bytes[i + 1] != '[' && bytes[i + 1] != 'O') {
      ++i;
      continue;
    }
    std::size_t end = i + 2;  // parameters may stand before the last byte: \x1b[1;5A
    while (end < bytes.size() && (bytes[end] < '@' || bytes[end] > '~')) ++end;
    if (end == bytes.size()) break;
    if (const std::string arrow = arrow_of(bytes[end]); !arrow.empty()) out.push_back(arrow);
    i = end + 1;
  }
  bytes.erase(0, i);
  return out;
}

std::vector<TimedKey> parse_key_script(const std::string& text, const std::string& name) {
  static const std::vector<std::string> kNames = {"up", "down", "left", "right", "space", "c", "q", ",", "."};
  std::vector<TimedKey> out;
  std::stringstream stream(without_mark(text));
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    std::stringstream words(line.substr(0, line.find('#')));
    std::string time, key, more;
    if (!(words >> time)) continue;
    words >> key >> more;
    double at = 0;
    const auto [stop, error] = std::from_chars(time.data(), time.data() + time.size(), at);
    const std::size_t column = line.find(time) + 1, key_column = line.find(key, column - 1 + time.size()) + 1;
    const auto fail = [&](const std::string& message, std::size_t at) {
      throw InputError(fmt::format("{}:{}:{}: {}", name, number, at, message));
    };
    if (error != std::errc() || stop != time.data() + time.size() || !(at >= 0) || !std::isfinite(at)) {
      fail(fmt::format("'{}' is no time; a line is TIME KEY, as 0.5 up, with times in s >= 0", printable(time)),
           column);
    }
    if (key.size() == 1 && is_single(key[0])) key = key_of(key[0]);
    const bool known = chosen_by(key) || std::find(kNames.begin(), kNames.end(), key) != kNames.end();
    if (!known || !more.empty()) {
      const bool zooms = more.empty() && (key == "+" || key == "-");
      fail(zooms ? fmt::format("'{}' zooms the screen, and a script has none", key)
                 : fmt::format("'{}{}{}' is no key; a line is TIME KEY, and keys are {}, w a s d and 1 to 9",
                               printable(key), more.empty() ? "" : " ", printable(more), fmt::join(kNames, " ")),
           key_column);
    }
    if (!out.empty() && at < out.back().time) fail(fmt::format("time {} lies before the line above", time), column);
    out.push_back({at, key, fmt::format("{}:{}:{}", name, number, key_column)});
  }
  return out;
}

bool DriveWheel::press(std::string_view key) {
  const auto move = [](int& steps, int by, int most) { steps = std::clamp(steps + by, -most, most); };
  const int sideways = key == "left" ? 1 : -1;  // positive turn is to the left
  if (key == "up" || key == "down") {
    move(forward_, key == "up" ? 1 : -1, kMostSpeed);
  } else if (key == "left" || key == "right") {
    move(turn_, sideways, car_ ? kMostCurve : kMostTurn);
  } else if ((key == "," || key == ".") && !car_) {
    move(strafe_, key == "," ? 1 : -1, kMostSpeed);
  } else if (key == "space") {
    forward_ = strafe_ = turn_ = 0;
  } else if (key == "c") {
    car_ = !car_;
    strafe_ = turn_ = 0;
  } else {
    return false;
  }
  return true;
}

void DriveWheel::steer(double forward, double strafe, double turn) {
  const auto steps = [](double share, int most) {
    return static_cast<int>(std::lround(std::clamp(share, -1.0, 1.0) * most));
  };
  forward_ = steps(forward, kMostSpeed);
  strafe_ = car_ ? 0 : steps(strafe, kMostSpeed);
  turn_ = steps(turn, car_ ? kMostCurve : kMostTurn);
}

double DriveWheel::forward() const { return forward_ / kSpeedSteps; }
double DriveWheel::strafe() const { return strafe_ / kSpeedSteps; }
double DriveWheel::turn() const { return car_ ? turn_ / kCurveSteps * forward() : turn_ / kTurnSteps; }

std::optional<std::size_t> chosen_by(std::string_view key) {
  if (key.size() != 1 || key[0] < '1' || key[0] > '9') return std::nullopt;
  return static_cast<std::size_t>(key[0] - '1');
}

}  // namespace graze
