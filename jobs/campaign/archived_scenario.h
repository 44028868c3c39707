#pragma once
// The scenario of a campaign, read again from the files that its archive keeps, by a program that computes the same.

#include <string>

#include "archive/archive.h"
#include "scenarios/scenario.h"

namespace graze {

/// Throws InputError unless this program produces the bits that the archive's program did; names both results versions.
/// `instead` ends the message: what the user can do ("resume it with that program, or run the scenario anew").
void check_results_version(const std::string& archive, const CampaignInfo& info, const std::string& instead);

/// Archives say themselves how long their traces are. Throws InputError if what is to be simulated anew has more
/// physics steps than take some minutes; `what`: "12 traces have".
void check_effort(double steps, const std::string& what);

/// While it is alive, every file that is read has the content that the archive kept of it, and no other exists
/// (policies read their tables anew whenever they are built). One at a time.
class ArchivedScenario {
 public:
  /// Throws InputError if the archive kept no files, which ends in `refusal` ("it cannot be resumed"), or if what it
  /// kept no longer reads as the scenario that was run.
  ArchivedScenario(const std::string& archive, const CampaignInfo& info, const std::string& refusal);
  const Scenario& scenario() const { return scenario_; }

 private:
  InputReplay inputs_;
  Scenario scenario_;
};

}  // namespace graze
