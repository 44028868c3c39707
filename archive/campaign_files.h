#pragma once
// From a path to an opened campaign: which files it is made of, all of them checked.

#include <filesystem>
#include <vector>

#include "archive/info.h"
#include "archive/part.h"

namespace graze {

struct CampaignFiles {
  StoredInfo stored;
  Parts parts;
  std::vector<std::string> warnings;  // what readers should tell, a sentence each
};

inline constexpr int kInShards = 2;  // names of a shard's path that are within the campaign directory

/// A campaign directory or a packed file. Checks the seals of all files and that the shards belong to the campaign
/// (unless they are trusted). Takes the library's lock. Throws InputError.
CampaignFiles open_campaign(const std::filesystem::path& path, Seals seals = Seals::checked);
/// Directories that hold parts of one campaign, as if they were one. Throws InputError if they are not.
CampaignFiles open_parts(const std::vector<std::filesystem::path>& directories);

/// The facts of a campaign directory alone; its shards need not be whole. Throws InputError.
CampaignInfo read_description(const Directory& directory, std::vector<std::string>* warnings = nullptr);

}  // namespace graze
