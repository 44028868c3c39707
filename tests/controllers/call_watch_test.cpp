// Claim: a call into a library of this process that does not come back within its limit is told, by its name and time,
// whichever thread it is of; calls that come back are not, however many there are.
#include "engine/library/call_watch.h"

#include <gtest/gtest.h>

#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

namespace graze {
namespace {

using namespace std::chrono_literals;

/// What a watch has told. In the program its handler ends the process; this one comes back, and is called again.
struct Told {
  std::mutex mutex;
  std::vector<LibraryCallHere> calls;

  CallWatch watch() {
    return CallWatch([this](const LibraryCallHere& call) {
      const std::lock_guard lock(mutex);
      calls.push_back(call);
    });
  }
  std::vector<LibraryCallHere> all() {
    const std::lock_guard lock(mutex);
    return calls;
  }
};

/// In a call for so long.
void call_for(std::chrono::milliseconds time, double limit, LibraryCall which = LibraryCall::act, double at = 0.5) {
  show_call_here({which, at, "slow.so", limit});
  std::this_thread::sleep_for(time);
  show_call_here({});
}

TEST(CallWatch, ThreadsKnowTheirOwnCall) {
  EXPECT_EQ(library_call_here().call, LibraryCall::none);
  show_call_here({LibraryCall::start, 0.25, "walk.so", 10});
  std::thread([] { EXPECT_EQ(library_call_here().call, LibraryCall::none); }).join();
  const LibraryCallHere here = library_call_here();
  EXPECT_EQ(here.call, LibraryCall::start);
  EXPECT_EQ(here.time, 0.25);
  EXPECT_STREQ(here.file, "walk.so");
  EXPECT_EQ(here.limit, 10);
  show_call_here({});
  EXPECT_EQ(library_call_here().call, LibraryCall::none);
}

TEST(CallWatch, TellsOfACallThatStays) {
  Told told;
  const CallWatch watch = told.watch();
  call_for(1000ms, 0.2, LibraryCall::start, 0.75);
  const std::vector<LibraryCallHere> all = told.all();
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all.front().call, LibraryCall::start);
  EXPECT_EQ(all.front().time, 0.75);
  EXPECT_STREQ(all.front().file, "slow.so");
  EXPECT_EQ(all.front().limit, 0.2);
}

// Many short calls one after the other are longer together than any may be.
TEST(CallWatch, CallsThatComeBackAreNotTold) {
  Told told;
  const CallWatch watch = told.watch();
  for (int k = 0; k < 40; ++k) call_for(20ms, 0.5);
  call_for(100ms, 30);
  std::this_thread::sleep_for(300ms);  // nothing is called at all
  EXPECT_TRUE(told.all().empty());
}

TEST(CallWatch, EachThreadHasItsOwnLimit) {
  Told told;
  {
    const CallWatch watch = told.watch();
    std::vector<std::thread> threads;
    for (int k = 0; k < 4; ++k) {
      threads.emplace_back([k] { call_for(800ms, k == 2 ? 0.2 : 60, LibraryCall::act, k); });
    }
    for (std::thread& one : threads) one.join();
  }
  const std::vector<LibraryCallHere> all = told.all();
  ASSERT_FALSE(all.empty());
  for (const LibraryCallHere& one : all) EXPECT_EQ(one.time, 2);
}

// A thread that ends takes its place along: nobody looks at what is no more, and another may get its address.
TEST(CallWatch, ThreadsComeAndGo) {
  Told told;
  const CallWatch watch = told.watch();
  for (int k = 0; k < 200; ++k) {
    std::thread([] { show_call_here({LibraryCall::act, 0, "gone.so", 0.2}); }).join();  // it ends within a call
    if (k % 40 == 0) std::this_thread::sleep_for(60ms);
  }
  EXPECT_TRUE(told.all().empty());
}

TEST(CallWatch, EndsAtOnce) {
  const auto begin = std::chrono::steady_clock::now();
  Told told;
  for (int k = 0; k < 50; ++k) const CallWatch watch = told.watch();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s);
}

}  // namespace
}  // namespace graze
