#include "scenarios/keys.h"

#include <cassert>

namespace graze {

const std::vector<std::string>& shape_names() {
  static const std::vector<std::string> names = {"plane",   "box",  "sphere",     "cylinder",
                                                 "capsule", "mesh", "heightfield"};
  return names;
}

const std::vector<std::string>& distribution_names() {
  static const std::vector<std::string> names = {"normal",     "uniform", "log_normal", "log_uniform",
                                                 "triangular", "choice",  "empirical"};
  return names;
}

namespace {

using Keys = std::vector<std::string>;

Keys operator+(Keys a, const Keys& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::map<std::string, Keys> world_keys() {
  return {
      {"scenario",
       {"graze", "name", "description", "robot", "environment", "gravity", "contact", "physics", "time", "actuators",
        "control", "uncertain", "sampling", "policies", "task", "record"}},
      {"robot", {"urdf", "base", "density", "package_path", "initial"}},
      {"initial",
       {"position", "rpy", "orientation", "height", "clearance", "velocity", "angular_velocity", "joints",
        "joint_velocities"}},
      {"object", shape_names() + Keys{"position", "rpy", "movable", "density", "mass", "friction", "restitution"}},
      {"cylinder", {"radius", "length"}},
      {"capsule", {"radius", "length"}},
      {"mesh", {"file", "scale"}},
      {"heightfield", {"csv", "heights", "size", "scale"}},
      {"contact", {"friction", "restitution", "model", "pairs", "ignore", "self_collision"}},
      {"pair", {"between", "friction", "restitution"}},
  };
}

std::map<std::string, Keys> spread_keys() {
  return {
      {"spread", distribution_names() + Keys{"jitter"}},
      {"axis", {"cone"}},
      {"cone", {"std"}},
      {"correlated", {"parameters", "correlation"}},
      {"normal", {"mean", "std", "min", "max"}},
      {"uniform", {"min", "max", "spread"}},
      {"log_normal", {"median", "log_std"}},
      {"log_uniform", {"min", "max"}},
      {"triangular", {"min", "mode", "max"}},
      {"choice", {"values", "weights"}},
      {"empirical", {"file", "column", "values", "unit"}},
      {"noise", {"density"}},
      {"sampling", {"design", "seed", "particles"}},
  };
}

std::map<std::string, Keys> run_keys() {
  return {
      {"time", {"end", "step", "control"}},
      {"actuators", {"torque_speed"}},
      {"control", {"lag"}},
      {"record", {"telemetry", "every", "last", "events"}},
      {"task", {"requirements", "measures", "objective", "stop_at_violation"}},
  };
}

std::map<std::string, Keys> witness_keys() {
  return {
      {"tilt", {"link", "below"}},
      {"height", {"link", "above", "below"}},
      {"position", {"link", "x", "y", "z"}},
      {"region", {"above", "below"}},
      {"speed", {"link", "below"}},
      {"gap", {"between", "within"}},
      {"contact_impulse", {"between", "below", "during"}},
      {"self_collision", {"within"}},
      {"joint_limits", {"joints", "margin"}},
      {"torque_limits", {"joints"}},
      {"torque_speed", {"joints"}},
      {"joint_speed", {"joints", "below"}},
  };
}

}  // namespace

const std::map<std::string, std::vector<std::string>>& scenario_keys() {
  static const auto all = [] {
    auto keys = world_keys();
    keys.merge(spread_keys());
    keys.merge(run_keys());
    keys.merge(witness_keys());
    return keys;
  }();
  return all;
}

const std::vector<std::string>& keys_of(const std::string& section) {
  const auto found = scenario_keys().find(section);
  assert(found != scenario_keys().end());
  return found->second;
}

}  // namespace graze
