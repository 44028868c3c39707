// Claim: tickets stand for every unit of work exactly once, in rising order, for any numbers of units and workers; few
// are needed, and towards the end they are small.
#include "jobs/campaign/hand_out.h"

#include <gtest/gtest.h>

namespace graze {
namespace {

TEST(HandOut, CoversEveryUnitOnce) {
  for (const std::uint64_t units : {0, 1, 7, 64, 1000, 12345}) {
    for (const std::uint64_t workers : {1, 2, 7, 64, 20000}) {
      for (const std::uint64_t most : {1, 3, 16}) {
        const HandOut hand_out(units, workers, most);
        std::uint64_t next = 0, ticket = 0;
        for (; !hand_out.range(ticket).empty(); ++ticket) {
          ASSERT_EQ(hand_out.range(ticket).begin, next);
          ASSERT_LE(hand_out.range(ticket).end - next, most);
          next = hand_out.range(ticket).end;
        }
        ASSERT_EQ(next, units) << units << " units, " << workers << " workers, " << most;
        EXPECT_TRUE(hand_out.range(ticket + 1000).empty());
        EXPECT_TRUE(hand_out.range(~std::uint64_t{0}).empty());
      }
    }
  }
}

TEST(HandOut, TicketsAreFewAndTheLastOnesSmall) {
  const std::uint64_t units = 1'000'000, workers = 100, most = 16;
  const HandOut hand_out(units, workers, most);
  std::uint64_t tickets = 0;
  while (!hand_out.range(tickets).empty()) ++tickets;
  // All but the rounds of the end are of the largest size; each of those hands out half of what is left.
  EXPECT_LT(tickets, units / most + 6 * workers);
  for (std::uint64_t i = 1; i <= workers; ++i) {
    const HandOut::Range last = hand_out.range(tickets - i);
    EXPECT_EQ(last.end - last.begin, 1u);
  }
}

}  // namespace
}  // namespace graze
