#pragma once
// How several ranks come to work on one campaign: rank 0 reads the command line, makes or takes up the directory and
// briefs the others, which read everything else from there. Each rank writes shards of its own.

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "archive/directory/finished.h"
#include "jobs/campaign/campaign.h"

namespace graze {

/// What rank 0 tells the others before all begin.
struct Briefing {
  std::string directory;  // absolute
  std::uint64_t particles = 0, workers = 0;
  double watchdog = 0;                                // s
  int shards = 0;                                     // highest number of a shard that is there
  std::map<std::string, std::vector<bool>> finished;  // as FinishedTraces::done

  std::string to_text() const;  // MessagePack
  static Briefing from_text(const std::string& text);
};

/// Rank 0's side: the others wait for a word. If this is destroyed before it was given, they are sent home.
class Start {
 public:
  explicit Start(Communicator& comm) : comm_(comm) {}
  ~Start();
  Start(const Start&) = delete;
  Start& operator=(const Start&) = delete;
  void give(const Briefing& briefing);
  Communicator& comm() const { return comm_; }

 private:
  Communicator& comm_;
  bool given_ = false;
};

/// All other ranks' side: waits for the briefing, simulates until there is nothing left, waits for the others. Returns
/// the exit code. `threads` as in CampaignOptions.
int assist(Communicator& comm, int threads);

/// What all ranks set in the options: the traces that are there already, signals, where unfinished ones are noted.
/// `writer` and `finished` outlive the options.
void set_out(CampaignOptions& options, CampaignWriter& writer, const FinishedTraces& finished);

/// Runs this rank's share into its writer and writes all of it.
CampaignEnd run_share(const Scenario& scenario, const CampaignOptions& options, Communicator& comm,
                      CampaignWriter& writer);

/// Does a share that may fail without leaving the other ranks waiting: an exception becomes the end's error and stops
/// them. Returns when all ranks are through.
CampaignEnd together(Communicator& comm, const std::function<CampaignEnd()>& share);

/// Takes leave of the other ranks and of the process, whose hanging threads use what would be taken down otherwise.
[[noreturn]] void leave_hanging(Communicator& comm, int exit_code);

}  // namespace graze
