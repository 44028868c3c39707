#pragma once
// The facts of a campaign, in the file that describes it: root attributes and the groups /parameters, /requirements,
// /policies and /names.

#include <string>

#include "archive/hdf5/hdf5.h"
#include "archive/schema/campaign_info.h"

namespace graze {

enum class Layout { directory, packed };

/// Throws InputError unless each policy's name can be the path of a group: no empty component, no "." or "..", and no
/// policy inside another's.
void check_policy_names(const std::vector<std::string>& policies);

void write_info_attributes(const hdf5::Handle& file, const CampaignInfo& info, Layout layout, bool complete);
/// Attributes and groups.
void write_info(const hdf5::Handle& file, const CampaignInfo& info, Layout layout, bool complete);

struct StoredInfo {
  CampaignInfo info;
  Layout layout;
  bool complete;
};
/// Throws hdf5::Error.
StoredInfo read_info(const hdf5::Handle& file);

/// What an intact file is, if it is none that holds a whole campaign: "is one shard of a campaign; give the campaign's
/// directory". Empty: it is one. Throws hdf5::Error.
std::string why_no_campaign(const hdf5::Handle& file);

/// "has format version 7, newer than version 1, …" of a description or a shard; empty: this program knows its format.
/// Throws hdf5::Error.
std::string newer_format(const hdf5::Handle& file);

/// What binds a shard to its campaign: root attributes of the shard.
void write_shard_identity(const hdf5::Handle& file, const CampaignInfo& info);
/// Throws hdf5::Error unless the shard belongs to the campaign.
void check_shard_identity(const hdf5::Handle& file, const CampaignInfo& info);

}  // namespace graze
