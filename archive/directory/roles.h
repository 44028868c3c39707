#pragma once
// How a process comes to write into a campaign directory that it does not make.

#include <memory>

namespace graze {

class DirectoryLock;

/// It takes up the campaign in an existing directory. `lock`: of that directory, if it is held already.
struct ExistingCampaign {
  std::shared_ptr<const DirectoryLock> lock = nullptr;
};

/// Another process has made or taken up the campaign and holds its lock; this one adds shards under its own name,
/// numbered from `shards` + 1 on. With many ranks each writes less often, so that all together write no more than 500
/// shards per second.
struct CampaignMember {
  int rank, shards, ranks;
};

}  // namespace graze
