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

TEST(HandOut, UnitsAreEvenWhereTheyAreFew) {
  EXPECT_EQ(even_unit(40, 1, 2, 8), 7u);  // 6 units, 3 for each worker
  EXPECT_EQ(even_unit(40, 2, 2, 8), 8u);  // 10 units, 5 each
  EXPECT_EQ(even_unit(41, 1, 4, 8), 6u);  // 7 units of which one would be alone; a full block would be alone, too
  EXPECT_EQ(even_unit(8, 1, 2, 8), 4u);   // half a block each
  EXPECT_EQ(even_unit(8, 1, 64, 8), 4u);  // no less: lanes cost the same whether they are busy or not
  EXPECT_EQ(even_unit(3, 1, 2, 8), 4u);   // all of them in one unit
  EXPECT_EQ(even_unit(4000, 1, 2, 8), 8u);
  EXPECT_EQ(even_unit(0, 1, 2, 8), 8u);
  for (const std::uint64_t particles : {1, 5, 17, 40, 100, 333}) {
    for (const std::uint64_t policies : {1, 2, 3, 5}) {
      for (const std::uint64_t workers : {1, 2, 3, 7, 64}) {
        const auto rounds = [&](std::uint64_t unit) {
          const std::uint64_t units = (particles + unit - 1) / unit * policies;
          return (units + workers - 1) / workers;
        };
        const std::uint64_t unit = even_unit(particles, policies, workers, 8);
        EXPECT_EQ(rounds(unit), rounds(8)) << particles << " particles, " << policies << " policies, " << workers;
      }
    }
  }
}

}  // namespace
}  // namespace graze
