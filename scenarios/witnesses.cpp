#include "scenarios/witnesses.h"

namespace graze {

const std::vector<WitnessKind>& witness_kinds() {
  static const std::vector<WitnessKind> kinds = {
      {"tilt", read_tilt},
      {"height", read_height},
      {"position", read_position},
      {"speed", read_speed},
      {"contact", read_contact},
      {"no_contact", read_no_contact},
      {"contact_impulse", read_contact_impulse},
      {"self_collision", read_self_collision},
      {"joint_limits", read_joint_limits},
      {"torque_limits", read_torque_limits},
      {"torque_speed", read_torque_speed},
      {"joint_speed", read_joint_speed},
  };
  return kinds;
}

std::vector<std::string> witness_names() {
  std::vector<std::string> out;
  for (const WitnessKind& kind : witness_kinds()) out.push_back(kind.name);
  return out;
}

}  // namespace graze
