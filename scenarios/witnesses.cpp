#include "scenarios/witnesses.h"

namespace graze {

const std::vector<WitnessKind>& witness_kinds() {
  static const std::vector<WitnessKind> all = [] {
    std::vector<WitnessKind> kinds;
    for (const auto list : {motion_witnesses, contact_witnesses, impulse_witnesses, force_witnesses, joint_witnesses}) {
      for (WitnessKind& kind : list()) kinds.push_back(std::move(kind));
    }
    return with_registered(std::move(kinds));
  }();
  return all;
}

std::vector<std::string> witness_names() { return names_of(witness_kinds()); }

}  // namespace graze
