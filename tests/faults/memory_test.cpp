// Claim: whichever allocation of memory fails, once or with all after it, the verb ends with a message and an exit
// code, or the particle is left unfinished; never by a signal, and it never hangs. What was on the disk stays whole.
#include <gmock/gmock.h>

#include <unordered_set>

#include "tests/faults/stage.h"

namespace graze::faults {
namespace {

using testing::Digests;

struct MemoryVerb {
  std::string name, arguments;
};

void PrintTo(const MemoryVerb& verb, std::ostream* out) { *out << verb.arguments; }

/// The first allocation of each call path that allocates; so many of them, spread evenly.
std::vector<long> allocations_to_fail(const Outcome& good, long most) {
  std::unordered_set<std::uint64_t> seen;
  std::vector<long> first;
  for (std::size_t i = 0; i < good.call_paths.size(); ++i) {
    if (seen.insert(good.call_paths[i]).second) first.push_back(static_cast<long>(i) + 1);
  }
  std::vector<long> out;
  for (const long k : some_of(static_cast<long>(first.size()), most)) out.push_back(first[k - 1]);
  return out;
}

class Memory : public ::testing::TestWithParam<MemoryVerb> {
 protected:
  void trials(bool for_good, long most) {
    if (!can_exhaust_memory()) GTEST_SKIP() << "a sanitizer has its own malloc";
    const Stage stage;
    stage.must("run ball.yaml -n 16 --threads 1 --quiet -o a.graze");
    stage.must("pack a.graze -o a.h5");
    const Tree before = tree_of(stage.folder());
    const Digests digests = stage.whole("a.graze");
    Plan plan;
    plan.paths = true;
    const Outcome good = run(stage.folder(), GetParam().arguments, plan);
    ASSERT_EQ(good.code, 0) << good.err;
    const std::vector<long> chosen = allocations_to_fail(good, most);
    ASSERT_GE(chosen.size(), 8u) << "hardly any call path is tried";
    std::printf("%s: %ld allocations, %zu of their call paths tried\n", GetParam().name.c_str(), good.allocations,
                chosen.size());
    plan = {};
    plan.for_good = for_good;
    for (const long allocation : chosen) {
      put(before, stage.folder());
      plan.allocation = allocation;
      const Outcome outcome = run(stage.folder(), GetParam().arguments, plan);
      SCOPED_TRACE(GetParam().name + ": allocation " + std::to_string(allocation) + " of " +
                   std::to_string(good.allocations) + " fails" + (for_good ? " for good" : "") + ": exit code " +
                   std::to_string(outcome.code) + "\n" + outcome.err);
      EXPECT_TRUE(outcome.code == 0 || outcome.code == 3 || outcome.code == 2);
      if (outcome.code != 0) {
        EXPECT_THAT(outcome.err, ::testing::HasSubstr("graze: "));
      }
      if (outcome.code != 0 && GetParam().name == "resume") stage.must("resume a.graze --threads 1 --quiet");
      EXPECT_EQ(stage.whole("a.graze"), digests);
      EXPECT_EQ(stage.whole("a.h5"), digests);
      if (outcome.code == 0 && GetParam().name == "pack") {
        EXPECT_EQ(stage.whole("b.h5"), digests);  // its size may differ: HDF5 frees less of its own space
        stage.must("verify b.h5");
      } else if (outcome.code == 0 && GetParam().arguments.find("run") != 0) {
        EXPECT_EQ(outcome.out, good.out);
      }
      if (fs::exists(stage / "b.graze/campaign.h5")) {
        const Outcome resumed = run(stage.folder(), "resume b.graze --threads 1 --quiet");
        EXPECT_EQ(resumed.code, 0) << resumed.err;
        EXPECT_EQ(stage.whole("b.graze"), digests);
      }
    }
  }
};

TEST_P(Memory, EachAllocationFailsOnce) { trials(false, 20); }
TEST_P(Memory, EachAllocationAndAllAfterItFail) { trials(true, 8); }

INSTANTIATE_TEST_SUITE_P(
    Verbs, Memory,
    ::testing::Values(MemoryVerb{"score", "score a.graze"}, MemoryVerb{"score_file", "score a.h5 --json"},
                      MemoryVerb{"status", "status a.graze"}, MemoryVerb{"pack", "pack a.graze -o b.h5"},
                      MemoryVerb{"check", "check ball.yaml"}, MemoryVerb{"sample", "sample ball.yaml -n 9"},
                      MemoryVerb{"replay", "replay a.graze --particle 5"},
                      MemoryVerb{"run", "run ball.yaml -n 16 --threads 1 --quiet -o b.graze"},
                      MemoryVerb{"resume", "resume a.graze --threads 1 --quiet"}),
    [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace graze::faults
