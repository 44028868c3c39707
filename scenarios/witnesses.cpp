#include "scenarios/witnesses.h"

namespace graze {

const std::vector<WitnessKind>& witness_kinds() {
  static const std::vector<WitnessKind> kinds = {
      {"tilt", "angle of a link's z axis from the vertical stays below a bound", read_tilt},
      {"height", "z of a link's origin stays above or below a bound", read_height},
      {"position", "a link's origin stays in a region", read_position},
      {"speed", "a link's origin stays slower than a bound", read_speed},
      {"contact", "two parts touch", read_contact},
      {"no_contact", "two parts do not touch; its margin is the gap between them", read_no_contact},
      {"contact_impulse", "no contact of two parts has a larger normal impulse than a bound", read_contact_impulse},
      {"self_collision", "the robot's parts that are not neighbours do not touch each other", read_self_collision},
      {"joint_limits", "joints stay within their position limits, less a margin", read_joint_limits},
      {"torque_limits", "no more torque is demanded of joints than their actuators have", read_torque_limits},
      {"torque_speed", "joints stay below their motors' linear torque-speed line", read_torque_speed},
      {"joint_speed", "joints stay slower than a bound, by default the URDF's", read_joint_speed},
  };
  return kinds;
}

std::vector<std::string> witness_names() {
  std::vector<std::string> out;
  for (const WitnessKind& kind : witness_kinds()) out.push_back(kind.name);
  return out;
}

}  // namespace graze
