#pragma once
// Writes shards from a thread of its own, so that simulating threads do not wait for a disk. One shard may wait while
// another is written; the producer of a third waits, so that memory stays bounded. Where no thread can be started
// producers write, one after the other.

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "archive/directory/shard.h"

namespace graze {

class ShardQueue {
 public:
  /// `write` is called for one shard after the other.
  explicit ShardQueue(std::function<void(ShardBuffer)> write);
  /// Writes what waits; a failure that was not told yet is lost.
  ~ShardQueue();

  /// Throws what a shard before failed with. After a failure nothing is written any more: the disk is not filled any
  /// further.
  void push(ShardBuffer shard);
  /// Waits until all is written. Throws as push().
  void drain();
  bool failed() const;

 private:
  void loop();
  void rethrow();  // once
  bool has_thread();
  void write_here(ShardBuffer shard);  // in the caller, which holds the mutex

  const std::function<void(ShardBuffer)> write_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<ShardBuffer> waiting_;
  bool busy_ = false, ended_ = false, failed_ = false;
  std::exception_ptr error_;  // not told yet
  std::thread thread_;
};

}  // namespace graze
