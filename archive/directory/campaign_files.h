#pragma once
// From a path to an opened campaign: which files it is made of, all of them checked.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "archive/files/seal.h"
#include "archive/schema/info.h"
#include "archive/schema/part.h"

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

/// Whether every trace that the campaign is to have is there. Needs the library's lock. Throws InputError as
/// scan_traces().
bool holds_all(Parts& parts, const CampaignInfo& info);

/// What makes two campaigns different ones ("seeds (1 and 2)"); empty: they are parts of one.
std::string campaign_difference(const CampaignInfo& a, const CampaignInfo& b);

/// That a folder is no campaign, and which one within it may be meant: sweeps are folders of campaigns.
std::string no_campaign_text(const Directory& directory);

/// The facts of a campaign directory alone, for writers; its shards need not be whole. Throws InputError.
CampaignInfo read_description(const Directory& directory);

/// One of the two files that describe a campaign directory, as a repair finds it: `graze resume`, and `graze
/// verify`, which foretells what that does.
struct DescriptionFile {
  std::string name;
  bool there = true;
  bool unreadable = false;                // the system does not give it; it may be whole
  std::optional<StoredInfo> stored = {};  // nothing: it is of no use
  std::string why = {};                   // it is of no use, without the file's name
  /// Whether it has to be put aside.
  bool in_the_way() const { return there && !unreadable && !stored; }
};
/// Both, the one that is asked first in front. A child reads each before this process does.
std::vector<DescriptionFile> description_files(const Directory& directory);
/// What the first of use says. Throws InputError if there is none, with what can be done.
CampaignInfo described_by(const Directory& directory, const std::vector<DescriptionFile>& files);

/// What the list of unfinished traces is, if it is no file ("is a named pipe"); empty: a file, or not there.
std::string why_no_list(const Directory& directory);
/// What is wrong with the lock that no process holds, a whole message: another name of it lies elsewhere; empty:
/// nothing.
std::string lock_fault(const Directory& directory);
/// What stands in the place of a description or of the list of unfinished traces, and is none, goes into damaged/, so
/// that it can be written anew. Returns a sentence for each, and for what is not there. Needs the directory's lock.
/// Throws InputError, MachineError.
std::vector<std::string> clear_places(const Directory& directory, const std::vector<DescriptionFile>& files);

}  // namespace graze
