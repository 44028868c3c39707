#pragma once
// A stack for handlers of signals. A thread whose own stack has overflowed has nowhere else to run one: without it such
// a program ends without a word.

#include <csignal>
#include <cstddef>
#include <memory>
#include <new>

namespace graze {

/// The alternate signal stack of the thread that makes it, for handlers with SA_ONSTACK, until it is destroyed there. A
/// thread that has one of somebody else's (a sanitizer's, a host program's) keeps that, and without memory it has none.
/// No thread_local object: the C library ends a program that lacks the memory to note the end of one.
class SignalStack {
 public:
  SignalStack() noexcept : memory_(new (std::nothrow) char[kBytes]) {
    if (!memory_ || !install(memory_.get())) memory_.reset();
  }
  SignalStack(const SignalStack&) = delete;
  SignalStack& operator=(const SignalStack&) = delete;
  ~SignalStack() {
    if (!memory_) return;
    stack_t none{};
    none.ss_flags = SS_DISABLE;
    sigaltstack(&none, nullptr);
  }

  /// Gives one to the main thread, for good, which takes no memory.
  static void give_to_main_thread() noexcept {
    static char memory[kBytes];
    install(memory);
  }

 private:
  static constexpr std::size_t kBytes = std::size_t{64} << 10;  // some 10 kB are the processor's registers

  /// Whether the thread has taken it.
  static bool install(char* memory) noexcept {
    stack_t now{};
    if (sigaltstack(nullptr, &now) != 0 || (now.ss_flags & SS_DISABLE) == 0) return false;
    stack_t mine{};
    mine.ss_sp = memory;
    mine.ss_size = kBytes;
    return sigaltstack(&mine, nullptr) == 0;
  }

  std::unique_ptr<char[]> memory_;  // null: it is somebody else's
};

}  // namespace graze
