#include "analysis/plots.h"

namespace graze {

const std::vector<Picture>& pictures() {
  static const std::vector<Picture> all = {
      {"success", "success rates with intervals, by policy or over the parameter in which policies differ"},
      {"failures", "what failed, by policy"},
      {"margins", "how margins are distributed, by requirement, policy and outcome"},
      {"plan", "paths of the base from above"},
      {"side", "paths of the base from the side"},
      {"isometric", "paths of the base obliquely"},
      {"lapse", "robots as they stood every second, by policy"},
      {"channel", "a channel against time"},
      {"parameters", "particles over two parameters, or over one and a margin, by outcome"},
      {"survival", "how long traces last: Kaplan and Meier's curves"},
      {"tree", "the contacts at which behaviour divides"},
      {"causes", "which parameters matter, with p-values"}};
  return all;
}

}  // namespace graze
