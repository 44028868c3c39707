#pragma once
// Names in a campaign directory.

namespace graze {

inline constexpr const char* kDescriptionFile = "campaign.h5";
inline constexpr const char* kDescriptionCopy = "campaign.copy.h5";  // for when the first is damaged or gone
inline constexpr const char* kShardFolder = "shards";
inline constexpr const char* kDamagedFolder = "damaged";  // what could not be read, or was no file

}  // namespace graze
