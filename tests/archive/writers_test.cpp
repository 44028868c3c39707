// What writers share: the queue of shards, the list of unfinished traces, the lock, the folder for what is damaged.
#include <gmock/gmock.h>

#include <atomic>
#include <semaphore>
#include <thread>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/damaged.h"
#include "archive/directory/finished.h"
#include "archive/directory/shard_queue.h"
#include "tests/archive/compare.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
namespace fs = std::filesystem;

/// A shard that is told by its number of (empty) traces.
ShardBuffer numbered(std::size_t traces) {
  ShardBuffer buffer(1);
  buffer.add(0, std::vector<TraceRecord>(traces), {}, 0);
  return buffer;
}

// Claim: shards are written one after the other in their order; drain() returns when all are, the end writes what
// waits.
TEST(ShardQueue, WritesAllInOrder) {
  std::vector<std::size_t> written;
  std::counting_semaphore<8> go(0);
  {
    ShardQueue queue([&](const ShardBuffer& shard) {
      go.acquire();
      written.push_back(shard.bytes() / sizeof(TraceRecord));
    });
    go.release(3);
    for (const std::size_t i : {1u, 2u, 3u}) queue.push(numbered(i));
    queue.drain();
    EXPECT_THAT(written, ElementsAre(1u, 2u, 3u));
    queue.push(numbered(4));
    queue.push(numbered(5));  // waits while the fourth is written
    std::atomic<bool> pushed = false;
    std::thread third([&] {
      queue.push(numbered(6));
      pushed = true;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    EXPECT_FALSE(pushed) << "memory would grow";
    go.release(2);
    third.join();
    go.release(1);
  }
  EXPECT_THAT(written, ElementsAre(1u, 2u, 3u, 4u, 5u, 6u));
}

// Claim: a failure is told once, and nothing is written after it.
TEST(ShardQueue, TellsAFailureOnce) {
  int tried = 0;
  {
    ShardQueue queue([&](const ShardBuffer&) {
      ++tried;
      throw MachineError("disk full");
    });
    queue.push(numbered(1));
    EXPECT_THAT(message_of<MachineError>([&] { queue.drain(); }), "disk full");
    EXPECT_TRUE(queue.failed());
    EXPECT_NO_THROW(queue.drain());
    EXPECT_NO_THROW(queue.push(numbered(2)));
    EXPECT_NO_THROW(queue.drain());
  }
  EXPECT_EQ(tried, 1);
}

// Claim: drain() waits for the shard that is being written.
TEST(ShardQueue, DrainWaitsForTheLast) {
  std::atomic<bool> done = false;
  ShardQueue queue([&](const ShardBuffer&) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    done = true;
  });
  queue.push(numbered(1));
  queue.drain();
  EXPECT_TRUE(done);
}

// Claim: the list of unfinished traces is in order, each once with its first reason; broken lines cost only themselves,
// and what is noted after a line that was cut off is noted all the same.
TEST(Unfinished, ListsEachTraceOnceInOrder) {
  const Folder folder;
  const Directory directory(folder.path());
  EXPECT_TRUE(read_unfinished(directory).empty());
  EXPECT_NO_THROW(forget_unfinished(directory));
  add_unfinished(directory, {"step", 7, "timeout \xff"});
  add_unfinished(directory, {"hold", 9, "out of memory"});
  add_unfinished(directory, {"hold", 4, "timeout"});
  std::ofstream(folder / kUnfinishedFile, std::ios::app)
      << "[1]\n12\n{\"policy\": 3, \"particle\": 1, \"reason\": \"\"}\n{\"policy\": \"hold\", \"parti";
  add_unfinished(directory, {"hold", 5, "after a torn line"});
  add_unfinished(directory, {"hold", 9, "again"});
  std::vector<std::string> got;
  for (const UnfinishedTrace& one : read_unfinished(directory)) {
    got.push_back(one.policy + " " + std::to_string(one.particle) + " " + one.reason);
  }
  EXPECT_THAT(got, ElementsAre("hold 4 timeout", "hold 5 after a torn line", "hold 9 out of memory",
                               "step 7 timeout \xEF\xBF\xBD"));
  forget_unfinished(directory);
  EXPECT_FALSE(fs::exists(folder / kUnfinishedFile));
}

// Claim: who writes is told, in full and with nothing of who was there before; when they have gone, nobody is.
TEST(Lock, TellsWhoWrites) {
  const Folder folder;
  const Directory directory(folder.path());
  EXPECT_FALSE(writer_of(directory));
  put(folder / kLockFile, std::string(200, 'x'));
  EXPECT_FALSE(writer_of(directory)) << "a file that is left over locks nobody out";
  {
    const DirectoryLock lock(directory);
    EXPECT_THAT(writer_of(directory).value_or(""),
                MatchesRegex("process " + std::to_string(getpid()) +
                             " on [^ ]+ since [0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}Z"));
    EXPECT_EQ(writer_of(directory), content(folder / kLockFile));
    fs::resize_file(folder / kLockFile, 0);
    EXPECT_EQ(writer_of(directory), "an unknown process");
    EXPECT_TRUE(lock.held());
  }
  EXPECT_FALSE(fs::exists(folder / kLockFile));
  EXPECT_THAT(message_of<MachineError>([&] { const MemberLock member(directory); }),
              HasSubstr("lock: cannot be written: No such file or directory"));
}

// Claim: what is put aside takes nothing's place there.
TEST(Damaged, KeepsAllThatWasPutAside) {
  const Folder folder;
  const Directory directory(folder.path()), shards = directory.make(kShardFolder);
  for (const char* text : {"first", "second", "third"}) {
    put(folder / "shards/000001.h5", text);
    put_aside(directory, shards, "000001.h5");
  }
  EXPECT_TRUE(shards.names().empty());
  EXPECT_EQ(content(folder / "damaged/000001.h5"), "first");
  EXPECT_EQ(content(folder / "damaged/000001.1.h5"), "second");
  EXPECT_EQ(content(folder / "damaged/000001.2.h5"), "third");
  EXPECT_EQ(why_not_put_aside(directory), "");
  fs::remove_all(folder / "damaged");
  put(folder / "damaged", "");
  EXPECT_THAT(why_not_put_aside(directory), HasSubstr("only a directory may have this name"));
}

// Claim: a trace that stands in two shards is finished once; whoever asks beyond the last one gets no.
TEST(Finished, CountsEachTraceOnce) {
  const Folder folder;
  const CampaignInfo facts = info();
  {
    CampaignDirectory directory(folder / "a.graze", facts, false);
    for (const std::uint32_t first : {0u, 5u}) {
      ShardBuffer buffer(facts.policies.size());
      Block one = block(facts, 0, range(first, first + 8));
      buffer.add(0, std::move(one.traces), one.values, facts.parameters.size());
      directory.add_shard(std::move(buffer));
    }
  }
  EXPECT_EQ(traces_kept(folder / "a.graze", facts), 16u);
  const FinishedTraces finished = repair_and_list(folder / "a.graze", facts);
  EXPECT_EQ(finished.count, 13u);
  EXPECT_TRUE(finished.has("step/1cm", 12));
  for (const std::uint64_t beyond : {13u, 14u, 4000u}) EXPECT_FALSE(finished.has("step/1cm", beyond));
  EXPECT_FALSE(finished.has("hold", 0));
}

// Claim: a shard whose seal fits and whose outcomes cannot be, or that is another campaign's, is put aside and told.
TEST(Finished, PutsAsideWhatCannotBe) {
  const Folder folder;
  CampaignInfo facts = info();
  facts.particles = 8;
  write(folder / "a.graze", facts);
  CampaignInfo other = facts;
  other.seed = 1;
  write(folder / "b.graze", other);
  fs::copy(folder / "b.graze/shards/000001.h5", folder / "a.graze/shards/000002.h5");
  CampaignInfo wider = facts;
  wider.requirements.push_back({"third", "", "m"});
  {
    CampaignWriter writer(folder / "c.graze", wider, false);
    Block one = block(wider, 0, range(0, 8));
    writer.append(0, std::move(one.traces), std::move(one.values));
    writer.finish();
  }
  fs::copy(folder / "c.graze/shards/000001.h5", folder / "a.graze/shards/000003.h5");
  const FinishedTraces finished = repair_and_list(folder / "a.graze", facts);
  EXPECT_EQ(finished.count, 24u);
  ASSERT_EQ(finished.notes.size(), 2u);
  EXPECT_THAT(finished.notes[0], HasSubstr("000002.h5: belongs to another campaign"));
  EXPECT_THAT(finished.notes[1], HasSubstr("000003.h5: dataset 'traces/step/1cm/margin"));
  EXPECT_THAT(shard_names(folder / "a.graze"), ElementsAre("000001.h5"));
}

}  // namespace
}  // namespace graze
