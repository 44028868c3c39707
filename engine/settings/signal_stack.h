#pragma once
// A stack for handlers of signals. A thread whose own stack has overflowed has nowhere else to run one: without it such
// a program ends without a word.

#include <csignal>
#include <cstddef>
#include <memory>
#include <new>

namespace graze {

/// The alternate signal stack of one thread, for handlers with SA_ONSTACK. A thread that has one of somebody else's (a
/// sanitizer's, a host program's) keeps that.
class SignalStack {
 public:
  SignalStack(const SignalStack&) = delete;
  SignalStack& operator=(const SignalStack&) = delete;
  ~SignalStack() {
    if (!memory_) return;
    stack_t none{};
    none.ss_flags = SS_DISABLE;
    sigaltstack(&none, nullptr);
  }

  /// Gives one to the calling thread for as long as it lives. Again, or without memory: does
  /// nothing.
  static void give_to_this_thread() noexcept { [[maybe_unused]] thread_local const SignalStack stack; }

 private:
  SignalStack() noexcept {
    stack_t now{};
    if (sigaltstack(nullptr, &now) != 0 || (now.ss_flags & SS_DISABLE) == 0) return;
    constexpr std::size_t kBytes = std::size_t{64} << 10;  // some 10 kB are the processor's registers
    memory_.reset(new (std::nothrow) char[kBytes]);
    if (!memory_) return;
    stack_t mine{};
    mine.ss_sp = memory_.get();
    mine.ss_size = kBytes;
    if (sigaltstack(&mine, nullptr) != 0) memory_.reset();
  }

  std::unique_ptr<char[]> memory_;  // null: it is somebody else's
};

}  // namespace graze
