#pragma once
// The sensor and actuator channels of a robot (Figure 15, and the contact flags' mistakes, which it does not have):
// described here, and listed by channel_names() (engine/model/world.h).

#include <string>
#include <vector>

#include "engine/settings/description.h"

namespace graze {

/// Channels of one sensor. The keys of its description are their paths, in which JOINT or LINK stands for a name.
struct ChannelFamily {
  enum class Of { joint, link, base };
  std::string name;  // "encoder"
  Of of;             // what a channel is one of; a robot that is bolted down has none of its base
  Description text;
};

/// In the order of channel_names().
const std::vector<ChannelFamily>& channel_families();

}  // namespace graze
