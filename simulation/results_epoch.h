#pragma once
// Which results this program computes. Campaigns are resumed and replayed only by programs of the same epoch, because
// their traces are the same bits; so the epoch is raised by hand, by one, in the commit that moves a bit of any trace,
// and in no other. tests/jobs/golden_digest_test.cpp fails when results have moved, and says so.

#include <string>

namespace graze {

/// What moved results, by epoch:
///   1  the first that is counted; before it, archives tell a hash of the sources ("0.1.0+3f2ac1b09d4e")
///   2  sines, exponentials and the like no longer come from the C library
///   3  contact sequences are those of contact phases; servos on `bullet` round their damping otherwise
inline constexpr int kResultsEpoch = 3;

/// Names what this program computes, for archives and messages ("epoch 3"): programs of the same results version give
/// the same bits.
inline std::string results_version() { return "epoch " + std::to_string(kResultsEpoch); }

}  // namespace graze
