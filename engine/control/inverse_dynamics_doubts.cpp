#include "engine/control/inverse_dynamics_doubts.h"

#include <fmt/format.h>

#include "engine/settings/warnings.h"

namespace graze {

void doubt_gains(const Model& model, const Described& own, const std::vector<double>& kp, const std::vector<double>& kd,
                 double period) {
  for (std::size_t k = 0; k < kp.size(); ++k) {
    const double most_kd = 2 / period, most_kp = (4 / period - 2 * kd[k]) / period;
    const bool damps = kd[k] > most_kd;
    if (!damps && kp[k] <= most_kp) continue;
    warn(own.at(damps ? "kd" : "kp"),
         fmt::format(
             "{:g} 1/s{} of joint {}: with a control step h of {:g} s its errors grow from step to step; less "
             "than {}",
             damps ? kd[k] : kp[k], damps ? "" : "^2", model.bodies[model.actuated[k]].joint, period,
             damps ? fmt::format("2/h = {:g} 1/s", most_kd) : fmt::format("4/h^2 - 2 kd/h = {:g} 1/s^2", most_kp)));
    return;
  }
}

void doubt_efforts(const Model& model, const Described& own) {
  constexpr double kNone = 1e9;  // what repairs write
  std::vector<std::string> unbound;
  for (const int body : model.actuated) {
    if (model.bodies[body].effort >= kNone) unbound.push_back(model.bodies[body].joint);
  }
  if (unbound.empty()) return;
  warn(own.settings(),
       fmt::format("{} of {} joints have no limit of torque ({}{}): nothing bounds what is asked of them "
                   "where contacts contradict it; give each an effort in the URDF",
                   unbound.size(), model.na(), unbound.front(), unbound.size() > 1 ? ", …" : ""));
}

}  // namespace graze
