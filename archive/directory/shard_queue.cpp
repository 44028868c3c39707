#include "archive/directory/shard_queue.h"

#include <utility>

namespace graze {

ShardQueue::ShardQueue(std::function<void(ShardBuffer)> write) : write_(std::move(write)) {}

ShardQueue::~ShardQueue() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void ShardQueue::push(ShardBuffer shard) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !waiting_ || failed_; });
  rethrow();
  if (failed_) return;
  if (!has_thread()) {
    write_here(std::move(shard));
    return;
  }
  waiting_ = std::move(shard);
  lock.unlock();
  changed_.notify_all();
}

bool ShardQueue::has_thread() {
  if (thread_.joinable()) return true;
  try {
    thread_ = std::thread([this] { loop(); });
  } catch (const std::exception&) {  // the system has none left, or no memory for one
    return false;
  }
  return true;
}

void ShardQueue::write_here(ShardBuffer shard) {
  try {
    write_(std::move(shard));
  } catch (...) {
    failed_ = true;
    throw;
  }
}

void ShardQueue::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return (!waiting_ && !busy_) || failed_; });
  rethrow();
}

bool ShardQueue::failed() const {
  const std::lock_guard lock(mutex_);
  return failed_;
}

void ShardQueue::rethrow() {
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void ShardQueue::loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return waiting_ || ended_; });
    if (!waiting_) return;
    ShardBuffer shard = std::move(*waiting_);
    waiting_.reset();
    busy_ = true;
    lock.unlock();
    changed_.notify_all();
    std::exception_ptr error;
    try {
      write_(std::move(shard));
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    busy_ = false;
    if (error) {
      error_ = error;
      failed_ = true;
      waiting_.reset();
    }
    changed_.notify_all();
    if (failed_) return;
  }
}

}  // namespace graze
