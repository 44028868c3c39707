#pragma once
// Which results this program computes. Campaigns are resumed and replayed only by programs of the same epoch, because
// their traces are the same bits. The rule, for those who change results:
//   - The bits of an epoch that was released never move. The commit that moves one raises the epoch by hand, by one.
//   - An epoch that was not released yet may move; the commit that does it says so and renews the golden digests.
// tests/jobs/golden_digest_test.cpp fails when results have moved, and says which of the two is to be done.

#include <string>

namespace graze {

/// What moved results, by epoch:
///   1  the first that is counted; before it, archives tell a hash of the sources ("0.1.0+3f2ac1b09d4e")
///   2  sines, exponentials and the like no longer come from the C library
///   3  contact sequences are those of contact phases; servos on `bullet` round their damping otherwise
///   4  Newton's method finishes the contact solves that sweeps do not
///   5  and does so for each lane by itself: the same impulses to its tolerance, other bits
///   6  contact solves end at changes of 3e-7 m/s instead of 1e-6, so that less than 1e-6 is left of the laws
inline constexpr int kResultsEpoch = 6;

/// The last epoch that a release of this program has had; 0: none. A release sets it to kResultsEpoch.
inline constexpr int kReleasedEpoch = 0;
static_assert(kReleasedEpoch <= kResultsEpoch);

/// Names what this program computes, for archives and messages ("epoch 3"): programs of the same results version give
/// the same bits.
inline std::string results_version() { return "epoch " + std::to_string(kResultsEpoch); }

}  // namespace graze
