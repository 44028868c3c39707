#pragma once
// A first scenario for a robot that has none: what `graze new` writes.

#include <functional>
#include <string>

namespace graze {

struct ProposalRequest {
  std::string urdf;     // as the scenario is to name it, relative to `file`
  std::string file;     // where the scenario will stand
  bool repair = false;  // robot.repair
  bool ignore_missing_meshes = false;
  std::function<void(const std::string&)> warn = {};  // called with one line if four limbs got no trot, and why
};

/// The text of a scenario in which the robot is dropped from 2 cm, holds its joints and, if it stands on four legs of
/// three joints or more, trots. It has comments on what can be changed, and has been read: it runs. Throws InputError
/// if the robot cannot be read, or with refused_proposal() if the text is refused.
std::string propose_scenario(const ProposalRequest& request);

/// What is said if what was proposed is refused by its own reading, with `refusal`: that it is our defect, without the
/// place in a file that is not there. A refusal of another file, the robot's, stays as it is.
std::string refused_proposal(const ProposalRequest& request, const std::string& refusal);

/// How the joints of such a scenario are held: stiff enough for the robot's own weight and size.
struct HoldGains {
  double stiffness;  // N m/rad (N/m of sliding joints)
  double damping;    // N m s/rad (N s/m), of the servos
};
HoldGains propose_hold(const ProposalRequest& request);

}  // namespace graze
